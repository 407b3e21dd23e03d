"""`fleet fit`: the jobs of a folder tree as one table; coefficients of a type, and odd machines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, figures
from rotorid.report.outcome import USUAL, Outcome, command, provenance

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from rotorid.fleet.machine_type import MachineType

_HEADS = ("rpm", "sensor", "plane", "influence", "°", "± % between", "± °", "± % within", "± ° ")
"""Of the table, on a terminal."""


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
    from rotorid.fleet.jobs import arrow, parquet, read_tree
    from rotorid.fleet.machine_type import type_of_fleet

    options = options or FleetFitOptions()
    fleet, undetermined, damaged = read_tree(Path(tree), options.machine_type or "")
    unreadable = [f"{printable(file)} cannot be read: {why}" for file, why in damaged.items()]
    types = fleet.drop_duplicates("job")["machine_type"].value_counts().drop("", errors="ignore")
    if types.empty:
        words = f"{tree}: no balancing job in it has a type (machine_type, or --type) and coefficients"
        raise ValueError("\n".join([words, *unreadable]))
    name = options.machine_type or str(types.index[0])
    kind = type_of_fleet(fleet, name)
    machines, jobs, table = len(kind.machines), int(kind.effects.jobs.sum()), _table(kind)
    head = f"{name}: {counted(machines, 'machine')}, {counted(jobs, 'job')}. Coefficients differ between "
    head += f"machines {_typical(table, 'between')}"
    notes, shown = list(kind.notes), dict(zip(table.headings, _HEADS, strict=True))
    if jobs > machines:
        head += f"; from run to run of one {_typical(table, 'within')}"
    else:
        notes.insert(0, "± within a machine is not determined by one job a machine")
        del shown["within_percent"], shown["within_deg"]
    if undetermined:
        notes.append(f"the runs of {counted(len(undetermined), 'job')} do not determine coefficients")
    if len(types) > 1:
        notes.append(f"{counted(len(types) - 1, 'other type')} in the tree (--type NAME)")
    odd, warnings = list[dict[str, object]](), list[str]()
    for record, far in kind.odd:
        reason, times = kind.why_odd(record) or None, far**0.5
        words = (
            f"{record.machine} ({record.job}) is odd, {times:.2g} times as far off as machines of a type are"
        )
        why = f"it would fit if {reason}" if reason else "nothing that was tried makes it fit"
        warnings.append(f"{words}, and was left out: {why}")
        each = {"machine": record.machine, "path": record.job, "times_the_limit": times, "reason": reason}
        odd.append(each)
    unit = f"{kind.labels.vibration_unit or '1'}/{kind.labels.weight_unit}"
    return Outcome(
        result=kind,
        sentences=(f"{head}. In {unit}, phases lead, angles with the rotation:",),
        tables=(table.only(shown),),
        file=table,
        files={".parquet": lambda _: parquet(arrow("a fleet").Table.from_pandas(fleet))},
        keys={
            "machine_type": name,
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
        pictures={"Coefficients of all machines over their mean, by plane.": partial(type_figure, kind)},
        warnings=(*warnings, *unreadable),
        notes=tuple(notes),
        title="Type of machines",
        provenance=provenance((), options, tree=str(tree)),
    )


def _table(kind: MachineType) -> Table:
    """One row per speed, sensor and plane: mean coefficients, and one standard deviation of each kind."""
    import numpy as np

    W = kind.mean.ravel()
    s, c, p = np.indices(kind.turn.shape).reshape(3, -1)
    tenths, digits = "{:.1f}".format, partial(figures, digits=3)
    columns = [
        Column("speed_rpm", np.round(kind.speeds[s] * RPM, 9), "{:.6g}".format),
        Column("sensor", [kind.sensors[k] for k in c]),
        Column("plane", [kind.planes[k] for k in p]),
        Column("influence", np.abs(W) * kind.labels.vibration_scale / kind.labels.weight_scale, digits),
        Column("phase_deg", np.degrees(np.angle(W)) % 360.0, tenths),
    ]
    scatter = {"between": kind.effects.between}
    scatter["within"] = kind.effects.within if kind.effects.jobs.max() > 1 else np.nan * kind.effects.within
    for name, covariance in scatter.items():
        along, across = np.sqrt(np.diag(covariance)).reshape(-1, 2).T / np.abs(W)
        columns.append(Column(f"{name}_percent", 100 * along, tenths))
        columns.append(Column(f"{name}_deg", np.degrees(np.arctan(across)), tenths))
    return Table("coefficients", tuple(columns))


def _typical(table: Table, name: str) -> str:
    """Root mean square over the coefficients, in words."""
    import numpy as np

    columns = (column.values for column in table.columns if column.heading.startswith(name))
    percent, degrees = (float(np.sqrt(np.mean(np.asarray(values) ** 2))) for values in columns)
    if not percent:
        return "no more than the errors of their runs explain"
    return f"by {figures(percent, 2)} % and {figures(degrees, 2)}°"


def type_figure(kind: MachineType) -> Figure:
    """Coefficients of all machines over their mean, those of a plane alike, and of odd machines."""
    from rotorid.base.plot_style import legend_above, look, on_figure, plain

    def draw(ax: Axes) -> None:
        plain(ax)
        relative = kind.coefficients(kind.effects.groups) / kind.mean
        points = {plane: (".", relative[..., p]) for p, plane in enumerate(kind.planes)}
        points |= {f"odd: {record.machine}": ("x", record.W / kind.mean) for record, _ in kind.odd}
        for k, (name, (marker, ratio)) in enumerate(points.items()):
            percent = 100 * (ratio.ravel() - 1)
            ax.plot(percent.real, percent.imag, marker, color=look(k)["color"], label=name)
        ax.set(aspect="equal", xlabel="along the mean, % of it", ylabel="across, % of it")
        legend_above(ax)

    return on_figure(draw)
