"""Influence coefficients of a type of machines, and of a machine from its type and its own runs.

A coefficient differs from machine to machine by a few per cent along and by some degrees across; both
directions are those of the median machine's coefficient, so that a covariance which is shrunk towards its
diagonal (`rotorid.regression.random_effects`) keeps them. Machines whose whole set of coefficients is far
from the others' were mostly recorded otherwise. Three changes are tried, and each number θ that may be
chosen, the phase of Σ conj(W) μ / |μ|², counts against one:

- readings that lag where the job says that they lead: conj(W) e^{iθ}, with a θ for each plane, since a trial
  weight at the angle α makes conj(W) one of e^{2iα};
- another keyphasor mark, or another zero of the angles: W e^{iθ};
- two sensors exchanged.

Known of a machine by its type are W = μ + L ε with independent ε of variance 1 (`Influence.columns`); Y₀ is
free. A run reads Y = Y₀ + W T + e; what e has in common are further numbers ε. In the real parts of a
channel's readings, divided by the root of the errors of each reading alone, this is y = A Y₀ + K ε + noise of
variance 1. Least squares give Y₀ = A⁺ (y - K ε); what is left over, (1 - A A⁺) y of all channels together,
tells ε, which had variance 1 before: the posterior of normal errors. So a trial run in one plane also tells
of another where machines that differ in one differ in the other. A bare run: nothing but the type. Many
runs: the measured coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing import (
    Influence,
    Labels,
    Remarks,
    Trials,
    UndeterminedError,
    estimate_influence,
    local_runs,
    reading_of,
    real_parts,
    usual_run_errors,
    with_parameters,
)
from balancing.error_draws import Gaussian, Mounted, Whitening
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.choices import one_of
from rotorid.base.text import counted, listing
from rotorid.files.table_layouts import DEFAULT_TOLERANCE
from rotorid.files.units import vibration, weight
from rotorid.fleet.jobs import machine_of, mounted_in, quantity_of, read_fleet, runs_of
from rotorid.regression import covariance_root, unstretch
from rotorid.regression.random_effects import RandomEffects, oddness, random_effects

if TYPE_CHECKING:
    import pandas as pd

    from balancing import Correction
    from rotorid.files import Job

LEAST_MACHINES = 3
"""Fewer do not show how machines differ."""
_CHOSEN = 4.0
"""Of squared distance, which a change gives up for each number that it may choose."""
LEVEL = 0.001
"""Probability below which runs are not those of a machine of the type."""
ENOUGH = 12
"""Machines, from which on the regions of first shots hold what they say."""
READ, MOUNTED = ["speed_rad_s", "sensor", "quantity"], ["plane", "mounted"]
"""Columns of the table of a fleet: what a coefficient is of."""
_FEW = (
    "the type rests on few machines: where whole machines differ, 95 % regions of first shots held the truth "
    "in 84 to 88 of 100 simulated ones; make a trial run"
)


class MachineRecord(NamedTuple):
    """Coefficients measured in one job of one machine.

    Attributes
    ----------
    machine, job
        Names.
    W, std
        The coefficients, and one standard deviation of the real and of the imaginary part of each, (S, C, P);
        0 where errors are assumed.
    """

    machine: str
    job: str
    W: ComplexArray
    std: FloatArray


class MachineType(NamedTuple):
    """Coefficients of a type of machines.

    Attributes
    ----------
    speeds, sensors, planes
        rad/s, (S,), and names, C and P.
    turn
        Phases of the median machine, as numbers of size 1, (S, C, P).
    effects
        Of the coefficients over these, stretched, n = 2 S C P, with machines as groups.
    machines
        Names of those that belong to the type.
    odd
        Records that were left out, each with its squared distance over the limit.
    limit
        Squared distance within which machines belong to the type; infinite with fewer than `LEAST_GROUPS`.
    notes
        What was left out, and which errors nobody states.
    name, labels, left_out
        In a fleet: its name, units of a job of it, and how many jobs lack coefficients or are copies.
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    turn: ComplexArray
    effects: RandomEffects
    machines: tuple[str, ...]
    odd: tuple[tuple[MachineRecord, float], ...]
    limit: float
    notes: tuple[str, ...]
    name: str = ""
    labels: Labels = Labels()
    left_out: int = 0

    @property
    def mean(self) -> ComplexArray:
        """Mean coefficients (S, C, P)."""
        return self.coefficients(self.effects.mean)

    def coefficients(self, values: FloatArray) -> ComplexArray:
        """Stretched (…, n) as coefficients (…, S, C, P)."""
        return unstretch(values).reshape(*values.shape[:-1], *self.turn.shape) * self.turn

    def influence(self, labels: Labels, machine: str = "") -> Influence:
        """Coefficients to expect of one of `machines`, whose own jobs count then; else of a further one."""
        from scipy.special import chdtri, fdtri

        mean, covariance = self.effects.mean, self.effects.new_group + np.diag(_doubt(self.effects))
        if machine in self.machines:
            mean, covariance = self.effects.known(self.machines.index(machine))
        # what a region of two numbers at 95 % needs with so few machines: F over χ²
        widening = 2 * fdtri(2, len(self.machines) - 1, 0.95) / chdtri(2, 0.05)
        covariance = widening * (covariance + self.effects.within)
        columns = self.coefficients(covariance_root(covariance, np.diag(covariance)).T)
        W = self.coefficients(mean)
        nothing = np.full(W.shape[:2], np.nan), Gaussian.none(*W.shape)
        expected = Influence(self.speeds, self.sensors, self.planes, W, *nothing, labels)
        return with_parameters(expected, columns, 0.0)

    def why_odd(self, record: MachineRecord) -> str | None:
        """What would make an odd record fit the type best, in words; None where nothing tried does."""
        W, std, share = record.W, record.std, self.mean / np.abs(self.mean) ** 2
        lag = W.conj() * np.exp(1j * np.angle(np.sum(W * share, axis=(0, 1))))
        theta = np.angle(np.sum(W.conj() * share))
        degrees = round(np.degrees(theta))
        mark = f"{'led' if degrees > 0 else 'lagged'} {abs(degrees)}° more (another keyphasor mark)"
        tried = [
            (f"its phases {mark}", W * np.exp(1j * theta), std, 1),
            ("its phases were of the other sense (lag for lead)", lag, std, len(self.planes)),
        ]
        for a, b in combinations(range(len(self.sensors)), 2):
            order = np.arange(len(self.sensors))
            order[[a, b]] = b, a
            words = f"its sensors {self.sensors[a]} and {self.sensors[b]} were exchanged"
            tried.append((words, W[:, order], std[:, order], 0))
        distance, reason = min(
            (self.effects.distance(*_rows(W, std, self.turn)) + _CHOSEN * chosen, words)
            for words, W, std, chosen in tried
        )
        return reason if distance <= self.limit else None


