"""Coefficients of a job from its type: the first shot, and what its own runs have added since."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import Influence, Trials, with_check_runs
from rotorid.base.text import counted
from rotorid.files.input_file import sha256
from rotorid.fleet.machine_type import MachineRecord
from rotorid.fleet.posterior import update
from rotorid.fleet.type_records import Grid, KnownType, known_type

if TYPE_CHECKING:
    from balancing import Correction
    from rotorid.fleet.machine_type import MachineType
    from rotorid.tables import Job
    from rotorid.tables.fleet.fleet_store import FleetStore

LEVEL = 0.001
"""Probability below which runs are not those of a machine of the type."""

ENOUGH = 12
"""Machines, from which on the regions of first shots hold what they say."""
_FEW = (
    "the type rests on few machines: where whole machines differ, 95 % regions of first shots held the truth "
    "in 84 to 88 of 100 simulated ones; make a trial run"
)
_RARE = 1e-12


@dataclass(frozen=True, eq=False)
class TypeKnowledge:
    """What a type says of a machine.

    `influence` has what the job's own runs have added, `files` are those that the type was read from, and so
    many `earlier` jobs of the machine count. `probability` is that of runs farther from the type, 1 where
    nothing tells; if it is below `LEVEL`, `reason` would make the machine one of the type ("": not found).
    """

    known: KnownType
    influence: Influence
    files: tuple[Path, ...]
    earlier: int
    probability: float
    reason: str

    def files_beside(self, job: Job) -> tuple[Path, ...]:
        """Those of a job, and those of the type."""
        return (*job.files, *self.files)

    def judged(self, result: Correction) -> Correction:
        """A correction that is not to be mounted where the machine is not of its type."""
        if self.probability >= LEVEL:
            return result
        rare = f"{self.probability:.1g}" if self.probability > _RARE else f"below {_RARE:g}"
        cause = f"by its runs this machine is not of the type {self.known.name!r} (χ², probability {rare})"
        cause += f"; it would fit if {self.reason}" if self.reason else ""
        instead = ("Instead: balance it without --type.",)
        decision = replace(result.decision, word="do not mount", cause=cause, instead=instead)
        return replace(result, decision=decision)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return {
            "machine_type": self.known.name,
            "machines": len(self.known.kind.machines),
            "earlier_jobs": self.earlier,
            "probability": self.probability,
            "of_type": self.probability >= LEVEL,
            "reason": self.reason or None,
        }


def type_coefficients(job: Job, address: str, *, refined: bool = False) -> TypeKnowledge:
    """Coefficients of a job's machine from a type, FLEET:TYPE, and the job's runs; check runs if `refined`.

    ValueError for an address, a fleet or a type that are not there, and check runs that are not.
    """
    from rotorid.fleet.job_records import kind_of
    from rotorid.tables.fleet.fleet_store import FleetStore
    from rotorid.tables.fleet.job_search import machine_of

    folder, _, name = address.rpartition(":")
    if not folder or not name:
        raise ValueError(f"--type {address!r}: expected the folder of a fleet and a type, FLEET:TYPE")
    store, trials = FleetStore(Path(folder)), job.trials
    machine = job.machine or machine_of(job.files[0])
    planes = tuple(plane for plane in job.planes if plane in (*job.used, *trials.planes))
    radii = tuple(job.radii.get(plane, np.nan) for plane in planes)
    grid = Grid(trials.speeds, trials.sensors, planes, *kind_of(trials.labels), radii)
    known = known_type(store, name, grid, _of_itself(store, job, machine))
    if not job.planes:  # nothing but a baseline: in the unit of the others' weights
        unit, scale = known.labels.weight_unit, known.labels.weight_scale
        trials = replace(trials, labels=replace(trials.labels, weight_unit=unit, weight_scale=scale))
    prior = known.kind.influence(trials.labels, machine)
    found, chance = update(prior, trials)
    if refined:
        if job.check is None:
            raise ValueError('there are no check runs to refine with: check = "check.csv" in the job file')
        trials = with_check_runs(trials, job.check)
        found, chance = update(prior, trials)
    kind, remarks = known.kind, found.remarks
    warnings = list(remarks.warnings)
    if any(record.machine == machine for record, _ in kind.odd):
        warnings.append(f"an earlier job of {machine!r} does not fit the type {name!r}, and does not count")
    if len(kind.machines) < ENOUGH and not trials.weights.any():
        warnings.append(_FEW)
    words = f"coefficients of the type {name!r}, {counted(len(kind.machines), 'machine')}"
    earlier = int(kind.effects.jobs[kind.machines.index(machine)]) if machine in kind.machines else 0
    if earlier:
        words += f", and of {counted(earlier, 'earlier job')} of {machine!r}"
        if kind.effects.jobs.max() == 1:
            warnings.append(
                f"no machine of the type was balanced twice: the errors lack how {machine!r} changed"
            )
    notes = (*remarks.notes, words, *known.notes)
    found = replace(found, remarks=remarks._replace(notes=notes, warnings=tuple(warnings)))
    reason = _reason(kind, trials) if chance < LEVEL else ""
    return TypeKnowledge(known, found, tuple(store.files("jobs", "coefficients")), earlier, chance, reason)


def _of_itself(store: FleetStore, job: Job, machine: str) -> list[str]:
    """Ids of the job in a store: with the same runs, or at the same place, as it was before it changed."""
    store.check()
    jobs, place = store.table("jobs"), "/" + job.files[0].resolve().as_posix()
    there = np.array([place.endswith(f"/{path}") for path in jobs["path"]], dtype=bool)
    own = jobs["runs_file"].isin([sha256(file) for file in job.files])
    return jobs["job"][own | (jobs["machine"] == machine) & there].tolist()


def _reason(kind: MachineType, trials: Trials) -> str:
    """What would make a machine one of the type."""
    with suppress(ValueError):
        if np.isfinite(kind.limit):
            return kind.why_odd(MachineRecord.of(kind.measured(trials)), trials)
    return ""
