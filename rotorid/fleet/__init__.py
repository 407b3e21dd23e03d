"""`fleet fit`: jobs of many machines as one table; coefficients of their type, and odd machines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, figures
from rotorid.report.outcome import Outcome, command, provenance

if TYPE_CHECKING:
    from rotorid.base.arrays import FloatArray
    from rotorid.fleet.machine_type import MachineType

__all__ = ["FleetFitOptions", "fleet_fit"]


@dataclass(frozen=True)
class FleetFitOptions:
    """Options of `fleet fit`: where the result goes."""

    to = ("output", "table", "json")
    outputs = (".parquet", ".csv", ".xlsx")


@command
def fleet_fit(tree: Path | str, options: FleetFitOptions | None = None) -> Outcome:
    """Read the jobs of a folder tree; how coefficients of a type differ between machines, odd machines.

    Example: rotorid fleet fit sample_data/fleet --output fans.parquet

    With `balance --type fans.parquet:fan-132` a machine of the type is balanced from its baseline.
    .parquet has the coefficients of all jobs, .csv and .xlsx those of the type that most jobs have.

    Parameters
    ----------
    tree : TREE
        Folder with jobs (.toml) at any depth.
    options
        See there.

    Raises
    ------
    ValueError
        Without any job that gives coefficients, and for a type that is not there; UndeterminedError with
        fewer than three machines.
    """
    import numpy as np

    from rotorid.fleet.jobs import arrow, parquet, read_tree
    from rotorid.fleet.machine_type import type_of_fleet

    fleet, undetermined, damaged = read_tree(Path(tree))
    unreadable = [f"{path} cannot be read: {why}" for path, why in damaged.items()]
    types = fleet.drop_duplicates("job")["machine_type"].value_counts().drop("", errors="ignore")
    if types.empty:
        words = f"{tree}: no balancing job in it has a type (machine_type) and coefficients"
        raise ValueError("\n".join([words, *unreadable]))
    kind = type_of_fleet(fleet, str(types.index[0]))
    machines, jobs = len(kind.machines), int(kind.effects.jobs.sum())
    between, within = _scatter(kind, kind.effects.between), _scatter(kind, kind.effects.within)
    head = (
        f"{kind.name}: {counted(machines, 'machine')}, {counted(jobs, 'job')}. "
        f"Coefficients differ between machines {_typical(between)}"
    )
    notes = list(kind.notes)
    if jobs > machines:
        head += f"; from run to run of one {_typical(within)}"
    else:
        within *= np.nan
        notes.insert(0, "± within a machine is not determined by one job a machine")
    if undetermined:
        notes.append(f"the runs of {counted(len(undetermined), 'job')} do not determine coefficients")
    if len(types) > 1:
        notes.append(f"{counted(len(types) - 1, 'other type')} in the tree: fit its folder alone")
    odd, warnings = list[dict[str, object]](), list[str]()
    for record, far in kind.odd:
        times, reason = far**0.5, kind.why_odd(record)
        odd.append(
            {"machine": record.machine, "path": record.job, "times_the_limit": times, "reason": reason}
        )
        why = f"it would fit if {reason}" if reason else "nothing that was tried makes it fit"
        warnings.append(
            f"{record.machine} ({record.job}) is odd, {times:.2g} times as far off as machines of a type "
            f"are, and was left out: {why}"
        )
    table = _table(kind, between, within)
    unit = kind.influence(kind.labels).unit
    return Outcome(
        result=kind,
        sentences=(f"{head}. In {unit}, phases lead, angles with the rotation:",),
        tables=(table,),
        file=table,
        files={".parquet": lambda _: parquet(arrow("a fleet").Table.from_pandas(fleet))},
        keys={
            "machine_type": kind.name,
            "types": types.to_dict(),
            "machines": list(kind.machines),
            "jobs": jobs,
            "unit": unit,
            "phase": "lead",
            "angles": "with rotation",
            "rows": table.records,
            "odd": odd,
            "left_out": kind.left_out,
            "undetermined": undetermined,
            "damaged": damaged,
        },
        warnings=(*warnings, *unreadable),
        notes=tuple(notes),
        title="Type of machines",
        provenance=provenance((), options or FleetFitOptions(), tree=str(tree)),
    )


def _scatter(kind: MachineType, covariance: FloatArray) -> FloatArray:
    """One standard deviation along coefficients, %, and across, degrees, (2, n)."""
    import numpy as np

    along, across = np.sqrt(np.diag(covariance)).reshape(-1, 2).T / np.abs(kind.mean.ravel())
    return np.array([100 * along, np.degrees(np.arctan(across))])


def _table(kind: MachineType, between: FloatArray, within: FloatArray) -> Table:
    """One row per speed, sensor and plane: mean coefficients, and one standard deviation of each kind."""
    import numpy as np

    W, scale = kind.mean, kind.labels.vibration_scale / kind.labels.weight_scale
    s, c, p = np.indices(W.shape).reshape(3, -1)
    tenths = "{:.1f}".format
    columns = (
        Column("speed_rpm", np.round(kind.speeds[s] * RPM, 9), "{:.6g}".format),
        Column("sensor", np.array(kind.sensors)[c]),
        Column("plane", np.array(kind.planes)[p]),
        Column("influence", np.abs(W).ravel() * scale, partial(figures, digits=3)),
        Column("phase_deg", np.degrees(np.angle(W)).ravel() % 360.0, tenths),
        Column("between_percent", between[0], tenths, title="± % between"),
        Column("between_deg", between[1], tenths, title="± °"),
        Column("within_percent", within[0], tenths, title="± % within"),
        Column("within_deg", within[1], tenths, title="± °"),
    )
    return Table("coefficients", columns)


def _typical(scatter: FloatArray) -> str:
    """Root mean square over the coefficients, in words."""
    import numpy as np

    percent, degrees = np.sqrt(np.mean(scatter**2, axis=1)).tolist()
    if not percent:
        return "no more than the errors of their runs explain"
    return f"by {figures(percent, 2)} % and {figures(degrees, 2)}°"
