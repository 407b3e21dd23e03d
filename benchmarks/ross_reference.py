"""Random rotors and what ROSS answers for them: writes tests/data/ross_reference.json.

Run `.venv-bench/bin/python -m benchmarks.ross_reference` (some minutes); only public functions of ROSS
are used. tests/fem/test_ross.py builds the same rotors in `fem` and compares.

Conventions of ROSS 2.3.0, from its documentation, its source and by trial, and what follows from them
--------------------------------------------------------------------------------------------------------
- Nodes count from 0, here from 1. Six unknowns per node: x, y, z, α, β, θ; axial (z) and torsional (θ)
  motion is not coupled to bending, but stands among the modes: modes without lateral motion are left out
  here. The rotation is from x to y, as here; β = dx/dz, but α = −dy/dz. Gyroscopic terms come as C + Ω G.
- `run_unbalance_response(node, magnitude, phase)`: force Re[U ω² e^{iφ} e^{iωt}] in x and −i times that in
  y; `forced_resp` holds complex amplitudes, positive phase = lead, equal to ours without a change of sign.
  The probe functions of its result show 2π − arg instead: a lag.
- `wd` = Im λ, `wn` = |λ|, `log_dec` = 2π ζ / √(1 − ζ²) with ζ = −Re λ / |λ|: the same as −2π Re λ / |Im λ|.
  Modes that die within a fraction of a turn (Im λ below 0.1 |λ|) count as overdamped in `fem`, not in ROSS;
  they are left out here.
- A disc keeps its diametral inertia and its gyroscopic moment whatever `rotary_inertia` and `gyroscopic` of
  the elements are; with both on, as here, there is no difference. The gyroscopic matrix of the shaft is
  twice its rotary inertia matrix, as here.
- Bearings are taken at the speed of rotation, both for whirl and for response. A table of two speeds is
  interpolated linearly, of three by a parabola, both extrapolated without a word by the element; from four
  speeds on by SciPy's `UnivariateSpline` with its default smoothing: a cubic *fit* whose squared residuals
  may add up to the number of speeds in units of N/m or N·s/m. The stiffness hardly feels it; damping of 1e3
  N·s/m may be wrong by 1e-3 at the table's own speeds (`smoothing_of_tables` below measures it). So each
  analysis here gives ROSS that stretch of the table in which the speed lies: two speeds, interpolated
  linearly.
- `beta` of its elements adds β K to the damping, but not the circulatory matrix −iΩβK that rotating damping
  brings: material damping of a rotating shaft, and the instability it causes, cannot be compared.
- A pedestal is a `PointMass` at a node beyond the shaft, with one bearing linked to it and one to the
  ground.
- Shear: G = E / (2 (1 + ν)), coefficient after Cowper for hollow sections, as here. Its element has two
  unknowns per node and plane; the shear strain, constant in the element, is tied to the third derivative of
  a cubic deflection. So it is exact for a shaft loaded at nodes and converges as h² in dynamics, where the
  element of `fem` converges as h⁴. Without shear both elements are the same cubic one, and answers must
  agree on every mesh. With shear ROSS' answers are computed on meshes refined 2, 4, 8 and 16 times and
  extrapolated to h = 0 by Richardson's scheme (h², h⁴, h⁶). Their own error estimate is stored with them:
  what the last step of the scheme changes, and three times the difference between ROSS' sparse and dense
  way on the finest mesh.
- Digits: ROSS forms M⁻¹K and takes eigenvalues of the state matrix next to 1 rad/s, which costs about eps ·
  (highest / lowest frequency)² in relative accuracy of λ, 1e-9 at 30 elements and more where the log
  decrement is a small part of λ.
"""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

FILE = Path(__file__).resolve().parents[1] / "tests" / "data" / "ross_reference.json"
MODES = 6
SPEEDS_OF_TABLES = (0.0, 400.0, 800.0, 1200.0, 1600.0)
LEVELS = (2, 4, 8, 16)
KINDS = ("isotropic", "symmetric", "symmetric table", "anisotropic", "table", "pedestal")


