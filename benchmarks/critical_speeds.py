"""Five critical speeds and mode shapes of the reference rotor, 23, 92 and 460 elements, against ROSS.

ROSS' `run_modal(speed=0)` finds each frequency twice, once per lateral plane, besides axial and torsional
modes; `num_modes=22` is the smallest number that holds the fifth lateral one. At 23 elements its sparse and
dense ways are both timed, and the faster one counts; the dense way takes minutes at larger sizes. At 460
elements five frequencies take minutes the sparse way, too (ARPACK does not converge), so ROSS is asked for
three there: the ratio is a lower bound.

Answers: frequencies and shapes against ROSS at 23 elements. ROSS loses digits on fine meshes (its first
frequency is wrong by 6e-4 at 460 elements), so both are compared there with the same equations solved in
higher precision (19 digits, tests/helpers/dense_rotor.py); the note says how far ROSS is from that.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import fem
from benchmarks.rotors import ROSS, SIZES, Bearing, judge, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, once, relative_difference, scaling

REQUIRED = 50.0
N = 5


def with_ross(rotor: Any, sparse: bool = True) -> Any:
    few = len(rotor.nodes) > 400
    return rotor.run_modal(speed=0.0, num_modes=12 if few else 22, sparse=sparse)


def lateral(modal: Any, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and shapes of the lateral modes among ROSS' modes, at most (5,) and (5, N)."""
    frequencies, shapes = [], []
    vectors = modal.evectors[: 6 * nodes].reshape(nodes, 6, -1)
    for k, frequency in enumerate(modal.wn):
        size = np.linalg.norm(vectors[:, :, k], axis=0)
        if max(size[0], size[1]) > max(size[2], size[5]):
            frequencies.append(frequency)
            shapes.append(in_one_plane(vectors[:, 0, k], vectors[:, 1, k]))
    return np.array(frequencies)[: 2 * N : 2], np.array(shapes)[: 2 * N : 2]


def in_one_plane(X: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """The real shape that both planes share, largest value 1; a double mode mixes them in any way."""
    shape = np.linalg.svd(np.array([X, Y]).astype(complex))[2][0]
    return (shape / shape[np.argmax(np.abs(shape))]).real


def difference(ours: fem.Modes, frequencies: np.ndarray, shapes: np.ndarray) -> float:
    mine = ours.shapes.T
    mine = mine / mine[np.arange(len(mine)), np.argmax(np.abs(mine), axis=1)][:, None]
    apart = np.abs(mine - shapes).max()
    return max(relative_difference(ours.frequencies, frequencies), float(apart))


def trusted(rotor: fem.Rotor, frequencies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    found = [judge().polished(rotor, 0.0, 1j * omega, steps=2) for omega in frequencies]
    return (
        np.array([float(lam.imag) for lam, _, _ in found]),
        np.array([in_one_plane(X, Y) for _, X, Y in found]),
    )


def task() -> Row:
    return run({23: SIZES[23]})[0]


def run(sizes: dict[int, int] = SIZES) -> list[Row]:
    result: list[Row] = []
    seconds: dict[int, float] = {}
    for n, times in sizes.items():
        rows = table(times)
        make = lambda rows=rows: rotorid_rotor(rows, Bearing())  # noqa: E731
        theirs = lambda rows=rows: ross_rotor(rows, Bearing())  # noqa: E731
        ours = fem.critical_speeds(make(), n=N)
        seconds[n] = best_of(make, lambda rotor: fem.critical_speeds(rotor, n=N), 50)
        if n == 23:
            ways = {way: with_ross(theirs(), way) for way in (True, False)}
            apart = max(difference(ours, *lateral(modal, n + 1)) for modal in ways.values())
            peer, sparse = min(
                (best_of(theirs, lambda rotor, way=way: with_ross(rotor, way), 5), way) for way in ways
            )
            way, note = "sparse" if sparse else "dense", ""
        else:
            peer, modal = once(theirs, with_ross)
            frequencies, shapes = trusted(make(), ours.frequencies)
            apart, way = difference(ours, frequencies, shapes), "sparse"
            found = lateral(modal, n + 1)[0]
            off = relative_difference(found, frequencies[: len(found)])
            way += f", {len(found)} only" if len(found) < N else ""
            note = f"of 19-digit arithmetic; {ROSS} is off by {off:.0e}"
        result.append(
            Row(
                task=f"5 critical speeds and shapes, {n} elements",
                ours="rotorid",
                our_seconds=seconds[n],
                peer=f"{ROSS} run_modal, {way}",
                peer_seconds=peer,
                difference=apart,
                allowed=1e-6,
                required_ratio=max([REQUIRED, *(row.ratio for row in result)]),
                note=note,
            )
        )
    if len(sizes) == 1:
        return result
    return [*result, scaling("5 critical speeds and shapes", seconds, 92, 460)]
