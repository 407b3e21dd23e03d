"""Coefficients of a machine from its type and from its own runs, for `balance --type FLEET:TYPE`.

Known before are W = μ + L ε with independent ε of variance 1 (`Influence.columns`); Y₀ is free. A run reads
Y = Y₀ + W T + e; what e has in common are further numbers ε. In the real parts of a channel's readings,
divided by the root of the errors of each reading alone, this is y = A Y₀ + K ε + noise of variance 1. Least
squares give Y₀ = A⁺ (y - K ε); what is left over, (1 - A A⁺) y of all channels together, tells ε, which had
variance 1 before: the posterior of normal errors. So a trial run in one plane also tells of another where
machines that differ in one differ in the other. A bare run: nothing but the type. Many runs: the measured
coefficients.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from balancing import (
    Influence,
    Remarks,
    Trials,
    UndeterminedError,
    estimate_influence,
    local_runs,
    reading_of,
    real_parts,
    usual_run_errors,
    with_check_runs,
)
from balancing.noise import Gaussian, Mounted, kind_sizes, run_noise
from rotorid.base.text import counted
from rotorid.fleet.jobs import known_errors, machine_of, mounted_in, quantity_of, read_fleet, runs_of
from rotorid.fleet.machine_type import Grid, MachineRecord, MachineType, type_of_fleet
from rotorid.regression import unstretch

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

    `influence` has what the job's own runs have added, `files` are those of the job and the table of the
    fleet, and so many `earlier` jobs of the machine count. `probability` is that of runs farther from the
    type, 1 where nothing tells; if it is below `LEVEL`, `reason` would make the machine one of the type ("":
    not known).
    """

    kind: MachineType
    influence: Influence
    files: tuple[Path, ...]
    earlier: int
    probability: float
    reason: str

    def judged(self, result: Correction) -> Correction:
        """A correction that is not to be mounted where the machine is not of its type."""
        if self.probability >= LEVEL:
            return result
        rare = f"{self.probability:.1g}" if self.probability > 1e-12 else "below 1e-12"
        cause = f"by its runs this machine is not of the type {self.kind.name!r} (χ², probability {rare})"
        cause += f"; it would fit if {self.reason}" if self.reason else ""
        instead = ("Instead: balance it without --type.",)
        decision = replace(result.decision, word="do not mount", cause=cause, instead=instead)
        return replace(result, decision=decision)

    def to_dict(self) -> dict[str, object]:
        """As JSON types."""
        return {
            "machine_type": self.kind.name,
            "machines": len(self.kind.machines),
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
    fleet, trials, machine = read_fleet(Path(file)), job.trials, machine_of(job)
    if refined:
        if job.check is None:
            raise ValueError('there are no check runs to refine with: check = "check.csv" in the job file')
        trials = with_check_runs(trials, job.check)
    planes = tuple(plane for plane in job.planes if plane in (*job.used, *trials.planes))
    mounted = tuple(mounted_in(job, plane) for plane in planes)
    grid = Grid(trials.speeds, trials.sensors, quantity_of(trials.labels), planes, mounted)
    # the job itself, by its runs, or at the same place as it was before it changed
    place = f"/{job.files[0].resolve().as_posix()}"
    here = fleet["job"].map(lambda path: place.endswith(f"/{path}")) & (fleet["machine"] == machine)
    kind = type_of_fleet(fleet, name, grid, fleet["job"][here | (fleet["runs"] == runs_of(job))])
    machines, labels = len(kind.machines), trials.labels
    if not job.planes:  # nothing but a baseline: in the unit of the others' weights
        unit, scale = kind.labels.weight_unit, kind.labels.weight_scale
        labels = replace(labels, weight_unit=unit, weight_scale=scale)
    trials = replace(trials, labels=labels)
    influence, probability = update(kind.influence(labels, machine), trials)
    warnings, reason, earlier = list(influence.remarks.warnings), "", 0
    words = f"coefficients of the type {name!r}, {counted(machines, 'machine')}"
    if machines < ENOUGH and not trials.weights.any():
        warnings.append(_FEW)
    if machine in kind.machines:
        earlier = int(kind.effects.jobs[kind.machines.index(machine)])
        words += f", and of {counted(earlier, 'earlier job')} of {machine!r}"
        if kind.effects.jobs.max() == 1:
            warnings.append(
                f"no machine of the type was balanced twice: the errors lack how {machine!r} changed"
            )
    if probability < LEVEL and np.isfinite(kind.limit):
        with suppress(ValueError):  # runs that do not give coefficients tell no reason
            measured = estimate_influence(local_runs(influence, trials))
            reason = kind.why_odd(MachineRecord(machine, "", measured.W, known_errors(measured)))
    influence = replace(influence, remarks=Remarks(tuple(warnings), (words, *kind.notes)))
    return TypeKnowledge(kind, influence, (*job.files, Path(file)), earlier, probability, reason)


def update(expected: Influence, trials: Trials) -> tuple[Influence, float]:
    """Coefficients and the bare rotor's readings, from what is known before and from runs.

    Parameters
    ----------
    expected
        Coefficients with columns, as of `MachineType.influence`.
    trials
        Runs with these sensors, speeds and planes; one bare run is enough.

    Returns
    -------
    The coefficients with a baseline, and the probability of readings farther from what was expected, by χ²; 1
    where nothing is spare.

    Raises
    ------
    ValueError
        For runs without these sensors, speeds or planes.
    """
    from scipy.special import chdtrc

    runs = local_runs(expected, trials)
    R, (S, C, P) = len(runs.runs), expected.W.shape
    reading, run = reading_of(runs), usual_run_errors(runs)
    with suppress(UndeterminedError):  # as runs that tell more than the coefficients show them
        _, reading, run, *_ = estimate_influence(runs).errors
    noise = run_noise(runs, expected.W, np.eye(R, dtype=complex), reading, run)
    single, shared = noise.at(kind_sizes(run))  # (S, C, 2R, 2R), (M, S, C, R)
    single += 1e-12 * (np.trace(single, axis1=-2, axis2=-1).max() or 1.0) * np.eye(2 * R)
    root, change = np.linalg.cholesky(single), expected.columns()[..., 1:]
    off = np.moveaxis(runs.mean, 0, -1) - expected.W @ runs.weights.T
    acting = np.concatenate((change @ runs.weights.T, shared, off[None]))
    K = np.linalg.solve(root, np.moveaxis(real_parts(acting), 0, -1))  # (S, C, 2R, M + 1), the last is y
    A = np.linalg.solve(root, np.tile(np.eye(2), (R, 1)))
    G = np.linalg.pinv(A)
    bare = G @ K
    left, M, m = (K - A @ bare).reshape(-1, len(acting)), len(acting) - 1, len(change)
    U, size, V = np.linalg.svd(np.vstack((left[:, :M], np.eye(M))), full_matrices=False)
    r = np.append(left[:, M], np.zeros(M))
    epsilon = V.T / size @ np.column_stack((U.T @ r, np.eye(M)))  # its mean, and columns of its errors
    Y = np.moveaxis(-bare[..., :M] @ epsilon, -1, 0)
    Y[0] += bare[..., M]
    moved = np.concatenate((unstretch(Y), np.tensordot(epsilon[:m].T, change, 1)), axis=-1)
    alone = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    alone[..., :2, :2] = G @ np.swapaxes(G, -1, -2)
    mounted = Mounted(runs.runs[-1], expected.planes, runs.weights[-1])
    result = replace(
        expected,
        W=expected.W + moved[0, ..., 1:],
        baseline=moved[0, ..., 0],
        errors=Gaussian(alone, moved[1:], reading, run, mounted),
        labels=trials.labels,
        remarks=Remarks(tuple(dict.fromkeys((*trials.warnings, *reading.warnings)))),
    )
    spare = 2 * S * C * (R - 1)
    return result, float(chdtrc(spare, np.sum((r - U @ (U.T @ r)) ** 2))) if spare else 1.0