def definition(seed: int, shear: bool) -> dict[str, Any]:
    """A random rotor as plain numbers of four digits; the kind of bearings goes round with the seed."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    n = int(rng.integers(3, 8)) if shear else int(rng.integers(3, 31))
    n = 30 if seed == 100 else n
    total = rng.uniform(0.6, 2.5)
    lengths = rng.uniform(0.5, 1.5, n)
    lengths *= total / lengths.sum()
    middle = rng.uniform(0.04, 0.09) * np.sqrt(total)
    steps = np.repeat(rng.uniform(0.75, 1.4, n), rng.integers(1, 4, n))[:n]
    outer = middle * steps
    inner = np.where(rng.random(n) < 0.35, outer * rng.uniform(0.2, 0.7, n), 0.0)
    ends = (1, n + 1) if n < 6 else (int(rng.integers(1, 3)), int(rng.integers(n, n + 2)))
    discs = []
    for node in rng.choice(np.arange(1, n + 2), size=min(int(rng.integers(1, 5)), n), replace=False):
        radius, mass = rng.uniform(0.08, 0.25), rng.uniform(2, 25)
        diametral = mass * radius**2 * rng.uniform(0.25, 0.4)
        discs.append([int(node), _four(mass), _four(mass * radius**2 / 2), _four(diametral)])
    supports = [_support(rng, node, kind) for node in ends]
    if seed % 4 == 3:
        seal = _support(rng, int(rng.integers(2, n + 1)), "symmetric")
        supports.append(seal | {"kind": "seal", "stiffness": _scaled(seal["stiffness"], 0.02)})
    planes = rng.choice(np.arange(1, n + 2), size=2, replace=False)
    return {
        "seed": seed,
        "bearings": kind,
        "shear": shear,
        "length": [_four(x) for x in lengths],
        "outer_diameter": [_four(x) for x in outer],
        "inner_diameter": [_four(x) for x in inner],
        "youngs_modulus": _four(rng.uniform(1.9e11, 2.15e11)),
        "density": _four(rng.uniform(7600, 7900)),
        "poisson_ratio": _four(rng.uniform(0.27, 0.32)),
        "discs": sorted(discs),
        "supports": supports,
        "speeds": sorted(_four(x) for x in rng.uniform(60, 1500, 3)),
        "unbalance": [
            [int(node), _four(rng.uniform(1e-4, 2e-3)), _four(rng.uniform(-3, 3))] for node in sorted(planes)
        ],
    }


def _four(value: float) -> float:
    return float(f"{value:.4g}")


def _scaled(table: list[list[list[float]]], factor: float) -> list[list[list[float]]]:
    return [[[_four(factor * x) for x in row] for row in matrix] for matrix in table]


def _support(rng: np.random.Generator, node: int, kind: str) -> dict[str, Any]:
    """Stiffness and damping as a list of 2 × 2 matrices, one per speed of the table, or one alone."""
    k, c = 10 ** rng.uniform(6.3, 7.8), 10 ** rng.uniform(3.0, 4.2)
    cross = 0.0 if kind in ("isotropic", "pedestal") else rng.uniform(0.02, 0.3)
    other, damping = (rng.uniform(0.4, 1.5, 2) if kind in ("anisotropic", "table") else (1.0, 1.0)), 0.0
    back = rng.uniform(0.3, 1.0) if kind in ("anisotropic", "table") else 1.0
    damping = rng.uniform(0.0, 0.2) if kind in ("anisotropic", "table") else 0.0
    speeds = SPEEDS_OF_TABLES if "table" in kind else ()
    stiffness, dampings = [], []
    for speed in speeds or (0.0,):
        s = 1 + rng.uniform(0.2, 0.5) * speed / 1600 if speeds else 1.0
        d = 1 / (1 + rng.uniform(0.5, 1.0) * speed / 1600) if speeds else 1.0
        stiffness.append([[s * k, cross * k], [-back * cross * k, s * k * other[0]]])
        dampings.append([[d * c, damping * c], [damping * c, d * c * other[1]]])
    pedestal = None
    if kind == "pedestal":
        pedestal = {
            "mass": _four(rng.uniform(5, 40)),
            "stiffness": [_four(x * k) for x in rng.uniform(1, 5, 2)],
            "damping": [_four(x * c) for x in rng.uniform(0.1, 0.5, 2)],
        }
    return {
        "node": node,
        "kind": "bearing",
        "speeds": list(speeds),
        "stiffness": _scaled(stiffness, 1.0),
        "damping": _scaled(dampings, 1.0),
        "pedestal": pedestal,
    }


def ross_rotor(data: dict[str, Any], speed: float, times: int = 1) -> Any:
    """The rotor in ROSS, every element cut into `times` equal ones; tables only around `speed`."""
    from benchmarks.rotors import ross

    steel = ross.Material(
        "steel", rho=data["density"], E=data["youngs_modulus"], Poisson=data["poisson_ratio"]
    )
    shaft = [
        ross.ShaftElement(
            L=L / times,
            idl=inner,
            odl=outer,
            material=steel,
            shear_effects=data["shear"],
            rotary_inertia=True,
            gyroscopic=True,
        )
        for L, inner, outer in zip(
            data["length"], data["inner_diameter"], data["outer_diameter"], strict=True
        )
        for _ in range(times)
    ]
    discs = [
        ross.DiskElement(n=times * (node - 1), m=m, Ip=polar, Id=diametral)
        for node, m, polar, diametral in data["discs"]
    ]
    bearings, masses = [], []
    free = len(shaft) + 1
    for i, support in enumerate(data["supports"]):
        names = ("xx", "xy", "yx", "yy")
        values: dict[str, Any] = {}
        for letter, table in (("k", support["stiffness"]), ("c", support["damping"])):
            entries = np.array(table).reshape(-1, 4).T
            values |= {letter + name: x for name, x in zip(names, entries, strict=True)}
        if support["speeds"]:
            k = int(np.clip(np.searchsorted(support["speeds"], speed) - 1, 0, len(support["speeds"]) - 2))
            values = {name: x[k : k + 2] for name, x in values.items()}
            values["frequency"] = np.array(support["speeds"][k : k + 2])
        else:
            values = {name: float(x[0]) for name, x in values.items()}
        pedestal = support["pedestal"]
        if pedestal:
            values["n_link"] = free
            masses.append(ross.PointMass(n=free, m=pedestal["mass"], tag=f"foot {i}"))
            kx, ky = pedestal["stiffness"]
            cx, cy = pedestal["damping"]
            bearings.append(ross.BearingElement(n=free, kxx=kx, kyy=ky, cxx=cx, cyy=cy, tag=f"ground {i}"))
            free += 1
        bearings.append(ross.BearingElement(n=times * (support["node"] - 1), tag=f"support {i}", **values))
    return ross.Rotor(shaft, discs, bearings, point_mass_elements=masses)


def whirl(rotor: Any, speed: float, sparse: bool) -> tuple[np.ndarray, list[str]]:
    """Lowest lateral modes as `wd`, `log_dec`, shape (modes, 2), and their directions."""
    modal = rotor.run_modal(speed, num_modes=30 if sparse else 4 * rotor.ndof, sparse=sparse)
    # Lateral unknowns and the others, displacements only; pedestals have three unknowns each, x, y, z.
    vectors = np.abs(modal.evectors[: 6 * len(rotor.nodes_pos)])
    lateral = np.isin(np.arange(len(vectors)) % 6, (0, 1, 3, 4))
    is_lateral = np.linalg.norm(vectors[lateral], axis=0) > np.linalg.norm(vectors[~lateral], axis=0)
    keep = np.flatnonzero((modal.wd > 0.1 * modal.wn) & is_lateral[: len(modal.wd)])[:MODES]
    if len(keep) < MODES:
        raise RuntimeError(f"only {len(keep)} lateral modes found")
    directions = modal.whirl_direction()[keep]
    return np.array([modal.wd[keep], modal.log_dec[keep]]).T, [str(word) for word in directions]


def unbalanced(rotor: Any, data: dict[str, Any], speed: float, times: int = 1) -> np.ndarray:
    """Complex amplitudes in x and y of the nodes of the coarse mesh, shape (nodes, 2)."""
    nodes, sizes, phases = zip(*data["unbalance"], strict=True)
    found = rotor.run_unbalance_response(
        [times * (node - 1) for node in nodes], list(sizes), list(phases), frequency=np.array([speed])
    ).forced_resp[:, 0]
    at = 6 * times * np.arange(len(data["length"]) + 1)
    return np.array([found[at], found[at + 1]]).T


def richardson(values: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Limit of values at h, h/2, h/4, … with errors in even powers of h, and what the last step changed."""
    power = 4
    while len(values) > 1:
        before = values[-1]
        values = [(power * b - a) / (power - 1) for a, b in pairwise(values)]
        power *= 4
    return values[-1], np.abs(values[-1] - before)


