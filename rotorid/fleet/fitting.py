"""`fleet fit`: coefficients of a type of machines, how machines differ, and which are odd."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM
from rotorid.base.text import counted, figures
from rotorid.report.outcome import USUAL, Outcome, command, outcome_of, provenance

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.base.arrays import FloatArray
    from rotorid.fleet.type_records import KnownType


@dataclass(frozen=True)
class FleetFitOptions:
    """Options of `fleet fit`.

    Attributes
    ----------
    machine_type : --type NAME
        The type.
    """

    machine_type: str
    to: ClassVar[Sequence[str]] = USUAL


@dataclass(frozen=True, eq=False, kw_only=True)
class TypeFound(Answered):
    """Coefficients of a type, and of each odd record what would make it fit ("": not found)."""

    known: KnownType
    reasons: tuple[str, ...]

    @property
    def _columns(self) -> tuple[Column, ...]:
        import numpy as np

        kind = self.known.kind
        influence = kind.influence(self.known.labels)
        labels, W = influence.labels, influence.W.ravel()
        where = np.meshgrid(influence.speeds * RPM, influence.sensors, influence.planes, indexing="ij")
        speeds, sensors, planes = (part.ravel() for part in where)
        size = np.abs(W) * labels.vibration_scale / labels.weight_scale
        (along, across), (run, turn) = map(kind.scatter, (kind.effects.between, kind.effects.within))
        angle = "{:.1f}".format
        return (
            Column("speed_rpm", np.round(speeds, 9), "{:.6g}".format, "rpm"),
            Column("sensor", sensors.tolist(), str),
            Column("plane", planes.tolist(), str),
            Column("influence", size, partial(figures, digits=3), influence.unit),
            Column("phase_deg", np.degrees(np.angle(W)) % 360.0, angle, "°"),
            Column("between_percent", 100 * along.ravel(), angle, "± % between"),
            Column("between_deg", np.degrees(across.ravel()), angle, "± °"),
            Column("within_percent", 100 * run.ravel(), angle, "± % within"),
            Column("within_deg", np.degrees(turn.ravel()), angle, "± °"),
        )

    @property
    def _odd(self) -> list[dict[str, Any]]:
        return [
            {
                "machine": record.machine,
                "job": record.job,
                "path": self.known.jobs["path"][record.job],
                "times_the_limit": float(far) ** 0.5,
                "reason": reason or None,
            }
            for (record, far), reason in zip(self.known.kind.odd, self.reasons, strict=True)
        ]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; scatters are one standard deviation, percent of the mean and degrees."""
        kind = self.known.kind
        return {
            "machine_type": self.known.name,
            "machines": list(kind.machines),
            "jobs": int(kind.effects.jobs.sum()),
            "unit": kind.influence(self.known.labels).unit,
            "phase": "lead",
            "angles": "with rotation",
            "rows": rows(self._columns),
            "odd": self._odd,
            "left_out": self.known.lacking,
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per speed, sensor and plane."""
        return frame(self._columns)

    @property
    def answer(self) -> Answer:
        """How machines differ, and which are odd; the coefficients."""
        kind, notes, jobs = self.known.kind, self.known.notes, int(self.known.kind.effects.jobs.sum())
        between, within = (kind.scatter(part) for part in (kind.effects.between, kind.effects.within))
        head = f"{self.known.name}: {counted(len(kind.machines), 'machine')}, {counted(jobs, 'job')}."
        head += f" Coefficients differ between machines {_typical(*between)}"
        if jobs > len(kind.machines):
            head += f"; from run to run of one {_typical(*within)}"
        else:
            notes = ("each machine was balanced once: nothing tells how one changes by itself", *notes)
        found = text(self._columns, left=3, width=COLUMNS)
        return Answer(f"{head}.", found, warnings=tuple(map(_odd_words, self._odd)), notes=notes)

    def figure(self) -> Figure:
        """Coefficients of all machines over their mean, each plane and sensor for itself."""
        from rotorid.fleet.plots import type_figure

        return type_figure(self.known.kind)


def _odd_words(one: Mapping[str, Any]) -> str:
    """What an odd machine is, and what would make it fit."""
    why = f"it would fit if {one['reason']}" if one["reason"] else "nothing that was tried makes it fit"
    times = f"{one['times_the_limit']:.2g} times as far off as machines of a type are"
    return f"{one['machine']} ({one['path']}) is odd, {times}, and was left out: {why}"


def _typical(along: FloatArray, across: FloatArray) -> str:
    """Root mean square over the coefficients, in words."""
    import numpy as np

    percent, degrees = 100 * np.sqrt(np.mean(along**2)), np.degrees(np.sqrt(np.mean(across**2)))
    if not along.any():
        return "no more than the errors of their runs explain"
    return f"by {figures(float(percent), 2)} % and {figures(float(degrees), 2)}°"


@command
def fleet_fit(fleet: Path | str, options: FleetFitOptions) -> Outcome:
    """Coefficients of a type: mean, differences between machines, odd machines.

    Example: rotorid fleet fit fans --type fan-132

    With `balance --type FLEET:TYPE` a machine of the type is balanced from its baseline alone.

    Parameters
    ----------
    fleet : FLEET
        Folder of the tables of the fleet.
    options
        See there.

    Raises
    ------
    ValueError
        For a fleet or a type that are not there; UndeterminedError with fewer than three machines.
    """
    from rotorid.fleet.type_records import known_type
    from rotorid.tables.fleet.fleet_store import FleetStore, trials_of

    store = FleetStore(Path(fleet))
    known = known_type(store, options.machine_type)
    return outcome_of(
        TypeFound(
            known=known,
            reasons=tuple(known.kind.why_odd(odd, trials_of(store, odd.job)) for odd, _ in known.kind.odd),
        ),
        provenance(store.files("jobs", "coefficients"), options),
    )
