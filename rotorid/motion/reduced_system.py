"""A rotor's equations of motion with fewer unknowns (Craig and Bampton): some nodes, and modes between them.

The deflections of the kept nodes stay as they are, the others follow as they do at rest, and with the kept
nodes held still the others have natural modes, of which the lowest stay. Static deflections of the kept nodes
are exact. Source: R. R. Craig, M. C. C. Bampton, AIAA Journal 6 (1968) 1313.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted, percent
from rotorid.motion.system import MotionSystem

ENOUGH = 3e-4
"""Error of the natural frequencies at which no more modes are needed."""
_RIGID = 1e-6
_COMPARED = 2.0
"""Frequencies are compared up to this many times the highest speed."""


@dataclass(frozen=True, eq=False)
class ReducedSystem:
    """The system with fewer unknowns, how many modes it has in both planes, and what that costs.

    Attributes
    ----------
    system
        Its unknowns are `x7`, `y7` … of the kept nodes, feet of pedestals, and `mode_1` …
    modes
        How many modes stay.
    error
        Largest relative error of the natural frequencies without damping, those below twice the highest speed
        or at least the first two that bend the shaft, at the lowest speed; bearings with films left out.
        Infinite where fewer unknowns move.
    """

    system: MotionSystem
    modes: int
    error: float

    @property
    def note(self) -> str:
        """How many unknowns move, and what that costs."""
        size, modes = counted(self.system.size, "unknown"), counted(self.modes, "mode")
        high = f"natural frequencies without films are high by {percent(self.error)} % at most"
        if self.error == np.inf:
            high = "NOT ENOUGH for its natural frequencies up to twice the speed (--modes)"
        return f"of the rotor {size} move, {modes} among them; {high}"


def reduced_system(system: MotionSystem, nodes: Sequence[int], modes: int | None = None) -> ReducedSystem:
    """Keep some nodes, those of forces and so many modes between them.

    Parameters
    ----------
    system
        All unknowns.
    nodes
        To be kept, besides those of forces.
    modes
        In both planes together; None: as many as bring the error down to `ENOUGH`.

    Raises
    ------
    ValueError
        For nodes that do not move, and more modes than there are.
    """
    from scipy.linalg import eigh

    kept_nodes = sorted({*nodes, *(force.node for force in system.forces)})
    feet = [i for i, name in enumerate(system.coordinates) if name.startswith("foot")]
    kept = np.array([*(i for node in kept_nodes for i in system.index(node)), *feet], dtype=np.intp)
    others = np.setdiff1d(np.arange(system.size), kept)
    if modes is not None and not 0 <= modes <= others.size:
        raise ValueError(f"modes: from 0 to {others.size} between the kept nodes, not {modes}")
    K, M = (system.K[0] + system.K[0].T) / 2, system.M
    inner = np.ix_(others, others)
    T = np.zeros((system.size, system.size))
    T[kept, np.arange(len(kept))] = 1.0
    T[others, : len(kept)] = -np.linalg.solve(K[inner], K[np.ix_(others, kept)])
    T[others, len(kept) :] = eigh(K[inner], M[inner])[1]
    K, M = T.T @ K @ T, T.T @ M @ T

    def error(modes: int) -> float:
        return _error(K, M, len(kept) + modes, system.knots[-1])

    if modes is None:  # in pairs of both planes; more of them are never worse
        pairs = bisect_left(range((others.size + 1) // 2), True, key=lambda n: error(2 * n) <= ENOUGH)
        modes = min(2 * pairs, others.size)
    T = T[:, : len(kept) + modes]
    found = replace(
        system,
        coordinates=(*(system.coordinates[i] for i in kept), *(f"mode_{k + 1}" for k in range(modes))),
        M=T.T @ system.M @ T,
        C=T.T @ system.C @ T,
        K=T.T @ system.K @ T,
        weight=T.T @ system.weight,
        unbalance=T.T @ system.unbalance,
        bow=T.T @ system.bow,
    )
    return ReducedSystem(found, modes, error(modes))


def _error(K: FloatArray, M: FloatArray, size: int, highest: float) -> float:
    """Of natural frequencies with the first unknowns alone, see `ReducedSystem.error`."""
    from scipy.linalg import eigh

    full, few = (
        np.sqrt(np.maximum(eigh(K[:n, :n], M[:n, :n], eigvals_only=True), 0.0)) for n in (len(K), size)
    )
    bends = int((full <= _RIGID * full[-1]).sum())
    end = max(int((full <= _COMPARED * highest).sum()), min(bends + 2, full.size))
    if end > few.size:
        return np.inf
    return float(np.max(few[bends:end] / full[bends:end] - 1.0, initial=0.0))