def answers(data: dict[str, Any]) -> list[dict[str, Any]]:
    rows = []
    for speed in data["speeds"]:
        levels = LEVELS if data["shear"] else (1,)
        modes, amplitudes = [], []
        for times in levels:
            rotor = ross_rotor(data, speed, times)
            found, directions = whirl(rotor, speed, sparse=len(rotor.nodes_pos) > 40)
            modes.append(found)
            amplitudes.append(unbalanced(rotor, data, speed, times))
        row: dict[str, Any] = {"speed": speed}
        if data["shear"]:
            w, w_error = richardson(modes)
            w_error = w_error + 3 * np.abs(whirl(rotor, speed, sparse=False)[0] - modes[-1])
            Z, Z_error = richardson(amplitudes)
            row["error_wd"] = float(f"{(w_error[:, 0] / w[:, 0]).max():.1e}")
            row["error_log_dec"] = float(f"{(w_error[:, 1] / np.abs(w[:, 1])).max():.1e}")
            row["error_response"] = float(f"{Z_error.max() / np.abs(Z).max():.1e}")
        else:
            w, Z = modes[0], amplitudes[0]
        row["wd"], row["log_dec"] = (_digits(column) for column in w.T)
        row["direction"] = "".join(word[0] for word in directions)
        for name, part in (("x", Z[:, 0]), ("y", Z[:, 1])):
            row[f"{name}_amplitude"] = _digits(np.abs(part))
            row[f"{name}_phase"] = _digits(np.angle(part))
        rows.append(row)
    return rows


