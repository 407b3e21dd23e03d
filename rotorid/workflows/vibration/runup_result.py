"""Result of `runup`: critical speeds and damping with errors, beside a steady fit's; slow roll; tables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from rotorid.base.answer import COLUMNS, Answer
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM
from rotorid.base.text import counted, error_figures, figures, listing
from rotorid.commands.outcome import Delivered

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.base.arrays import ComplexArray, FloatArray
    from rotorid.harmonic.modal.modal_result import FittedModes
    from rotorid.harmonic.modal.run_up import SweepModes, SweepVectors

View = Literal["bode", "polar"]
"""What a picture shows."""


MUCH_BETTER = 0.25
"""So much less of the sum of squares phases of the other sign leave, if they are the right ones."""


class SlowRollVectors(NamedTuple):
    """Vectors (C,), covariances of their parts, where they are from, and warnings; None: unknown."""

    vectors: ComplexArray | None
    covariances: FloatArray | None
    words: str
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, kw_only=True)
class RunUp(Delivered):
    """What the vectors of a sweep tell.

    Attributes
    ----------
    sweeps
        The one whose modes are fitted, and others.
    modes, why
        Its modes; None and why there are none.
    roll
        Slow-roll vectors of its sensors.
    steady
        Speeds are said to be held.
    assumed
        Nobody says whether phases lead.
    bands
        Around each critical speed, rad/s.
    speeds
        Where vectors are wanted, rad/s; None: nowhere.
    """

    sweeps: tuple[SweepVectors, ...]
    modes: SweepModes | None
    why: str
    roll: SlowRollVectors
    steady: bool
    assumed: bool
    bands: tuple[tuple[float, float], ...]
    speeds: FloatArray | None

    @property
    def fit(self) -> FittedModes | None:
        """The modes that can be gone on with."""
        determined = self.modes is not None and not (self.modes.fit.undetermined or self._turned)
        return self.modes.fit if self.modes is not None and determined else None

    @cached_property
    def _turned(self) -> tuple[str, ...]:
        """That modes explain phases of the other sign much better."""
        from rotorid.harmonic.modal.run_up import fit_sweep

        sweep = self.sweeps[0]
        if self.modes is None or self.modes.fit.explains:
            return ()
        try:
            other = fit_sweep(sweep.mirrored, steady=self.steady, bands=self.bands or None).fit
        except ValueError:
            return ()
        left = [float(r @ r) for r in (one.fit.estimate.residuals for one in (self.modes.fit, other))]
        if other.undetermined or left[1] > MUCH_BETTER * left[0]:
            return ()
        sign = "lag" if sweep.labels.phase == "lead" else "lead"
        return (f"phases are read as {sweep.labels.phase}s; modes explain them as {sign}s (--phase {sign})",)

    @property
    def acceleration(self) -> float | None:
        """Mean, rad/s²; None: nobody says."""
        sweep = self.sweeps[0]
        if self.steady:
            return 0.0
        if sweep.time is None or len(sweep.time) < 2:
            return None
        return float((sweep.speeds[-1] - sweep.speeds[0]) / (sweep.time[-1] - sweep.time[0]))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What must be known before the numbers are used."""
        if self.modes is None:
            return (f"no modes: {self.why}", *self.roll.warnings)
        return (*self._turned, *self.modes.fit.warnings, *self.roll.warnings)

    def columns(self) -> tuple[Column, ...]:
        """A row a mode: with the acceleration, and as a steady fit has it."""
        if self.modes is None or self.fit is None:
            return ()
        fit, beside = self.fit.fit, self.modes.steady
        k = len(self.fit.ends)
        omega, zeta = fit.estimate.solution.reshape(2, k)
        std = (fit.std if fit.std is not None else fit.values * float("nan")).reshape(2, k)
        shown = [
            Column("mode", range(1, k + 1), str),
            Column("critical_speed_rpm", RPM * omega, "{:.6g}".format, "critical rpm"),
            Column("std_rpm", RPM * std[0], error_figures, "±"),
            Column("damping_percent", 100 * zeta, "{:.4g}".format, "ζ %"),
            Column("std_percent", 100 * std[1], error_figures, "±"),
        ]
        if beside is not None:
            other = beside.fit.estimate.solution.reshape(2, k)
            shown.append(Column("steady_rpm", RPM * other[0], "{:.6g}".format, "steady fit: rpm"))
            shown.append(Column("steady_percent", 100 * other[1], "{:.4g}".format, "ζ %"))
        return tuple(shown)

    def slow_roll_columns(self) -> tuple[Column, ...]:
        """A row a sensor."""
        import numpy as np

        sweep, (vectors, covariances, *_) = self.sweeps[0], self.roll
        if vectors is None:
            return ()
        labels = sweep.labels
        unit = f"_{labels.vibration_unit}" if labels.vibration_unit else ""
        size, angle = labels.vibration(vectors)
        shown = [
            Column("sensor", sweep.sensors, str),
            Column(f"amplitude{unit}", size, figures, f"slow roll, {labels.vibration_in}".rstrip(", ")),
            Column("phase_deg", angle, "{:.1f}".format, f"phase ({labels.phase}), °"),
        ]
        if covariances is not None:  # of either part, as large
            std = labels.vibration_scale * np.sqrt(np.trace(covariances, axis1=1, axis2=2) / 2)
            shown.insert(2, Column(f"std{unit}", std, error_figures, "±"))
        return tuple(shown)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; what is unknown is None."""
        modes = []
        if self.fit is not None and self.modes is not None:
            fit, beside = self.fit.fit, self.modes.steady
            k, ci95 = len(self.fit.ends), fit.ci95
            for r in range(k):
                own = {"frequency_rad_s": r, "damping_ratio": k + r}
                values = {name: fit.estimate.solution[i] for name, i in own.items()}
                found: dict[str, Any] = {"mode": r + 1, **values}
                found["critical_speed_rpm"] = RPM * values["frequency_rad_s"]
                found["std"] = {name: None if fit.std is None else fit.std[i] for name, i in own.items()}
                found["ci95"] = {name: None if ci95 is None else ci95[i] for name, i in own.items()}
                solution = None if beside is None else beside.fit.estimate.solution
                found["steady"] = solution if solution is None else {n: solution[i] for n, i in own.items()}
                modes.append(found)
        estimate = None if self.modes is None else self.modes.fit.fit.estimate
        known = {
            "run": self.sweeps[0].run,
            "phase": self.sweeps[0].labels.phase,
            "modes": modes,
            "slow_roll": rows(self.slow_roll_columns()),
            "slow_roll_from": self.roll.words,
            "acceleration_rad_s2": self.acceleration,
            "chi_square": None if estimate is None else estimate.chi_square,
            "degrees_of_freedom": None if estimate is None else estimate.dof,
            "vectors": [] if self.speeds is None else rows(self.runs_columns()),
            "warnings": self.warnings,
        }
        return dict(plain(known))

    def to_frame(self) -> pd.DataFrame:
        """The table of modes at critical speeds, for `reduce` and `calibrate`.

        Raises
        ------
        ValueError
            Where there is none.
        """
        if self.modes is None:
            raise ValueError(f"there is no table of modes: {self.why}")
        if self._turned:
            raise ValueError(f"there is no table of modes: {self._turned[0]}")
        table = self.modes.fit.to_frame()
        table.insert(1, "critical_speed_rpm", RPM * table.pop("frequency_rad_s"))
        return table

    def runs_columns(self) -> tuple[Column, ...]:
        """Vectors of every run at the speeds asked for: a runs table, as read, the slow roll not taken off.

        Raises
        ------
        ValueError
            Without speeds, and for speeds that a run does not reach.
        """
        from rotorid.harmonic.modal.run_up import vectors_when_passing
        from rotorid.tables.runs.vectors_table import runs_columns

        if self.speeds is None:
            raise ValueError("--save-runs needs --speeds, such as 900,1500")
        found = []
        for sweep in self.sweeps:
            fit = self.modes if sweep is self.sweeps[0] else None
            made = vectors_when_passing(sweep, self.speeds, fit, steady=self.steady, bands=self.bands)
            found.append((sweep, self.speeds, *made))
        return runs_columns(found)

    def runs_frame(self) -> pd.DataFrame:
        """That table."""
        return frame(self.runs_columns())

    def figure(self, view: View = "bode") -> Figure:
        """Amplitude and phase over speed, or vectors as paths in the plane, less the slow roll."""
        import numpy as np

        from rotorid.harmonic.modal.run_up_picture import bode_plot, polar_plot

        roll = self.roll.vectors
        roll = np.zeros(len(self.sweeps[0].sensors), dtype=complex) if roll is None else roll
        return polar_plot(self.sweeps, roll) if view == "polar" else bode_plot(self.sweeps, roll, self.fit)

    @property
    def answer(self) -> Answer:
        """Critical speeds with errors, beside the steady fit's; slow roll; what speaks against them."""
        sweep, rate = self.sweeps[0], self.acceleration
        notes = [f"slow roll {self.roll.words}"]
        if rate is None:
            notes.append(
                "nobody says how fast the speed changes (a column time_s, or --acceleration): the fit is of "
                "held speeds, and a sweep shifts it"
            )
        elif rate:
            notes.append(
                f"the speed changes by {RPM * rate:.4g} rpm a second; critical: where the phase of the mode "
                "has turned by 90° when the speed is held"
            )
        if self.assumed:
            notes.append("nobody says whether phases lead or lag: lead is assumed (--phase)")
        if self.fit is not None and self.fit.same:
            notes.append(f"errors are not stated: the same {self.fit.same}")
        roll = text(self.slow_roll_columns(), width=COLUMNS) if self.roll.vectors is not None else ""
        if self.fit is None:
            judgement = f"Run {sweep.run}: no critical speed is determined."
            return Answer(judgement, roll, self.warnings, tuple(notes))
        told = [f"{RPM * omega:.0f}" for omega in self.fit.fit.estimate.solution[: len(self.fit.ends)]]
        judgement = f"Run {sweep.run}: {counted(len(told), 'critical speed')}, {listing(told, 'and')} rpm."
        found = f"{text(self.columns(), width=COLUMNS)}\n\n{roll}"
        return Answer(judgement, found, self.warnings, tuple(notes))
