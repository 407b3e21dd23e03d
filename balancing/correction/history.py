"""The history of a job: run by run what was mounted and how the rotor vibrated, against the limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.coefficients.baseline import match_speeds
from balancing.correction.refine_coefficients import runs_and_weights, sensors_in
from balancing.data.conventions import Labels
from balancing.data.limits import Limits
from balancing.data.result_columns import known, mounted_rows, three_figures
from balancing.data.trials import Trials
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.result import Column, rows
from rotorid.base.rpm import RPM, rpm
from rotorid.base.text import figures, table, wrap

if TYPE_CHECKING:
    import pandas as pd

    from balancing.correction.correction_result import Correction


@dataclass(frozen=True, eq=False)
class History(Answered):
    """All runs of a job in their order.

    Attributes
    ----------
    runs, speeds, sensors, planes
        Names (R), rad/s (S,), names (C) and (P).
    checks
        Whether each run is a check run, length R.
    weights
        Mounted in each run, kg or kg·m, angle with the rotation, shape (R, P).
    readings
        Mean of the repeats, complex, NaN where a run was not read there, shape (R, S, C).
    limits
        Largest amplitude of each reading, infinite for none, (S, C); None where there are none at all.
    labels
        Units and conventions to print in.
    """

    runs: tuple[str, ...]
    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    checks: tuple[bool, ...]
    weights: ComplexArray
    readings: ComplexArray
    limits: FloatArray | None
    labels: Labels

    @property
    def largest(self) -> FloatArray:
        """Largest amplitude of all sensors, inside units, NaN where a run was not read, shape (R, S)."""
        size = np.where(self._read, np.abs(self.readings), -1.0).max(axis=-1)
        return np.asarray(np.where(size >= 0, size, np.nan))

    @property
    def rms(self) -> FloatArray:
        """Root mean square of the amplitudes of the sensors read, shape (R, S); NaN as for `largest`."""
        count = self._read.sum(axis=-1)
        square = np.where(self._read, np.abs(self.readings) ** 2, 0.0).sum(axis=-1)
        return np.asarray(np.where(count > 0, np.sqrt(square / np.maximum(count, 1)), np.nan))

    @property
    def of_limit(self) -> FloatArray | None:
        """Largest amplitude by its limit, (R, S); NaN where nothing limited was read; None without limits."""
        if self.limits is None:
            return None
        finite = self._read & np.isfinite(self.limits)
        divisor = np.where(finite, np.maximum(self.limits, 1e-30), 1.0)
        share = np.where(finite, np.abs(np.where(finite, self.readings, 0.0)) / divisor, -1.0).max(axis=-1)
        return np.asarray(np.where(share >= 0, share, np.nan))

    @property
    def _read(self) -> BoolArray:
        return ~np.isnan(self.readings)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        return {
            "conventions": self.labels.conventions(),
            "runs": [
                {
                    "run": run,
                    "kind": _kind(self.checks[r]),
                    "weights": mounted_rows(self.labels, self.planes, self.weights[r]),
                    "speeds": self._speeds(r),
                }
                for r, run in enumerate(self.runs)
            ],
        }

    def _speeds(self, r: int) -> list[dict[str, Any]]:
        read = self._read[r].any(axis=-1)
        scale, share = self.labels.vibration_scale, known(self.of_limit, self.rms.shape)[r, read]
        size = np.where(self._read[r], np.abs(self.readings[r]), -1.0)[read]
        return rows(
            (
                Column("speed_rpm", [rpm(speed) for speed in self.speeds[read]]),
                Column("largest", self.largest[r, read] * scale),
                Column("sensor", [self.sensors[k] for k in np.argmax(size, axis=-1)]),
                Column("rms", self.rms[r, read] * scale),
                Column("of_limit", share),
                Column("within_limits", [None if np.isnan(part) else bool(part <= 1) for part in share]),
            )
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per run and speed: weights of each plane, largest and rms amplitude, share of the limit.

        Columns run, kind, `PLANE weight` and `PLANE angle_deg` (NaN where nothing was mounted), speed_rpm,
        largest, sensor, rms, of_limit (NaN without a limit), within_limits (None without).
        """
        import pandas as pd

        found = []
        for run in self.to_dict()["runs"]:
            mounted = {weight["plane"]: weight for weight in run["weights"]}
            for row in run["speeds"]:
                own = {"run": run["run"], "kind": run["kind"]}
                for plane in self.planes:
                    weight = mounted.get(plane, {})
                    own[f"{plane} weight"] = weight.get("mass", np.nan)
                    own[f"{plane} angle_deg"] = weight.get("angle_deg", np.nan)
                found.append({**own, **row})
        return pd.DataFrame(found).astype({"of_limit": float, "within_limits": object})

    @property
    def answer(self) -> Answer:
        """The largest reading of each run; then what was mounted, and vibration at each speed."""
        unit = f", {self.labels.vibration_in}" if self.labels.vibration_in else ""
        size = np.nanmax(self.largest, axis=1) * self.labels.vibration_scale
        each = [f"{run} {three_figures(value)}" for run, value in zip(self.runs, size, strict=True)]
        return Answer(
            "",
            f"Largest reading of each run{unit}: {', '.join(each)}.",
            tables=(self._table(),),
            more="run by run",
        )

    def _table(self) -> str:
        unit = f" in {self.labels.vibration_in}" if self.labels.vibration_in else ""
        head = ["run", f"mounted {self.labels.weight_in}".rstrip(), self.labels.speed_in, "largest", "rms"]
        limited = self.of_limit is not None
        lines = [[*head, "of limit"] if limited else head]
        for run in self.to_dict()["runs"]:
            weights = [
                f"{figures(weight['mass'])} at {round(weight['angle_deg']) % 360}° {weight['plane']}"
                for weight in run["weights"]
            ] or ["nothing"]
            read = [_vibration(row, self.labels, limited=limited) for row in run["speeds"]]
            for name, weight, cells in zip_longest([run["run"]], weights, read):
                row = [name or "", weight or "", *(cells or ())]
                lines.append(row + [""] * (len(lines[0]) - len(row)))
        turn = self.labels.turning_in_words()
        foot = f"Vibration{unit}: the largest of the sensors, and the root mean square of them; {turn}."
        return f"History of the job\n{table(lines, left=2)}\n{wrap(foot)}"


