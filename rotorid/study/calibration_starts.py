"""A study of the starts of a calibration: where searches from drawn starting values end."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from rotorid.calibration import calibrate

if TYPE_CHECKING:
    import pandas as pd

    from fem import Rotor
    from rotorid.base.arrays import FloatArray
    from rotorid.calibration import RunReadings, Unknown

SPREAD = 0.3
"""Relative, of drawn starting values without a prior."""
SAME = 1e-3
"""Relative: ends of searches whose numbers and χ² (besides 0.01) differ by less are one."""


class Problem(Protocol):
    """What is calibrated, as `commands.calibrate.prepared` reads it."""

    @property
    def rotor(self) -> Rotor:
        """As it is believed to be."""

    @property
    def numbers(self) -> Sequence[Unknown]:
        """What is unknown of it."""

    @property
    def readings(self) -> Sequence[RunReadings]:
        """Of its runs."""


def draw_start(given: Problem, rng: np.random.Generator) -> dict[str, Any]:
    """χ² of data and priors where the search from one drawn start ends, and the numbers there."""
    begun = []
    for unknown in given.numbers:
        first = unknown.first(given.rotor)
        spread = unknown.prior[1] if unknown.prior else SPREAD * abs(first)
        begun.append(replace(unknown, start=first + spread * rng.uniform(-1.0, 1.0)))
    end = calibrate(given.rotor, begun, given.readings, side_starts=False)
    numbers = dict(zip(end.fit.names, end.fit.estimate.solution.tolist(), strict=True))
    return {"converged": end.fit.converged, "chi_square": end.chi_square, **numbers}


def count_minima(parts: Iterable[pd.DataFrame], names: tuple[str, ...]) -> dict[str, Any]:
    """Distinct ends of all starts, the lowest χ² first, as fields of `StudiedStarts`."""
    minima: list[tuple[float, FloatArray]] = []
    found: list[int] = []
    lost = 0
    for part in parts:
        good = part[part["converged"] & np.isfinite(part["chi_square"])]
        lost += len(part) - len(good)
        for chi_square, end in zip(good["chi_square"], good[list(names)].to_numpy(), strict=True):
            for k, (known, place) in enumerate(minima):
                near = abs(known - chi_square) <= SAME * known + 0.01
                if near and np.allclose(end, place, rtol=SAME, atol=0.0):
                    found[k] += 1
                    break
            else:
                minima.append((chi_square, end))
                found.append(1)
    order = sorted(range(len(minima)), key=lambda k: minima[k][0])
    return {
        "lost": lost,
        "names": names,
        "chi_square": np.array([minima[k][0] for k in order]),
        "found": np.array([found[k] for k in order]),
        "ends": np.array([minima[k][1] for k in order]).reshape(-1, len(names)),
    }
