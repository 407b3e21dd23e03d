"""Unbalance response, 4 planes × 6 sensors × 1000 speeds, of the reference rotor on damped bearings.

Against ROSS' `Rotor.transfer_matrix`, called once per speed: the fastest public way to these numbers.
`run_freq_response` and `run_unbalance_response` call it, too, and then store receptances of all unknowns
(1 GB here) or repeat work per plane; both take longer. The receptance between sensor and plane in the
x-direction times ω² is the influence coefficient. At 92 and 460 elements ROSS is timed at 40 and 2 of the
1000 speeds and its time scaled up.

Answers: all numbers against ROSS at 23 elements. Finer meshes are compared with the same equations solved in
higher precision (tests/helpers/dense_rotor.py) at five speeds, two of them at resonance and one where an
amplitude nearly vanishes (a tiny difference of large numbers: errors count relative to the largest of the six
sensors); the note says how far ROSS is from those. "exact" is a factorisation of the banded equations
in float64 at every speed, as ROSS' is of dense ones: both lose digits with the fourth power of the number of
elements. "fast" loses less, and at 460 elements it alone stays within 1e-6 of the truth.
"""

from __future__ import annotations

from functools import partial
from typing import Any
from unittest.mock import patch

import numpy as np

import fem
import fem.response
from benchmarks.rotors import ROSS, SIZES, Bearing, judge, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, once, relative_difference, scaling

BEARING = Bearing(damping=2e4)
PLANES = (3, 8, 14, 20)  # nodes of the 23-element rotor
SENSORS = (2, 6, 10, 15, 18, 22)
SPEEDS = np.linspace(1.0, 1000.0, 1000)  # across the first two critical speeds
JUDGED = (134, 540, 143, 700, 900)  # of them in higher precision, the first two at resonance
REQUIRED = {"fast": 1000.0, "exact": 20.0}


def at(nodes: tuple[int, ...], times: int) -> list[int]:
    return [times * (node - 1) + 1 for node in nodes]


def with_ross(rotor: Any, times: int, speeds: np.ndarray) -> np.ndarray:
    step = rotor.number_dof
    pick = np.ix_(*([step * (node - 1) for node in at(nodes, times)] for nodes in (SENSORS, PLANES)))
    return np.array([omega**2 * rotor.transfer_matrix(speed=omega)[pick] for omega in speeds])


def trusted(rotor: fem.Rotor, times: int, speed: float) -> np.ndarray:
    columns = []
    for plane in at(PLANES, times):
        X, _ = judge().response(rotor, {plane: 1.0}, speed, np.longdouble)
        columns.append(X[np.array(at(SENSORS, times)) - 1].astype(complex))
    return np.array(columns).T


def to_largest(a: np.ndarray, b: np.ndarray) -> float:
    """Largest error of (speed, sensor, plane) relative to the largest amplitude among the sensors."""
    return float((np.abs(a - b) / np.abs(b).max(axis=1, keepdims=True)).max())


def task() -> Row:
    return run({23: SIZES[23]})[0]


def run(sizes: dict[int, int] = SIZES) -> list[Row]:
    result: list[Row] = []
    seconds: dict[str, dict[int, float]] = {"fast": {}, "exact": {}}
    best = dict(REQUIRED)
    for n, times in sizes.items():
        rows = table(times)
        make = lambda rows=rows: rotorid_rotor(rows, BEARING)  # noqa: E731
        theirs = lambda rows=rows: ross_rotor(rows, BEARING)  # noqa: E731

        def ours(rotor: fem.Rotor, method: Any, times: int = times) -> np.ndarray:
            banded = partial(fem.response.Receptance, exact=method == "exact")
            with patch.object(fem.response, "Receptance", banded):
                return fem.influence(rotor, at(PLANES, times), at(SENSORS, times), SPEEDS).W

        if n == 23:
            expected = with_ross(theirs(), times, SPEEDS)
            peer, scaled, note = (
                best_of(theirs, lambda rotor: with_ross(rotor, 1, SPEEDS), 2),
                "",
                "",
            )
            apart = {m: relative_difference(ours(make(), m), expected) for m in seconds}
        else:
            count = 40 if n == 92 else 2
            some = SPEEDS[[JUDGED[0], JUDGED[1], *range(count - 2)]]
            duration, found = once(theirs, lambda rotor, some=some, t=times: with_ross(rotor, t, some))
            peer, scaled = duration * len(SPEEDS) / count, f", {count} speeds scaled"
            higher = np.array([trusted(make(), times, SPEEDS[k]) for k in JUDGED])
            answers = {m: ours(make(), m) for m in seconds}
            apart = {m: to_largest(answers[m][list(JUDGED)], higher) for m in seconds}
            off = to_largest(found[:2], higher[:2])
            note = f"of 19-digit arithmetic; {ROSS} is off by {off:.0e}"
            if n == 460:
                note += f", our factorisation in float64 by {apart.pop('exact'):.0e}"
        for method in apart:
            repeat = {"fast": 50 if n == 23 else 20, "exact": 3}[method]
            seconds[method][n] = best_of(make, lambda rotor, m=method: ours(rotor, m), repeat)
            row = Row(
                task=f"unbalance response, 4 × 6 × 1000, {n} elements{', check' * (method == 'exact')}",
                ours=f"rotorid {method}",
                our_seconds=seconds[method][n],
                peer=f"{ROSS} transfer_matrix{scaled}",
                peer_seconds=peer,
                difference=apart[method],
                allowed=1e-6,
                required_ratio=best[method],
                note=note,
            )
            best[method] = max(best[method], row.ratio)
            result.append(row)
    if len(sizes) == 1:
        return result
    return [*result, scaling("unbalance response, fast", seconds["fast"], 92, 460)]
