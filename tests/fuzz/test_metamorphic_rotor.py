"""Relations between rotors: mirrored, scaled, divided, told in other units, they answer as physics says."""

import csv

import numpy as np
import pytest

from fuzz.judging import answer

COLUMNS = (
    "length_m",
    "diameter_m",
    "inner_diameter_m",
    "mass_kg",
    "polar_inertia_kg_m2",
    "diametral_inertia_kg_m2",
    "support_stiffness_N_per_m",
    "youngs_modulus_Pa",
    "density_kg_per_m3",
)
L, D, BORE, MASS, POLAR, DIAMETRAL, STIFFNESS, MODULUS, DENSITY = range(9)


def drawn(seed):
    """Rows of a rotor table: elements, and a last row that only stands on the right end."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(5, 10))
    rows = np.zeros((n + 1, 9))
    rows[:, L] = rng.uniform(0.08, 0.2, n + 1)
    rows[:, D] = rng.uniform(0.04, 0.08, n + 1)
    rows[:, BORE] = rng.choice([0.0, 0.02], n + 1)
    rows[:, MODULUS] = 2.1e11
    rows[:, DENSITY] = 7800.0
    for node in rng.choice(np.arange(1, n), 2, replace=False):
        rows[node, [MASS, POLAR, DIAMETRAL]] = (
            rng.uniform(5, 20),
            rng.uniform(0.05, 0.1),
            rng.uniform(0.03, 0.05),
        )
    rows[[0, n], STIFFNESS] = rng.uniform(2e6, 5e7, 2)
    rows[n, L] = 0.0
    return rows


def write(rows, path, columns=COLUMNS):
    with path.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows([columns, *rows.tolist()])
    return str(path)


def criticals(rows, path, columns=COLUMNS):
    found = answer(["critical", write(rows, path, columns), "-n", "3"])
    assert found.document is not None, found
    return np.array(found.document["critical_speeds_rad_s"])


def mirrored(rows):
    """The other end first: elements and what stands on nodes change places differently."""
    out = rows.copy()
    out[:, :] = rows[::-1]
    out[:-1, [L, D, BORE, MODULUS, DENSITY]] = rows[:-1][::-1][:, [L, D, BORE, MODULUS, DENSITY]]
    out[-1, [L, D, BORE, MODULUS, DENSITY]] = rows[-1][[L, D, BORE, MODULUS, DENSITY]]
    return out


def scaled(**factors):
    def change(rows):
        out = rows.copy()
        for name, factor in factors.items():
            out[:, globals()[name]] *= factor
        return out

    return change


S = 1.7
RELATIONS = {
    "mirrored": (mirrored, 1.0, 1e-9),
    "stiffer everywhere": (scaled(MODULUS=4.0, STIFFNESS=4.0), 2.0, 1e-9),
    "heavier everywhere": (scaled(DENSITY=9.0, MASS=9.0, POLAR=9.0, DIAMETRAL=9.0), 1 / 3, 1e-9),
    "larger everywhere": (
        scaled(L=S, D=S, BORE=S, MASS=S**3, POLAR=S**5, DIAMETRAL=S**5, STIFFNESS=S),
        1 / S,
        1e-9,
    ),
}


@pytest.mark.parametrize("seed", range(3))
def test_criticals_follow_the_laws_of_similarity(tmp_path, seed):
    rows = drawn(seed)
    plain = criticals(rows, tmp_path / "r.csv")
    assert len(plain) == 3
    wrong = {}
    for name, (change, factor, tolerance) in RELATIONS.items():
        found = criticals(change(rows), tmp_path / "r.csv") / factor
        worst = float(np.max(np.abs(found / plain - 1)))
        if worst > tolerance:
            wrong[name] = worst
    assert wrong == {}
