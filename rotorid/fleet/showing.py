"""`fleet show`: what the store of a fleet holds, type by type."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import counted
from rotorid.report.outcome import Outcome, command, outcome_of, provenance

if TYPE_CHECKING:
    import pandas as pd

SHOWN = {"displacement": (1e6, "µm"), "velocity": (1e3, "mm/s"), "acceleration": (1.0, "m/s²")}
"""Shown = SI × number, and the unit, of each quantity."""
_TITLES = {"machine_type": "type", "first_date": "first", "last_date": "last", "coefficients": "coeff."}
_MACHINE = "machine_type", "machine"


@dataclass(frozen=True)
class FleetShowOptions:
    """Options of `fleet show`.

    Attributes
    ----------
    machine_type : --type NAME
        Only machines of this type.
    """

    machine_type: str | None = None
    to: ClassVar[Sequence[str]] = ("output", "table", "json")


@dataclass(frozen=True, eq=False, kw_only=True)
class FleetShown(Answered):
    """Machines and jobs of a fleet.

    Attributes
    ----------
    jobs
        The table `jobs` with the number of coefficients, and rms before and after (SI) of the last check run.
    """

    jobs: pd.DataFrame

    def _columns(self, *by: str) -> tuple[Column, ...]:
        """A row for each of these, and each quantity."""
        found = (
            self.jobs.assign(date=self.jobs["date"].astype("string"))
            .groupby([*by, "quantity"])
            .agg(
                machines=("machine", "nunique"),
                jobs=("job", "size"),
                first_date=("date", "min"),
                last_date=("date", "max"),
                vectors=("vectors", "sum"),
                coefficients=("coefficients", "sum"),
                outcomes=("after", "count"),
                rms_before=("before", "median"),
                rms_after=("after", "median"),
            )
            .fillna({"first_date": "", "last_date": ""})
            .reset_index()
        )
        return tuple(Column(str(k), found[k].tolist(), str, _TITLES.get(str(k))) for k in found)

    def _text(self, *by: str) -> str:
        """The same, vibration in the unit of its quantity."""
        columns = {column.name: column for column in self._columns(*by)}
        units = [SHOWN.get(quantity, (1.0, "")) for quantity in columns.pop("quantity").values]
        for name in ("rms_before", "rms_after"):
            cells = zip(columns[name].values, units, strict=True)
            said = ["" if rms != rms else f"{rms * scale:.3g} {unit}" for rms, (scale, unit) in cells]
            columns[name] = Column(name, said, str, name.replace("_", " "))
        if "machine" in by:  # each row is one
            del columns["machines"]
        return text([*columns.values()], left=len(by), width=COLUMNS)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; amplitudes in SI, medians over the jobs of the rms of the last check run."""
        return {"rows": rows(self._columns("machine_type")), "machines": rows(self._columns(*_MACHINE))}

    def to_frame(self) -> pd.DataFrame:
        """The same rows."""
        return frame(self._columns("machine_type"))

    @property
    def answer(self) -> Answer:
        """The types; then the machines."""
        machines = len(self.jobs.drop_duplicates(["machine_type", "machine"]))
        without = int((self.jobs["undetermined"] != "").sum())
        head = f"{counted(machines, 'machine')}, {counted(len(self.jobs), 'job')}."
        note = f"the runs of {counted(without, 'job')} do not determine coefficients (`undetermined` in jobs)"
        return Answer(
            head,
            self._text("machine_type"),
            notes=(note,) if without else (),
            tables=(self._text(*_MACHINE),),
            more="every machine",
        )


@command
def fleet_show(fleet: Path | str, options: FleetShowOptions | None = None) -> Outcome:
    """Machines, jobs and outcomes of each type.

    Example: rotorid fleet show fans

    Parameters
    ----------
    fleet : FLEET
        Folder of the tables of the fleet.
    options
        See there.

    Raises
    ------
    ValueError
        For a folder that is no store, and where it has no job, or none of that type.
    """
    from rotorid.base.suggestions import did_you_mean
    from rotorid.tables.fleet.fleet_store import FleetStore

    options = options or FleetShowOptions()
    store = FleetStore(Path(fleet))
    store.check()
    wanted = options.machine_type
    jobs = store.table("jobs", machine_type=wanted)
    if jobs.empty:
        known = sorted(set(store.table("jobs")["machine_type"]))
        what = "job" if wanted is None else f"machine of type {wanted!r}{did_you_mean(wanted, known)}"
        raise ValueError(f"{fleet}: there is no {what}")
    own = jobs["job"]
    coefficients = store.table("coefficients", jobs=own, columns=["job"])["job"].value_counts()
    outcomes = store.table("outcomes", jobs=own, columns=["job", "run", "before", "after"])
    last = outcomes[outcomes["run"] == outcomes.groupby("job")["run"].transform("last")]
    rms = (last.set_index("job")[["before", "after"]] ** 2).groupby("job").mean() ** 0.5
    jobs = jobs.assign(coefficients=own.map(coefficients).fillna(0).astype(int)).join(rms, on="job")
    return outcome_of(FleetShown(jobs=jobs), provenance(store.files("jobs", "outcomes"), options))