def _doubt(effects: RandomEffects) -> FloatArray:
    """By how much more variances between machines may be expected to be, (n,): the rest after errors.

    Where errors E of the coefficients are most of the scatter B + E, what is left of it is uncertain by
    σ = √(2 ((B + E)² - B²) / (M - 1)) and not negative; its mean then is B + σ φ(B / σ) / Φ(B / σ).
    """
    from scipy.special import erfcx

    M, B = len(effects.jobs), np.diag(effects.between)
    total = M * (np.diag(effects.new_group) - B)
    std = np.sqrt(2 * np.maximum(total**2 - B**2, 0) / (M - 1))
    ratio = np.divide(B, std, out=np.full_like(B, np.inf), where=std > 0)
    return np.asarray(std * np.sqrt(2 / np.pi) / erfcx(-ratio / np.sqrt(2)))


def _rows(W: ComplexArray, std: FloatArray, turn: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients (…, S, C, P) over the type's phases as rows (…, n), and covariances (…, n / 2, 2, 2)."""
    rows = (W * np.conj(turn)).reshape(*W.shape[:-3], -1)
    return rows.view(float), std.reshape(*rows.shape, 1, 1) ** 2 * np.eye(2)


def fit_type(
    records: Sequence[MachineRecord], speeds: ArrayLike, sensors: Sequence[str], planes: Sequence[str]
) -> MachineType:
    """Coefficients of a type, from jobs of its machines; those that do not belong are left out and named.

    Parameters
    ----------
    records
        One a job, with the same speeds, sensors and planes.
    speeds, sensors, planes
        rad/s, (S,), and names.

    Raises
    ------
    UndeterminedError
        With fewer than `LEAST_MACHINES` machines that belong together.
    """
    names, W, std = (np.array([record[k] for record in records]) for k in (0, 2, 3))
    turn = np.exp(1j * np.angle(np.median(W.real, axis=0) + 1j * np.median(W.imag, axis=0)))
    y, error = _rows(W, std, turn)
    far, limit = oddness(y, error, np.unique(names, return_inverse=True)[1])
    fits = far <= limit
    machines, number = np.unique(names[fits], return_inverse=True)
    if len(machines) < LEAST_MACHINES:
        raise UndeterminedError(
            f"{counted(len(machines), 'machine')} with these speeds, sensors and planes: how machines of a "
            f"type differ shows with {LEAST_MACHINES} or more"
        )
    notes, assumed = list[str](), int((~std[fits].any(axis=(1, 2, 3))).sum())
    if assumed:
        notes.append(
            f"{counted(assumed, 'job')} without errors that are stated or measured: they count as none, and "
            "± are too wide rather than too narrow"
        )
    if np.isinf(limit):
        notes.append(f"with {counted(len(machines), 'machine')} nothing tells an odd one from the others")
    return MachineType(
        np.array(speeds),
        tuple(sensors),
        tuple(planes),
        turn,
        random_effects(y[fits], error[fits], number),
        tuple(machines.tolist()),
        tuple((records[j], float(far[j]) / limit) for j in np.flatnonzero(~fits).tolist()),
        limit,
        tuple(notes),
    )


def type_of_fleet(
    fleet: pd.DataFrame,
    name: str,
    read: pd.DataFrame | None = None,
    mounted: pd.DataFrame | None = None,
    without: str = "",
) -> MachineType:
    """A type where a job has read and mounted weights (None: the first of those with most), without runs.

    `read` and `mounted` have the columns `READ` and `MOUNTED`. ValueError for a type that is not there;
    UndeterminedError with too few machines.
    """
    one_of(name, "the type", sorted({*fleet["machine_type"]} - {""}))
    cells = fleet[(fleet["machine_type"] == name) & (fleet["runs"] != without)]
    each = cells.drop_duplicates(["runs", "speed_rad_s", "sensor", "plane"])  # without copies
    usual = each[each["job"].isin(each["job"].mode()[:1])]
    read = usual[READ].drop_duplicates() if read is None else read
    mounted = usual[MOUNTED].drop_duplicates() if mounted is None else mounted
    grid = read.merge(mounted, how="cross").reset_index(names="cell")
    rows = each.merge(grid, on=[*READ[1:], *MOUNTED], suffixes=("", "_wanted"))
    rows = rows[(rows["speed_rad_s"] / rows["speed_rad_s_wanted"] - 1).abs() <= DEFAULT_TOLERANCE / 100]
    rows = rows.drop_duplicates(["job", "cell"]).sort_values(["machine", "job", "cell"])
    rows = rows[rows.groupby("job")["cell"].transform("size") == len(grid)]
    if rows.empty:
        there = (f"{one} {listing(sorted({*cells[one]}), 'and')}" for one in (*READ[1:], *MOUNTED))
        raise UndeterminedError(
            f"no job of {name} has coefficients of all these speeds, sensors and planes; there are "
            f"{', '.join(there)}"
        )
    where = [grid[one].unique().tolist() for one in ("speed_rad_s", "sensor", "plane")]
    re, im, std = (rows[part].to_numpy().reshape(-1, *map(len, where)) for part in ("re", "im", "std"))
    first = rows[:: len(grid)]
    records = list(map(MachineRecord, first["machine"], first["job"], re + 1j * im, std))
    kind = fit_type(records, *where)
    left_out, notes = cells["job"].nunique() - len(records), kind.notes
    if left_out:
        about = "left out: copies of others, or without all of these coefficients"
        notes = (f"{counted(left_out, 'job')} of {name} {about}", *notes)
    unit, of_weight = rows[["vibration_unit", "weight_unit"]].iloc[0]
    labels = Labels(unit, vibration(unit).scale if unit else 1.0, of_weight, weight(of_weight).scale)
    return kind._replace(name=name, labels=labels, left_out=left_out, notes=notes)


class TypeKnowledge(NamedTuple):
    """What a type says of a machine.

    `influence` has what the job's own runs have added, `files` are those of the job and the table of the
    fleet, and so many `earlier` jobs of the machine count. `probability` is that of runs farther from the
    type, 1 where nothing tells.
    """

    kind: MachineType
    influence: Influence
    files: tuple[Path, ...]
    earlier: int
    probability: float

    def judged(self, result: Correction) -> Correction:
        """A correction that is not to be mounted where the machine is not of its type."""
        if self.probability >= LEVEL:
            return result
        cause = (
            f"by its runs this machine is not of the type {self.kind.name!r} "
            f"(χ², probability {self.probability:.1g})"
        )
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
        }


