"""`fleet fit`: the jobs of a folder tree as one table; coefficients of a type, and odd machines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, figures
from rotorid.report.outcome import USUAL, Outcome, command, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.base.arrays import FloatArray
    from rotorid.fleet.types import KnownType


_SHORT = {
    "speed_rpm": "rpm",
    "phase_deg": "°",
    "between_percent": "± % between",
    "between_deg": "± °",
    "within_percent": "± % within",
    "within_deg": "± ° ",
}
"""Headings of a terminal."""


@dataclass(frozen=True)
class FleetFitOptions:
    """Options of `fleet fit`.

    Attributes
    ----------
    machine_type : --type NAME
        The type that is wanted, and that of jobs which do not say it; default: that of most jobs.
    """

    machine_type: str | None = None
    to: ClassVar[Sequence[str]] = USUAL
    outputs: ClassVar[Sequence[str]] = (".parquet", ".csv", ".xlsx")


@command
def fleet_fit(tree: Path | str, options: FleetFitOptions | None = None) -> Outcome:
    """Read the jobs of a folder tree; how coefficients of a type differ between machines, odd machines.

    Example: rotorid fleet fit sample_data/fleet --output fans.parquet

    With `balance --type fans.parquet:fan-132` a machine of the type is balanced from its baseline.
    .parquet has the coefficients of all jobs, .csv and .xlsx those of the type.

    Parameters
    ----------
    tree : TREE
        Folder with jobs (.toml, .xlsx) at any depth.
    options
        See there.

    Raises
    ------
    ValueError
        Without any job that gives coefficients, and for a type that is not there; UndeterminedError with
        fewer than three machines.
    """
    from rotorid.files.problems import printable
    from rotorid.fleet.jobs import parquet, read_tree
    from rotorid.fleet.types import known_type

    options = options or FleetFitOptions()
    fleet, undetermined, damaged = read_tree(Path(tree), options.machine_type)
    unreadable = [f"{printable(file)} cannot be read: {why}" for file, why in damaged.items()]
    types = fleet.drop_duplicates("job")["machine_type"].value_counts().drop("", errors="ignore")
    if types.empty:
        words = f"{tree}: no balancing job in it has a type (machine_type, or --type) and coefficients"
        raise ValueError("\n".join([words, *unreadable]))
    name = options.machine_type or str(types.index[0])
    known = known_type(fleet, name)
    kind, odd = known.kind, _odd(known, Path(tree))
    between, within = (kind.scatter(part) for part in (kind.effects.between, kind.effects.within))
    jobs = int(kind.effects.jobs.sum())
    notes = list(known.notes)
    head = f"{name}: {counted(len(kind.machines), 'machine')}, {counted(jobs, 'job')}."
    head += f" Coefficients differ between machines {_typical(*between)}"
    if jobs > len(kind.machines):
        head += f"; from run to run of one {_typical(*within)}"
    else:
        notes.insert(0, "each machine was balanced once: nothing tells how one changes by itself")
    if undetermined:
        notes.append(f"the runs of {counted(len(undetermined), 'job')} do not determine coefficients")
    if len(types) > 1:
        notes.append(f"{counted(len(types) - 1, 'other type')} in the tree (--type NAME)")
    table, unit = _table(known, between, within), kind.influence(known.labels).unit

    def figure() -> Figure:
        from rotorid.fleet.plots import type_figure

        return type_figure(kind)

    return Outcome(
        result=known,
        sentences=(f"{head}. In {unit}, phases lead, angles with the rotation:",),
        tables=(table.only({one: _SHORT.get(one, one) for one in table.headings}),),
        file=table,
        files={".parquet": lambda path: parquet(fleet)},
        keys={
            "machine_type": name,
            "types": {str(one): int(count) for one, count in types.items()},
            "machines": list(kind.machines),
            "jobs": jobs,
            "unit": unit,
            "phase": "lead",
            "angles": "with rotation",
            "rows": [dict(zip(table.headings, row, strict=True)) for row in table.rows],
            "odd": odd,
            "left_out": known.lacking,
            "undetermined": undetermined,
            "damaged": damaged,
        },
        pictures={"Coefficients of all machines over their mean.": figure},
        warnings=(*map(_odd_words, odd), *unreadable),
        notes=tuple(notes),
        title="Type of machines",
        provenance=provenance((), options, tree=str(tree)),
    )


def _table(known: KnownType, *scatter: tuple[FloatArray, FloatArray]) -> Table:
    """One row per speed, sensor and plane: mean coefficients, and one standard deviation of each kind."""
    import numpy as np

    influence = known.kind.influence(known.labels)
    labels, W, tenths = influence.labels, influence.W.ravel(), "{:.1f}".format
    where = np.meshgrid(influence.speeds * RPM, influence.sensors, influence.planes, indexing="ij")
    speeds, sensors, planes = (part.ravel() for part in where)
    size = np.abs(W) * labels.vibration_scale / labels.weight_scale
    columns = [
        Column("speed_rpm", np.round(speeds, 9), "{:.6g}".format),
        Column("sensor", sensors.tolist()),
        Column("plane", planes.tolist()),
        Column("influence", size, partial(figures, digits=3)),
        Column("phase_deg", np.degrees(np.angle(W)) % 360.0, tenths),
    ]
    for word, (along, across) in zip(("between", "within"), scatter, strict=True):
        columns.append(Column(f"{word}_percent", 100 * along.ravel(), tenths))
        columns.append(Column(f"{word}_deg", np.degrees(across.ravel()), tenths))
    return Table("coefficients", tuple(columns))


def _odd(known: KnownType, tree: Path) -> list[dict[str, Any]]:
    """Machines that do not belong to the type, and what would make them fit, by their own runs."""
    from rotorid.files import read_job

    told = []
    for record, far in known.kind.odd:
        job = read_job(tree / record.job if tree.is_dir() else tree)
        reason = known.kind.why_odd(record, None if job.influence else job.trials) or None
        odd = {"machine": record.machine, "path": record.job, "times_the_limit": far**0.5, "reason": reason}
        told.append(odd)
    return told


def _odd_words(odd: dict[str, Any]) -> str:
    """What an odd machine is, and what would make it fit."""
    why = f"it would fit if {odd['reason']}" if odd["reason"] else "nothing that was tried makes it fit"
    times = f"{odd['times_the_limit']:.2g} times as far off as machines of a type are"
    return f"{odd['machine']} ({odd['path']}) is odd, {times}, and was left out: {why}"


def _typical(along: FloatArray, across: FloatArray) -> str:
    """Root mean square over the coefficients, in words."""
    import numpy as np

    percent, degrees = 100 * np.sqrt(np.mean(along**2)), np.degrees(np.sqrt(np.mean(across**2)))
    if not along.any():
        return "no more than the errors of their runs explain"
    return f"by {figures(float(percent), 2)} % and {figures(float(degrees), 2)}°"