def _digits(values: np.ndarray) -> list[float]:
    return [float(f"{x:.15g}") for x in values]


def smoothing_of_tables() -> float:
    """Relative error of ROSS' damping at the speeds of a five-row table itself, docstring above."""
    from benchmarks.rotors import ross

    speeds, damping = np.array(SPEEDS_OF_TABLES), np.array([1500.0, 1490.0, 1455.0, 1430.0, 1400.0])
    bearing = ross.BearingElement(n=0, kxx=1e7 + 0 * speeds, cxx=damping, frequency=speeds)
    found = np.array([bearing.C(speed)[0, 0] for speed in speeds])
    return float(np.abs(found / damping - 1).max())


def main() -> None:
    from benchmarks.rotors import ross

    rotors = [definition(seed, shear=False) for seed in range(100, 120)]
    rotors += [definition(seed, shear=True) for seed in range(200, 208)]
    for data in rotors:
        data["answers"] = answers(data)
        print(data["seed"], data["bearings"], len(data["length"]), "elements", flush=True)
    text = json.dumps({"ross": ross.__version__, "rotors": rotors}, separators=(",", ":"))
    FILE.write_text(text.replace('{"seed"', '\n{"seed"') + "\n", encoding="utf-8")
    print(f"{FILE.name}: {len(text) / 1000:.0f} kB")
    print(f"ROSS smooths the damping of a table by up to {smoothing_of_tables():.1e}")


if __name__ == "__main__":
    main()
