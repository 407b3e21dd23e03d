"""Relations between identifications: the same experiment told otherwise gives the same parameters."""

import csv

import numpy as np
import pytest

from fuzz.judging import answer

MODEL = """equations = [
  "(m1*p**2 + b1*p + k1)*X1 + k2*(X1 - X2) = F",
  "(m2*p**2)*X2 + b2*p*X2 + k2*(X2 - X1) = 0",
]
known = {{ m1 = {m1}, m2 = {m2} }}
estimate = ["k1", "k2", "b1", "b2"]
"""


def drawn(seed):
    """Frequencies, force and amplitudes of a chain of two masses, with a little noise."""
    rng = np.random.default_rng(seed)
    k1, k2, b1, b2 = rng.uniform(1e4, 3e4), rng.uniform(1e4, 3e4), rng.uniform(20, 60), rng.uniform(20, 60)
    w = rng.uniform(20, 90, 7)
    force = rng.uniform(5, 20, 7) * np.exp(2j * np.pi * rng.random(7))
    x = []
    for omega, f in zip(w, force, strict=True):
        matrix = np.array(
            [[-10 * omega**2 + 1j * b1 * omega + k1 + k2, -k2], [-k2, -6 * omega**2 + 1j * b2 * omega + k2]]
        )
        x.append(np.linalg.solve(matrix, [f, 0]))
    x = np.array(x) * (1 + 0.01 * rng.standard_normal((7, 2)))
    return {"w": w, "F": force, "X1": x[:, 0], "X2": x[:, 1], "m1": 10.0, "m2": 6.0}


def values(data, folder, *, polar=False, hertz=False, names=None):
    """Parameters in the order k1, k2, b1, b2."""
    text = MODEL.format(**{name: repr(float(data[name])) for name in ("m1", "m2")})
    for old, new in (names or {}).items():
        text = text.replace(old, new)
    (folder / "model.toml").write_text(text, encoding="utf-8")
    columns = {"frequency_Hz": data["w"] / (2 * np.pi)} if hertz else {"frequency_rad_s": data["w"]}
    for name in ("F", "X1", "X2"):
        if polar:
            columns |= {
                f"{name}_amplitude": np.abs(data[name]),
                f"{name}_phase_deg": np.degrees(np.angle(data[name])),
            }
        else:
            columns |= {f"{name}_re": data[name].real, f"{name}_im": data[name].imag}
    with (folder / "data.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows([[float(x) for x in row] for row in zip(*columns.values(), strict=True)])
    found = answer(["identify", str(folder / "model.toml"), str(folder / "data.csv")])
    assert found.document is not None, found
    parameters = found.document["parameters"]
    return np.array([parameters[(names or {}).get(name, name)]["value"] for name in ("k1", "k2", "b1", "b2")])


def all_times(data, factor, *which):
    return data | {name: data[name] * factor for name in which}


def rows(data, order):
    return data | {name: data[name][order] for name in ("w", "F", "X1", "X2")}


SIGNALS = ("F", "X1", "X2")
RELATIONS = {
    "rows in another order": (lambda d: rows(d, slice(None, None, -1)), {}, (1, 1)),
    "every row twice": (lambda d: rows(d, [*range(7), *range(7)]), {}, (1, 1)),
    "the same turn of all signals": (lambda d: all_times(d, np.exp(0.8j), *SIGNALS), {}, (1, 1)),
    "larger signals": (lambda d: all_times(d, 30.0, *SIGNALS), {}, (1, 1)),
    "amplitudes and phases": (dict, {"polar": True}, (1, 1)),
    "hertz": (dict, {"hertz": True}, (1, 1)),
    "other names": (dict, {"names": {"k1": "beta", "k2": "S", "b1": "zeta", "b2": "E"}}, (1, 1)),
    "another unit of force and mass": (lambda d: all_times(d, 1e-3, "F", "m1", "m2"), {}, (1e-3, 1e-3)),
    "a slower clock": (
        lambda d: d | {"w": d["w"] / 10, "m1": d["m1"] * 100, "m2": d["m2"] * 100},
        {},
        (1, 10),
    ),
}


@pytest.mark.parametrize("seed", range(3))
def test_the_same_experiment_told_otherwise_gives_the_same_parameters(tmp_path, seed):
    data = drawn(seed)
    plain = values(data, tmp_path)
    wrong = {}
    for name, (change, options, (stiffness, damping)) in RELATIONS.items():
        found = values(change(data), tmp_path, **options) / np.repeat([stiffness, damping], 2)
        worst = float(np.max(np.abs(found / plain - 1)))
        if worst > 1e-6:
            wrong[name] = worst
    assert wrong == {}