def history(
    trials: Trials,
    *checks: Trials,
    corrections: Correction | Mapping[str, complex] | None = None,
    limits: Limits | None = None,
) -> History:
    """Trial runs and check runs one after the other.

    Parameters
    ----------
    trials
        Trial runs, or the baseline alone.
    checks
        Check runs in their order, of all or some of the sensors and speeds of the trial runs.
    corrections
        What was mounted in check runs that have no planes: a correction, or weights by plane.
    limits
        Of the amplitudes (those of weights do not matter here), at the speeds and sensors of the trial runs.

    Raises
    ------
    ValueError
        For check runs of other sensors or speeds, and where nobody says what was mounted in them.
    """
    names, planes, weights = runs_and_weights(trials, checks, corrections)
    blocks = [trials.mean]
    for check in checks:
        rows = match_speeds(check.speeds, trials.speeds, "trial runs")
        block = np.full((len(check.runs), *trials.mean.shape[1:]), complex(np.nan, np.nan))
        block[np.ix_(range(len(block)), rows, sensors_in(check, trials))] = check.mean
        blocks.append(block)
    largest = None if limits is None or not np.isfinite(limits.residual).any() else limits.residual
    first = len(trials.runs)
    return History(
        runs=names,
        speeds=trials.speeds,
        sensors=trials.sensors,
        planes=planes,
        checks=tuple(r >= first for r in range(len(names))),
        weights=weights,
        readings=np.concatenate(blocks),
        limits=largest,
        labels=trials.labels,
    )


def _kind(check: bool) -> str:
    return "check run" if check else "trial run"


def _vibration(row: dict[str, Any], labels: Labels, *, limited: bool) -> list[str]:
    cells = [labels.speed_number(row["speed_rpm"] / RPM), figures(row["largest"], 3), figures(row["rms"], 3)]
    if limited:
        share = row["of_limit"]
        cells.append("" if share is None else f"{figures(100 * share, 3)} %{'' if share <= 1 else ' !'}")
    return cells