def type_coefficients(job: Job, address: str, trials: Trials) -> TypeKnowledge:
    """Coefficients of a job's machine from a type, FLEET:TYPE, and from runs of the machine.

    ValueError for an address, a fleet or a type that are not there.
    """
    import pandas as pd

    file, _, name = address.rpartition(":")
    if not file or not name:
        raise ValueError(f"--type {address!r}: expected the table of a fleet and a type, FLEET.parquet:TYPE")
    labels, machine = trials.labels, machine_of(job)
    read = pd.DataFrame(product(trials.speeds, trials.sensors, [quantity_of(labels)]), columns=READ)
    planes = [plane for plane in job.planes if plane in (*job.used, *trials.planes)]
    mounted = pd.DataFrame([(plane, mounted_in(job, plane)) for plane in planes], columns=MOUNTED)
    kind = type_of_fleet(read_fleet(Path(file)), name, read, mounted if planes else None, runs_of(job))
    if not planes:  # nothing but a baseline: in the unit of the others' weights
        labels = replace(labels, weight_unit=kind.labels.weight_unit, weight_scale=kind.labels.weight_scale)
    influence, probability = update(kind.influence(labels, machine), replace(trials, labels=labels))
    warnings, machines = list(influence.remarks.warnings), len(kind.machines)
    earlier = dict(zip(kind.machines, kind.effects.jobs.tolist(), strict=True)).get(machine, 0)
    words = f"coefficients of the type {name!r}, {counted(machines, 'machine')}"
    if machines < ENOUGH and not trials.weights.any():
        warnings.append(_FEW)
    if earlier:
        words += f", and of {counted(earlier, 'earlier job')} of {machine!r}"
        if kind.effects.jobs.max() == 1:
            warnings.append(
                f"no machine of the type was balanced twice: the errors lack how {machine!r} changed"
            )
    influence = replace(influence, remarks=Remarks(tuple(warnings), (words, *kind.notes)))
    return TypeKnowledge(kind, influence, (*job.files, Path(file)), earlier, probability)


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
    R, change = len(runs.runs), expected.columns()
    reading, run = reading_of(runs), usual_run_errors(runs)
    with suppress(UndeterminedError):  # as runs that tell more than the coefficients show them
        _, reading, run, *_ = estimate_influence(runs).errors
    errors = expected.errors._replace(reading=reading, run=run)
    noise = replace(expected, errors=errors).difference_noise(runs)
    columns = noise.at(errors.sizes)[1]  # (M, S, C, R)
    off = np.moveaxis(runs.mean, 0, -1) - expected.W @ runs.weights.T
    K = np.moveaxis(real_parts(np.concatenate((columns, off[None]))), 0, -1)
    root, M = np.linalg.cholesky(Whitening(noise, errors.sizes).blocks), len(columns)
    K = np.linalg.solve(root, K)  # (S, C, 2R, M + 1), the last is y
    A = np.linalg.solve(root, np.tile(np.eye(2), (R, 1)))
    G = np.linalg.pinv(A)
    left = np.vstack(((K - A @ (G @ K)).reshape(-1, M + 1), np.eye(M, M + 1)))
    Q, root = np.linalg.qr(left[:, :M])
    z = Q.T @ left[:, M]
    epsilon = np.linalg.solve(root, np.column_stack((z, np.eye(M)))).T  # (1 + M, M): mean, errors
    moved = np.tensordot(epsilon[:, : len(change)], change, 1)
    moved[..., 0] = unstretch(np.tensordot(-epsilon, G @ K[..., :M], (1, 3)))[..., 0]
    moved[0, ..., 0] += unstretch((G @ K)[..., M])[..., 0]
    alone = 0 * expected.channels()
    alone[..., :2, :2] = G @ np.swapaxes(G, -1, -2)
    result = replace(
        expected,
        W=expected.W + moved[0, ..., 1:],
        baseline=moved[0, ..., 0],
        errors=Gaussian(
            alone, moved[1:], reading, run, Mounted(runs.runs[-1], expected.planes, runs.weights[-1])
        ),
        labels=trials.labels,
        remarks=Remarks(tuple(dict.fromkeys((*trials.warnings, *reading.warnings)))),
    )
    spare = 2 * off[..., 1:].size
    return result, float(chdtrc(spare, np.sum((left[:, M] - Q @ z) ** 2))) if spare else 1.0
