"""Which trial runs, speeds and sensors would determine numbers of a rotor: before measuring.

A candidate is a trial weight in one plane at one speed, read by all sensors. Its rows K are the derivatives
of what the weight does, each sensor's over its error (as if the weight moved a sensor as much as the rotor
vibrates there: a difference of two such readings). Chosen is what makes the covariance of the wished numbers
smallest (the determinant), by exchange, with what is known beforehand of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM
from rotorid.base.text import counted, error_figures, listing, percent

if TYPE_CHECKING:
    import pandas as pd

    from fem import Rotor
    from rotorid.base.arrays import FloatArray
    from rotorid.calibration import RunReadings, Unknown

TWO_READINGS = 3.0
"""Variance of the difference of two readings of that size, in variances of one."""
FLOOR = 0.05
"""Of a weight's effect, root mean square over the sensors: the least that a sensor's error is relative to."""
ASSUMED = 0.03
"""Relative error of a reading where none is stated."""
VAGUE = 1e3
"""Standard deviation of a number of which nothing is known, in its own size."""


@dataclass(frozen=True, eq=False)
class CalibrationDesign(Answered):
    """Chosen trial runs, and what they would tell.

    Attributes
    ----------
    speeds, planes
        Of the chosen runs, rad/s and names.
    names, before, after
        Wished numbers, their standard deviations without and with these runs.
    sensors, without
        Sensors, and by how much all wished deviations would grow in the mean without each.
    """

    speeds: tuple[float, ...]
    planes: tuple[str, ...]
    names: tuple[str, ...]
    before: FloatArray
    after: FloatArray
    sensors: tuple[str, ...]
    without: FloatArray

    def _runs(self) -> tuple[Column, ...]:
        rpm = [speed * RPM for speed in self.speeds]
        return (Column("speed_rpm", rpm, "{:.6g}".format, "rpm"), Column("plane", self.planes, str))

    def _numbers(self) -> tuple[Column, ...]:
        return (
            Column("parameter", self.names, str),
            Column("std_before", self.before, error_figures, "± now"),
            Column("std_after", self.after, error_figures, "± after"),
        )

    def _sensors(self) -> tuple[Column, ...]:
        return (
            Column("sensor", self.sensors, str),
            Column("growth", self.without, lambda g: f"{percent(g)} %", "± grow without it by"),
        )

    @property
    def answer(self) -> Answer:
        """Where to measure, and what it will tell."""
        planes: dict[str, list[str]] = {}
        for speed, plane in zip(self.speeds, self.planes, strict=True):
            planes.setdefault(plane, []).append(f"{speed * RPM:.5g}")
        runs = [f"{plane} at {listing(at, 'and')} rpm" for plane, at in planes.items()]
        return Answer(
            f"Run {counted(len(planes), 'trial weight')}: {'; '.join(runs)}.",
            text(self._numbers(), width=COLUMNS) + "\n\n" + text(self._sensors(), width=COLUMNS),
            notes=("expected deviations are those of the model as it is believed to be",),
        )

    def to_frame(self) -> pd.DataFrame:
        """The chosen runs."""
        return frame(self._runs())

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return plain(
            {
                "runs": rows(self._runs()),
                "parameters": rows(self._numbers()),
                "sensors": rows(self._sensors()),
            }
        )


def design(
    rotor: Rotor, unknowns: Sequence[Unknown], wished: Sequence[str], runs: RunReadings, n: int
) -> CalibrationDesign:
    """Choose n of the trial runs, one plane and one speed each, of these places.

    Parameters
    ----------
    rotor, unknowns
        As for `calibrate`.
    wished
        Paths of the numbers that matter; the others are only known as well as they are.
    runs
        Candidates: their planes, speeds and errors of a reading; readings are not used.
    """
    paths = [unknown.path for unknown in unknowns]
    values = {unknown.path: unknown.first(rotor) for unknown in unknowns}
    W, dW = runs.coefficients(rotor, values, paths)
    S, C, P = W.shape
    errors = runs.trials.errors
    relative = 0.0 if errors is None else float(np.hypot(errors.amplitude, errors.phase) / np.sqrt(2))
    relative = relative or ASSUMED
    if runs.trials.run_errors is not None:
        relative = float(np.hypot(relative, runs.trials.run_errors.relative))
    size = np.abs(W) ** 2
    sigma = relative * np.sqrt(TWO_READINGS * (size + FLOOR * size.mean(axis=1, keepdims=True)))
    K = np.moveaxis(dW / sigma, 0, -1)  # (S, C, P, n)
    K = np.stack((K.real, K.imag), axis=2).swapaxes(1, 3)  # (S, P, 2, C, n)
    known = np.array([u.prior[1] if u.prior else VAGUE * (abs(values[u.path]) or 1.0) for u in unknowns])
    K = (K * known).reshape(S * P, 2, C, len(paths))  # of numbers in their prior deviations
    wish = np.array([paths.index(path) for path in wished])
    each = np.einsum("krcn,krcm->kcnm", K, K)

    def spread(which: Sequence[int], sensors: Sequence[int]) -> FloatArray:
        information = np.eye(len(paths)) + each[np.ix_(which, sensors)].sum(axis=(0, 1))
        return np.asarray(np.linalg.inv(information)[np.ix_(wish, wish)])

    every = list(range(C))

    def badness(which: Sequence[int]) -> float:
        return float(np.linalg.slogdet(spread(which, every))[1])

    if not 1 <= n <= S * P:
        raise ValueError(
            f"--design {n}: from 1 to {S * P} of the {counted(S * P, 'candidate')} can be chosen"
        )
    chosen: list[int] = []
    while len(chosen) < n:
        free = [k for k in range(S * P) if k not in chosen]
        chosen.append(min(free, key=lambda k: badness([*chosen, k])))
    for _ in range(n):  # exchanges, while one helps
        trades = [
            [*chosen[:i], k, *chosen[i + 1 :]] for i in range(n) for k in range(S * P) if k not in chosen
        ]
        best = min(trades, key=badness, default=chosen)
        if badness(best) >= badness(chosen) - 1e-9:
            break
        chosen = best
    chosen.sort()
    after = np.diag(spread(chosen, every))
    growth = [
        np.exp(np.log(np.diag(spread(chosen, [c for c in every if c != k])) / after).mean() / 2) - 1
        for k in every
    ]
    return CalibrationDesign(
        speeds=tuple(float(runs.trials.speeds[k // P]) for k in chosen),
        planes=tuple(runs.trials.planes[k % P] for k in chosen),
        names=tuple(unknowns[i].label for i in wish),
        before=known[wish],
        after=np.sqrt(after) * known[wish],
        sensors=runs.trials.sensors,
        without=np.array(growth),
    )
