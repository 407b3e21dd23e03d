"""Coefficients of a machine from its type and from its own runs, for `balance --type FLEET:TYPE`."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from balancing import Influence, with_check_runs
from rotorid.base.text import counted
from rotorid.fleet.jobs import kind_of, machine_of, read_fleet, runs_of
from rotorid.fleet.machine_type import MachineRecord
from rotorid.fleet.posterior import update
from rotorid.fleet.types import Grid, KnownType, known_type

if TYPE_CHECKING:
    from balancing import Correction
    from rotorid.files import Job

LEVEL = 0.001
"""Probability below which runs are not those of a machine of the type."""
ENOUGH = 12
"""Machines, from which on the regions of first shots hold what they say."""
_FEW = (
    "the type rests on few machines: where whole machines differ, 95 % regions of first shots held the truth "
    "in 84 to 88 of 100 simulated ones; make a trial run"
)


@dataclass(frozen=True, eq=False)
class TypeKnowledge:
    """What a type says of a machine.

    `influence` has what the job's own runs have added, `file` is the table of the fleet, and so many
    `earlier` jobs of the machine count. `probability` is that of runs farther from the type, 1 where
    nothing tells; if it is below `LEVEL`, `reason` would make the machine one of the type ("": not known).
    """

    known: KnownType
    influence: Influence
    file: Path
    earlier: int
    probability: float
    reason: str

    def files_beside(self, job: Job) -> tuple[Path, ...]:
        """Those of a job, and the fleet."""
        return (*job.files, self.file)

    def judged(self, result: Correction) -> Correction:
        """A correction that is not to be mounted where the machine is not of its type."""
        if self.probability >= LEVEL:
            return result
        rare = f"{self.probability:.1g}" if self.probability > 1e-12 else "below 1e-12"
        cause = f"by its runs this machine is not of the type {self.known.name!r} (χ², probability {rare})"
        cause += f"; it would fit if {self.reason}" if self.reason else ""
        instead = ("Instead: balance it without --type.",)
        return replace(
            result, decision=replace(result.decision, word="do not mount", cause=cause, instead=instead)
        )

    def to_dict(self) -> dict[str, object]:
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
    file, _, name = address.rpartition(":")
    if not file or not name:
        raise ValueError(f"--type {address!r}: expected the table of a fleet and a type, FLEET.parquet:TYPE")
    fleet, trials, machine = (
        read_fleet(Path(file)),
        job.trials,
        job.settings.machine or machine_of(job.files[0]),
    )
    planes = tuple(plane for plane in job.planes if plane in (*job.used, *trials.planes))
    radii = tuple(job.radii.get(plane, np.nan) for plane in planes)
    grid = Grid(trials.speeds, trials.sensors, planes, *kind_of(trials.labels), radii)
    # the job itself, by its runs, or at the same place as it was before it changed
    place = "/" + job.files[0].resolve().as_posix()
    here = np.array([place.endswith(f"/{path}") for path in fleet["job"]], dtype=bool)
    itself = fleet["job"][(fleet["runs"] == runs_of(job)) | (fleet["machine"] == machine) & here]
    known = known_type(fleet, name, grid, itself.unique())
    kind = known.kind
    if not job.planes:  # nothing but a baseline: in the unit of the others' weights
        unit, scale = known.labels.weight_unit, known.labels.weight_scale
        trials = replace(trials, labels=replace(trials.labels, weight_unit=unit, weight_scale=scale))
    if refined:
        if job.check is None:
            raise ValueError('there are no check runs to refine with: check = "check.csv" in the job file')
        trials = with_check_runs(trials, job.check)
    influence, chance = update(kind.influence(trials.labels, machine), trials)
    warnings = list(influence.remarks.warnings)
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
    notes = (*influence.remarks.notes, words, *known.notes)
    remarks = influence.remarks._replace(notes=notes, warnings=tuple(warnings))
    reason = ""
    if chance < LEVEL and np.isfinite(kind.limit):
        with suppress(ValueError):  # runs that do not give all coefficients tell no reason
            reason = kind.why_odd(MachineRecord.of(kind.measured(trials)), trials)
    return TypeKnowledge(known, replace(influence, remarks=remarks), Path(file), earlier, chance, reason)
