"""Five critical speeds and mode shapes of the reference rotor against ROSS `run_modal(speed=0)`.

ROSS finds each frequency twice, once per lateral plane, besides axial and torsional modes: `num_modes=22` is
the smallest number that holds the fifth lateral one. Its dense way is the faster one here. Frequencies and
shapes are compared.
"""

from __future__ import annotations

from operator import methodcaller
from typing import Any

import numpy as np

import fem
from benchmarks.rotors import ROSS, Bearing, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, relative_difference

N = 5
with_ross = methodcaller("run_modal", speed=0.0, num_modes=22, sparse=False)


def lateral(modal: Any, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and shapes of the lateral modes among ROSS' modes, (5,) and (5, N)."""
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


def difference(modes: fem.Modes, modal: Any) -> float:
    frequencies, shapes = lateral(modal, modes.shapes.shape[0])
    ours = modes.shapes.T
    ours = ours / ours[np.arange(N), np.argmax(np.abs(ours), axis=1)][:, None]
    return max(relative_difference(modes.frequencies, frequencies), float(np.abs(ours - shapes).max()))


def make(times: int = 1) -> fem.Rotor:
    return rotorid_rotor(table(times), Bearing())


def ours(rotor: fem.Rotor) -> fem.Modes:
    return fem.critical_speeds(rotor, n=N)


def task() -> Row:
    theirs = lambda: ross_rotor(table(), Bearing())  # noqa: E731
    return Row(
        task=f"{N} critical speeds and shapes, 23 elements",
        our_seconds=best_of(make, ours, 50),
        peer=f"{ROSS} run_modal",
        peer_seconds=best_of(theirs, with_ross, 5),
        difference=difference(ours(make()), with_ross(theirs())),
        required_ratio=50.0,
        goal=120.0,
    )
