"""Coefficients of a job from its type: the first shot, and what its own runs have added since."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from balancing.coefficients.identifiability import UndeterminedError
from balancing.coefficients.influence import Influence, estimate_influence
from balancing.coefficients.machine_type import on_grid, record_of, why_odd
from balancing.correction.correct import correct
from balancing.correction.refine_coefficients import together
from balancing.correction.update_coefficients import update
from balancing.data.trials import Trials
from rotorid.base.text import counted
from rotorid.workflows.fleet.type_records import Grid, KnownType, known_type
from rotorid.workflows.result_provenance import hash_of

if TYPE_CHECKING:
    from rotorid.tables import Job

LEVEL = 0.001
"""Probability below which runs are not those of a machine of the type."""

_RARE = 1e-12


class TypeKnowledge(NamedTuple):
    """Coefficients with a baseline; files that they are from; why the machine is not of its type, or ""."""

    influence: Influence
    files: tuple[Path, ...]
    foreign: str


def type_coefficients(job: Job, address: str, *, refined: bool = False) -> TypeKnowledge:
    """Coefficients of a job's machine from its type and the runs of the job; check runs if `refined`.

    Parameters
    ----------
    job
        With one run at least.
    address
        FLEET:TYPE.

    Raises
    ------
    ValueError
        For an address, a fleet or a type that are not there, and check runs that are not.
    """
    from rotorid.tables.fleet.fleet_store import FleetStore
    from rotorid.tables.fleet.job_records import kind_of
    from rotorid.tables.fleet.job_search import machine_of
    from rotorid.tables.reader.units import weight

    folder, _, name = address.rpartition(":")
    if not folder or not name:
        raise ValueError(f"--type {address!r}: expected the folder of a fleet and a type, FLEET:TYPE")
    store, trials = FleetStore(Path(folder)), job.trials
    grid = Grid(trials.speeds, trials.sensors, job.used, *kind_of(trials.labels))
    known = known_type(store, name, grid, [hash_of(file) for file in job.files])
    if not job.planes:  # nothing but a baseline: in the unit of the others' weights
        unit = weight(str(known.jobs["weight_unit"].mode()[0]))
        labels = replace(trials.labels, weight_unit=unit.name, weight_scale=unit.scale)
        trials = replace(trials, labels=labels)
    machine = job.machine or machine_of(job.files[0])
    prior = known.kind.influence(trials.labels, machine)
    found, chance = update(prior, trials)
    if refined:
        if job.check is None:
            raise ValueError('there are no check runs to refine with: check = "check.csv" in the job file')
        mounted = None if job.check_mounted else correct(found)
        trials = together(trials, job.check, corrections=mounted)
        found, chance = update(prior, trials)
    odd = f"an earlier job of {machine!r} does not fit the type {name!r}, and does not count"
    warnings = (odd,) * any(record.machine == machine for record, _ in known.kind.odd)
    notes = (*found.notes, _words(known, machine), *known.notes)
    return TypeKnowledge(
        replace(found, notes=notes, warnings=(*found.warnings, *warnings)),
        tuple(store.files("jobs", "coefficients")),
        _foreign(known, trials, chance) if chance < LEVEL else "",
    )


def _words(known: KnownType, machine: str) -> str:
    """Where the coefficients come from."""
    words = f"coefficients of the type {known.name!r}, {counted(len(known.kind.machines), 'machine')}"
    if machine not in known.kind.machines:
        return words
    own = int((known.jobs["machine"] == machine).sum())
    return f"{words}, and of {counted(own, 'earlier job')} of {machine!r}"


def _foreign(known: KnownType, trials: Trials, chance: float) -> str:
    """That a machine is not of its type, and what would make it one."""
    kind, why = known.kind, ""
    if np.isfinite(kind.limit):
        with suppress(UndeterminedError, ValueError):
            measured = on_grid(estimate_influence(trials), kind.speeds, kind.sensors, kind.planes)
            why = why_odd(kind, record_of("", "", measured), trials)
    rare = f"{chance:.1g}" if chance > _RARE else f"below {_RARE:g}"
    what = f"by its runs this machine is not of the type {known.name!r} (χ², probability {rare})"
    fits = f"; it would fit if {why}" if why else ""
    return f"Do not mount these weights: {what}{fits}. Balance it without --type."
