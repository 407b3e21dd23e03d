"""Influence coefficients: what weights do, `Y = Y₀ + W T`, how they err, and how they are drawn again.

All errors act linearly. θ = (Y₀, W₁, …, W_P) of every reading errs by numbers of its own and by columns that
readings have in common,

    δθ = own + Σ column_m · (size of its kind) · z_m,    z real, independent, of variance 1.

For trial runs θ = G Y with the gain G of least squares, so that a run drawn again draws θ again. The size of
each kind (readings, own part of a run, what is common to it, further unbalance, what is known) comes first.
Source of the estimate: [S] (34)–(39), generalised: weights removed or left in, several in a run and repeated
runs are all one relation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from balancing.conditioning import UndeterminedError, check_effects, check_runs
from balancing.conventions import Labels
from balancing.errors import (
    NO_RUN_ERRORS,
    NOTICEABLE,
    ROUNDING,
    Reading,
    RunErrors,
    contradiction,
    job_columns,
    mean_variance,
    own_variance,
    reading_of,
    rms,
    run_errors,
    unbalances,
    unseen,
    usual_run_errors,
)
from balancing.regions import real_parts
from balancing.trials import Trials, check_names, check_speeds
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.tables import Column, Table, frame
from rotorid.regression import covariance_root, gain, stretch, unstretch

if TYPE_CHECKING:
    import pandas as pd

SPEED_TOLERANCE = 0.005
"""Speeds that differ by less, relatively, count as one."""
SAME = 1e-9
"""Readings that differ by less, relatively, are the same ones, written and read again."""
BLOCK = 2_000_000
"""Numbers of a block of draws."""
READING, OWN, COMMON, LOADS, UNBALANCE, KNOWN = range(6)


class Remarks(NamedTuple):
    """Sentences: what the user should know, may want to know, and which warnings say that runs disagree."""

    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    contradictions: tuple[str, ...] = ()


class Mounted(NamedTuple):
    """What is mounted: name of the run, planes, weights (P,); all zero where nothing is."""

    run: str
    planes: tuple[str, ...]
    weights: ComplexArray


class Noise(NamedTuple):
    """How (Y₀, W) err.

    `own` (2, S, C, 2P + 2, 2P + 2): covariances by readings, and by the own part of runs of size 1; `columns`
    (M, S, C, P + 1) of size 1, and `kind` (M,), which size each has.
    """

    own: FloatArray
    columns: ComplexArray
    kind: IntArray

    def cut(self, speeds: Sequence[int], sensors: Sequence[int], planes: Sequence[int]) -> Noise:
        """Of some speeds, sensors and planes."""
        chosen = [0, *(1 + p for p in planes)]
        real = [2 * k + part for k in chosen for part in (0, 1)]
        return Noise(
            self.own[np.ix_((0, 1), speeds, sensors, real, real)],
            self.columns[np.ix_(range(len(self.columns)), speeds, sensors, chosen)],
            self.kind,
        )

    def scaled(self, share: FloatArray) -> Noise:
        """Each of (Y₀, W₁, …) times a number, (S, C, P + 1)."""
        real = np.repeat(share, 2, axis=-1)
        own = self.own * real[..., None] * real[..., None, :]
        return Noise(own, self.columns * share, self.kind)

    def spread(
        self, shape: tuple[int, int, int], speeds: list[int], sensors: list[int], planes: list[int]
    ) -> Noise:
        """In their places among more speeds, sensors and planes, (S, C, P)."""
        S, C, P = shape
        chosen = [0, *(1 + p for p in planes)]
        real = [2 * k + part for k in chosen for part in (0, 1)]
        own = np.zeros((2, S, C, 2 * P + 2, 2 * P + 2))
        own[np.ix_((0, 1), speeds, sensors, real, real)] = self.own
        columns = np.zeros((len(self.columns), S, C, P + 1), dtype=complex)
        columns[np.ix_(range(len(columns)), speeds, sensors, chosen)] = self.columns
        return Noise(own, columns, self.kind)

    def changed(self, change: ComplexArray) -> Noise:
        """Of other combinations (m, P + 1), or (S, C, m, P + 1), of (Y₀, W)."""
        real = stretch(change)
        own = real @ self.own @ np.swapaxes(real, -1, -2)
        return Noise(own, (change @ self.columns[..., None])[..., 0], self.kind)

    def plus(self, other: Noise) -> Noise:
        """Together with an independent one."""
        columns = np.concatenate((self.columns, other.columns))
        return Noise(self.own + other.own, columns, np.concatenate((self.kind, other.kind)))

    def covariance(self, sizes: FloatArray) -> FloatArray:
        """Of each reading, (S, C, 2P + 2, 2P + 2), at sizes (6,) of the kinds."""
        F = stretch(self.columns[..., None])[..., 0] * sizes[self.kind][:, None, None, None]
        common = np.einsum("mscp,mscq->scpq", F, F, optimize=True)
        return np.asarray(np.tensordot(sizes[:2] ** 2, self.own, axes=1) + common)


@dataclass(frozen=True, eq=False)
class Errors:
    """Where (Y₀, W) come from, and how they err.

    Attributes
    ----------
    noise
        How they err.
    reading, run
        Errors of a reading and of a run that they are made of, and that further readings have.
    mounted
        In the last run.
    trials
        The runs; None: stored, computed or combined coefficients.
    """

    noise: Noise
    reading: Reading
    run: RunErrors
    mounted: Mounted
    trials: Trials | None = None

    @property
    def sizes(self) -> FloatArray:
        """Typical size of each kind, (6,)."""
        return np.array([1.0, *self.run.typical, 1.0])

    def draw(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Sizes of each kind in so many draws, (count, 6)."""
        scales = self.reading.scales(rng, count)
        return np.column_stack((scales, self.run.draw(rng, count), np.ones(count)))


class Gaussian(Errors):
    """Errors of stored, computed or combined coefficients: normal, as they are.

    Parameters
    ----------
    own
        Covariance of (Re Y₀, Im Y₀, Re W₁, …) of each reading without the columns, (S, C, 2P + 2, 2P + 2);
        zero where nothing is known.
    columns
        What readings have in common: Σ column · (independent real normal of variance 1), (M, S, C, P + 1).
    reading, run
        Of further readings.
    mounted
        What is mounted.

    Attributes
    ----------
    noise, trials
        How (Y₀, W) err; None: there are no runs.
    """

    def __init__(
        self,
        own: FloatArray,
        columns: ComplexArray,
        reading: Reading,
        run: RunErrors,
        mounted: Mounted | None = None,
    ) -> None:
        noise = Noise(np.stack((own, np.zeros_like(own))), columns, np.full(len(columns), KNOWN))
        nothing = Mounted("", (), np.zeros(columns.shape[-1] - 1, dtype=complex))
        super().__init__(noise, reading, run, mounted or nothing)

    @classmethod
    def none(cls, S: int, C: int, P: int) -> Gaussian:
        """Of coefficients (S, C, P) of which no errors are known."""
        own = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
        return cls(own, np.zeros((0, S, C, P + 1), dtype=complex), Reading(), NO_RUN_ERRORS)


@dataclass(frozen=True, eq=False)
class Influence:
    """Influence coefficients of P planes on C sensors at S speeds.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    sensors, planes
        Names, lengths C and P.
    W
        Complex amplitude per weight, shape (S, C, P).
    baseline
        Readings of the bare rotor, shape (S, C); NaN where there are none.
    errors
        How they err, and what that follows from.
    labels
        Units and conventions to print results in.
    remarks
        Sentences for the user.
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    W: ComplexArray
    baseline: ComplexArray
    errors: Errors
    labels: Labels = field(default_factory=Labels)
    remarks: Remarks = field(default_factory=Remarks)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", check_names(self.sensors, "sensors"))
        object.__setattr__(self, "planes", check_names(self.planes, "planes"))
        object.__setattr__(self, "speeds", check_speeds(self.speeds))
        S, C, P = len(self.speeds), len(self.sensors), len(self.planes)
        for name, shape in (("W", (S, C, P)), ("baseline", (S, C))):
            array: NDArray[np.complex128] = np.array(getattr(self, name), dtype=complex)
            if array.shape != shape:
                raise ValueError(f"{name} must have shape {shape}; got {array.shape}")
            if not np.isfinite(array).all() and (name == "W" or np.isinf(array).any()):
                raise ValueError(f"{name} of the influence coefficients must be finite")
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def has_baseline(self) -> bool:
        """Whether every reading of the bare rotor is known."""
        return not np.isnan(self.baseline).any()

    @property
    def trials(self) -> Trials | None:
        """The runs; None: there are none."""
        return self.errors.trials

    @property
    def reading(self) -> Reading:
        """Errors of a reading."""
        return self.errors.reading

    @property
    def run_errors(self) -> RunErrors:
        """What changes from run to run."""
        return self.errors.run

    @property
    def mounted(self) -> Mounted:
        """What is mounted today."""
        return self.errors.mounted

    @property
    def known_errors(self) -> bool:
        """Whether anything is known of the errors."""
        return bool(self.errors.noise.own.any() or self.errors.noise.columns.any())

    @property
    def unit(self) -> str:
        """Unit of a coefficient, such as "um_pp/g"."""
        return f"{self.labels.vibration_unit or '1'}/{self.labels.weight_unit or '1'}"

    def draws(
        self, count: int = 400, seed: int = 0, block: int | None = None
    ) -> Iterator[tuple[ComplexArray, ComplexArray]]:
        """The coefficients drawn again, block by block; nothing where errors are not known.

        Parameters
        ----------
        count
            Number of draws.
        seed
            The same draws for the same seed, whatever the blocks.
        block
            Draws of a block; default: as many as fit a few ten megabytes.

        Yields
        ------
        Y₀ (B, S, C) and W (B, S, C, P).
        """
        if not self.known_errors:
            return
        theta = np.concatenate((self.baseline[..., None], self.W), axis=-1)
        factors = self.errors.draw(np.random.default_rng([seed, 0]), count)
        for error in _drawn(self.errors.noise, factors, seed, block or max(1, BLOCK // (2 * theta.size))):
            drawn = theta + error
            yield drawn[..., 0], drawn[..., 1:]

    def channels(self) -> FloatArray:
        """First-order covariance of (Re Y₀, Im Y₀, Re W₁, …) of each reading, (S, C, 2P + 2, 2P + 2)."""
        return self.errors.noise.covariance(self.errors.sizes)

    def known_channels(self) -> FloatArray:
        """As `channels`, of what was stated or measured; only that may refuse a job."""
        run_known = self.run_errors.origin != "assumed"
        known = np.array([self.reading.source != "assumed", *[run_known] * 4, True])
        return self.errors.noise.covariance(self.errors.sizes * known)

    def columns(self) -> ComplexArray:
        """What of it readings have in common, (M, S, C, P + 1).

        (Y₀, W) errs by their sum, each times a real number of variance 1.
        """
        noise = self.errors.noise
        return noise.columns * self.errors.sizes[noise.kind][:, None, None, None]

    def part(
        self, speeds: Sequence[int], sensors: Sequence[int] | None = None, planes: Sequence[int] | None = None
    ) -> Influence:
        """Those of some speeds, sensors and planes, by their indices; None: of all."""
        sensors, planes = (
            list(range(len(names)) if given is None else given)
            for given, names in ((sensors, self.sensors), (planes, self.planes))
        )
        mounted, chosen = self.mounted, tuple(self.planes[p] for p in planes)
        errors = Errors(
            self.errors.noise.cut(speeds, sensors, planes),
            self.reading,
            self.run_errors,
            Mounted(mounted.run, chosen, mounted.weights[planes]),
            self.trials,
        )
        return replace(
            self,
            speeds=self.speeds[list(speeds)],
            sensors=tuple(self.sensors[c] for c in sensors),
            planes=chosen,
            W=self.W[np.ix_(speeds, sensors, planes)],
            baseline=self.baseline[np.ix_(speeds, sensors)],
            errors=errors,
        )

    def table(self) -> Table:
        """One row per speed, sensor and plane; the phase is the lead of the vibration by a weight at 0°."""
        scale = self.labels.vibration_scale / self.labels.weight_scale
        S, C, P = self.W.shape
        columns = (
            Column("speed_rpm", np.repeat(np.round(self.speeds * RPM, 9), C * P)),
            Column("sensor", np.tile(np.repeat(self.sensors, P), S)),
            Column("plane", np.tile(self.planes, S * C)),
            Column("influence", np.abs(self.W).ravel() * scale),
            Column("phase_deg", np.mod(np.degrees(np.angle(self.W)).ravel(), 360.0)),
        )
        return Table("influence coefficients", columns)

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; phases lead, weights turn with the rotation."""
        table = self.table()
        rows = [dict(zip(table.headings, row, strict=True)) for row in table.rows]
        return {"unit": self.unit, "phase": "lead", "angles": "with rotation", "rows": rows}

    def to_frame(self) -> pd.DataFrame:
        """The table."""
        return frame(self.table())

    def rebased(self, baseline: Trials | ArrayLike) -> Influence:
        """The same coefficients with today's vibration as baseline.

        Parameters
        ----------
        baseline
            Runs at known weights (the bare rotor is the mean of Y − W T), or its readings (S, C).

        Raises
        ------
        ValueError
            For planes, sensors or speeds that do not fit, and readings that are not finite.
        """
        if not isinstance(baseline, Trials):
            readings = np.array(baseline, dtype=complex)
            nothing = np.zeros((1, len(self.planes)), dtype=complex)
            baseline = Trials(
                ("baseline",),
                self.speeds,
                self.sensors,
                self.planes,
                readings[None],
                nothing,
                labels=self.labels,
            )
        speeds, sensors = places(self, baseline)
        weights = mounted_weights(self, baseline)
        local = _of(baseline, speeds, sensors, self.planes, weights)
        bare = local.mean - np.einsum("scp,rp->rsc", self.W, weights)
        mean, largest = bare.mean(axis=0), np.abs(bare).max()
        apart = float(np.abs(bare - bare[0]).max() / (largest or 1.0))
        words = (
            f"runs imply vibrations of the bare rotor that differ by {100 * apart:.2g} % of the largest one: "
        )
        if apart > NOTICEABLE and not weights.any():
            raise UndeterminedError(
                f"{words}if they are trial runs, give the weights table or keep only the baseline run"
            )
        own, reading, noise = reading_of(local), self.reading, self.errors.noise
        warnings = tuple(dict.fromkeys((*self.remarks.warnings, *baseline.warnings, *own.warnings)))
        remarks = self.remarks._replace(warnings=warnings)
        if apart > NOTICEABLE:
            words += "check the weights table and the stored coefficients"
            remarks = Remarks((*remarks.warnings, words), remarks.notes, (*remarks.contradictions, words))
        read_again = len(bare) == 1 and baseline.errors in (None, reading.errors)
        if not self.known_errors and own.source != "assumed":
            words = (
                "the errors of the influence coefficients are not known: ± are those of the vibration to "
                "correct alone, and too small"
            )
            remarks = remarks._replace(warnings=(*remarks.warnings, words))
        again = read_again and np.abs(mean - self.baseline).max() <= SAME * largest
        if not again and (self.known_errors or own.source != "assumed"):
            if own.source != "assumed" or reading.errors is None:
                reading = own._replace(dof=min(own.dof, reading.dof))
            change = np.eye(1 + len(self.planes), dtype=complex)
            change[0] = [0.0, *-weights.mean(axis=0)]
            real = stretch(change)
            G = np.zeros((*self.W.shape[:2], len(change), len(weights)))
            G[..., 0, :] = 1 / len(weights)
            new = run_noise(local, self.W, G, reading, self.run_errors)
            columns = np.concatenate((noise.columns @ change.T, new.columns))
            noise = Noise(
                real @ noise.own @ real.T + new.own, columns, np.concatenate((noise.kind, new.kind))
            )
        last = Mounted(baseline.runs[-1], self.planes, weights[-1])
        errors = Errors(noise, reading, self.run_errors, last, self.trials)
        return replace(self, baseline=mean, errors=errors, labels=baseline.labels, remarks=remarks)

    def difference_noise(self, check: Trials, predicted: ComplexArray) -> Noise:
        """How readings of runs err against Y₀ + W T: `own` (2, S, C, 2R, 2R), `columns` (M, S, C, R).

        Parameters
        ----------
        check
            R runs with the speeds, sensors and planes of the coefficients.
        predicted
            Y₀ + W T, (R, S, C), of which errors are so many percent.
        """
        R = len(check.runs)
        change = np.column_stack((np.ones(R), check.weights)).astype(complex)
        reading = reading_of(check)
        reading = self.reading if reading.source == "assumed" and self.reading.errors is not None else reading
        expected = replace(check, readings=np.where(np.isnan(check.readings), np.nan, predicted))
        further = run_noise(
            expected, self.W, np.broadcast_to(np.eye(R), (*self.W.shape[:2], R, R)), reading, self.run_errors
        )
        return self.errors.noise.changed(change).plus(further)

    def noise_draws(self, noise: Noise, count: int = 400, seed: int = 0) -> Iterator[ComplexArray]:
        """Errors (B, S, C, n) of a noise with the sizes of `draws` of the same seed, block by block."""
        factors = self.errors.draw(np.random.default_rng([seed, 0]), count)
        step = max(1, BLOCK // (2 * noise.own[0, ..., 0].size))
        return _drawn(noise, factors, seed + 1, step)

    def further(
        self, readings: ComplexArray, weights: ComplexArray, count: int = 400, seed: int = 0
    ) -> Iterator[ComplexArray]:
        """Errors of one more run, drawn with sizes as in `draws` of the same seed.

        Parameters
        ----------
        readings
            What is expected, (S, C).
        weights
            What is mounted then, (P,).

        Yields
        ------
        (B, S, C), blocks of the same lengths as those of `draws`.
        """
        names = ("run",), self.speeds, self.sensors, self.planes
        run = Trials(*names, readings[None], weights[None])
        if self.trials is not None:
            run = replace(run, placement=self.trials.placement)
        noise = run_noise(run, self.W, np.ones((*readings.shape, 1, 1)), self.reading, self.run_errors)
        step = max(1, BLOCK // (2 * (self.W.size + readings.size)))
        for error in _drawn(noise, self.errors.draw(np.random.default_rng([seed, 0]), count), seed + 1, step):
            yield error[..., 0]


def _drawn(noise: Noise, factors: FloatArray, seed: int, step: int) -> Iterator[ComplexArray]:
    """Errors (B, S, C, P + 1) of so many draws, the same whatever the blocks."""
    rngs = [np.random.default_rng([seed, part]) for part in (1, 2, 3)]
    roots = [covariance_root(part, np.einsum("...ii->...i", part)) for part in noise.own]
    columns = noise.columns.reshape(len(noise.columns), roots[READING][..., 0].size // 2)
    for start in range(0, len(factors), step):
        f = factors[start : start + step]
        z = rngs[2].standard_normal((len(f), len(columns))) * f[:, noise.kind]
        error = (z @ columns).reshape(len(f), *noise.columns.shape[1:])
        for kind in (READING, OWN):
            if roots[kind].any() and factors[:, kind].any():
                z = rngs[kind].standard_normal((len(f), *roots[kind].shape[:-1], 1))
                error = error + f[:, kind, None, None, None] * unstretch((roots[kind] @ z)[..., 0])
        yield error


class Whitening:
    """V⁻¹ of a noise at some sizes: blocks of each sensor and speed, and columns in common (Woodbury)."""

    def __init__(self, noise: Noise, sizes: FloatArray) -> None:
        own = np.tensordot(sizes[:2] ** 2, noise.own, axes=1)
        n = own.shape[-1]
        least = 1e-12 * np.trace(own, axis1=-2, axis2=-1).max() / n
        self._root = np.linalg.cholesky(own + least * np.eye(n))
        F = real_parts(noise.columns * sizes[noise.kind][:, None, None, None])
        self._columns = self._solve(np.moveaxis(F, 0, -1)).reshape(own[..., 0].size, len(F))
        self._inner = np.eye(len(F)) + self._columns.T @ self._columns

    def _solve(self, right: FloatArray) -> FloatArray:
        return np.asarray(np.linalg.solve(self._root, right))

    def white(self, columns: FloatArray) -> FloatArray:
        """Columns (S, C, n, k) with V⁻¹ = wᵀ w, (S C n, k)."""
        w = self._solve(columns).reshape(-1, columns.shape[-1])
        values, axes = np.linalg.eigh(self._inner)
        basis = self._columns @ axes / np.sqrt(np.maximum(values - 1, 1e-300))  # orthonormal where values > 1
        keep = values > 1 + 1e-12
        along = basis[:, keep].T @ w
        return np.asarray(w - basis[:, keep] @ ((1 - 1 / np.sqrt(values[keep]))[:, None] * along))

    def chi_square(self, difference: ComplexArray) -> float:
        """Of differences (S, C, R)."""
        return float(np.sum(self.white(real_parts(difference)[..., None]) ** 2))


def run_noise(trials: Trials, W: ComplexArray, G: ComplexArray, reading: Reading, run: RunErrors) -> Noise:
    """Errors of G Y, from those of the runs.

    Parameters
    ----------
    trials
        Runs with the readings Y, (R, S, C).
    W
        Coefficients (S, C, P) of all their planes.
    G
        (S, C, n, R).
    reading, run
        How they err.
    """
    Y = trials.mean
    by_size = np.einsum("rsc,ij->rscij", own_variance(Y, run.evenly), np.eye(2))
    own = np.stack([_moved(G, part) for part in (reading.covariance(trials), by_size)])
    loads = np.einsum("scp,rp->rsc", W, trials.weights)
    common, loaded = (np.moveaxis(G, -1, 0) * part[..., None] for part in (Y, loads))
    c = np.moveaxis(unbalances(W, run.level or rms(Y)), -1, 0)
    further = np.einsum("scnr,psc->rpscn", G, c).reshape(-1, *G.shape[:3])
    known = np.einsum("scnr,mrsc->mscn", G, job_columns(trials, W))
    parts = [common, 1j * common, loaded, 1j * loaded, further, 1j * further, known]
    kinds = (COMMON, COMMON, LOADS, LOADS, UNBALANCE, UNBALANCE, KNOWN)
    kind = np.repeat(kinds, [len(part) for part in parts])
    return Noise(own, np.concatenate(parts), kind)


def _moved(G: ComplexArray, covariance: FloatArray) -> FloatArray:
    """Covariance (S, C, 2n, 2n) of G Y from that of the readings Y, (R, S, C, 2, 2)."""
    S, C, n, R = G.shape
    B = stretch(G).reshape(S, C, 2 * n, R, 2)
    return np.asarray(np.einsum("scark,rsckl,scbrl->scab", B, covariance, B, optimize=True))


def _of(
    trials: Trials,
    speeds: Sequence[int],
    sensors: Sequence[int],
    planes: Sequence[str],
    weights: ComplexArray,
) -> Trials:
    """Runs at some speeds and sensors, with weights in other planes."""
    at = np.ix_(speeds, sensors)
    given = {name: getattr(trials, name) for name in ("readings", "steps", "covariance")}
    return replace(
        trials,
        speeds=trials.speeds[list(speeds)],
        sensors=tuple(trials.sensors[c] for c in sensors),
        planes=tuple(planes),
        weights=weights,
        **{name: array[..., *at] for name, array in given.items() if array is not None},
    )


def local_runs(influence: Influence, trials: Trials) -> Trials:
    """Runs at the speeds, sensors and planes of coefficients.

    Raises
    ------
    ValueError
        For sensors or speeds that they lack, and a weight in another plane.
    """
    speeds, sensors = places(influence, trials)
    return _of(trials, speeds, sensors, influence.planes, mounted_weights(influence, trials))


def match_speeds(wanted: ArrayLike, known: FloatArray, what: str = "coefficients") -> list[int]:
    """Indices of known speeds (rad/s) equal to the wanted ones within 0.5 %.

    Raises
    ------
    ValueError
        For a speed that is not among the known ones.
    """
    out = []
    for speed in np.atleast_1d(np.asarray(wanted, dtype=np.float64)):
        i = int(np.argmin(np.abs(known - speed)))
        if not abs(known[i] - speed) <= SPEED_TOLERANCE * known[i]:
            rpm = ", ".join(f"{v * RPM:.6g}" for v in known)
            raise ValueError(f"there are no {what} at {rpm_text(speed)}; there are some at {rpm} rpm")
        out.append(i)
    if len(set(out)) < len(out):
        raise ValueError("a speed is given twice")
    return out


def places(influence: Influence, trials: Trials) -> tuple[list[int], list[int]]:
    """Where the speeds and sensors of the coefficients stand among the readings."""
    lacking = [s for s in influence.sensors if s not in trials.sensors]
    if lacking:
        raise ValueError(
            f"the baseline run has no readings of sensor {', '.join(map(repr, lacking))}; it has those of "
            f"{', '.join(map(repr, trials.sensors))}"
        )
    speeds = match_speeds(influence.speeds, trials.speeds, "baseline readings")
    return speeds, [trials.sensors.index(s) for s in influence.sensors]


def mounted_weights(influence: Influence, trials: Trials) -> ComplexArray:
    """Weights of runs in the planes of the coefficients, (R, P)."""
    weights = np.zeros((len(trials.runs), len(influence.planes)), dtype=complex)
    for p, plane in enumerate(trials.planes):
        if plane in influence.planes:
            weights[:, influence.planes.index(plane)] = trials.weights[:, p]
        elif trials.weights[:, p].any():
            raise ValueError(
                f"a weight is mounted in plane {plane!r}, for which there are no influence coefficients; "
                f"there are some for {', '.join(map(repr, influence.planes))}"
            )
    return weights


def estimate_influence(trials: Trials) -> Influence:
    """Influence coefficients, and the readings of the bare rotor, from trial runs.

    Parameters
    ----------
    trials
        R ≥ P + 1 runs whose weights determine the baseline and every plane.

    Returns
    -------
    Influence
        With its errors, by the rules of `balancing.errors`.

    Raises
    ------
    UndeterminedError
        Where the runs do not separate baseline and planes, and for a trial weight without effect (no reading
        changes, or none by more than its errors explain at 95 %); says which run to add or repeat.

    Notes
    -----
    Runs over-determine the coefficients where R > P + 1. Rows are then weighted by the variance of their
    readings where it is known, else alike.
    """
    R, P = trials.weights.shape
    if P == 0:
        raise UndeterminedError(
            "there are no planes: no run has a trial weight, so the effect of none is determined; "
            "add runs with trial weights, or use stored influence coefficients"
        )
    check_runs(trials.runs, trials.planes, trials.weights)
    reading = reading_of(trials)
    if reading.source == "assumed" and R > P + 1:  # the runs themselves tell all errors in one
        reading = reading._replace(source="residuals")
    A = np.column_stack((np.ones(R), trials.weights)).astype(complex)
    Y = np.moveaxis(trials.mean, 0, -1)  # (S, C, R)
    covariance = reading.covariance(trials)
    variance = mean_variance(covariance)
    theta = np.einsum("scnr,scr->scn", _gain(A, variance), Y)
    run = run_errors(trials, theta, covariance, reading)
    own, common, loads, further = run.typical**2
    c = unbalances(theta[..., 1:], run.level)
    between = own * own_variance(trials.mean, run.evenly) + common * np.abs(trials.mean) ** 2
    between = between + further * np.sum(np.abs(c) ** 2, axis=-1)
    between = between + loads * np.abs(trials.mean - theta[..., 0]) ** 2
    G = _gain(A, variance + between)
    theta = np.einsum("scnr,scr->scn", G, Y)
    # a rotor at rest is at rest: what is left of its readings is rounding
    theta[..., 0][np.abs(theta[..., 0]) < ROUNDING * np.abs(Y).max(axis=-1)] = 0.0
    mounted = Mounted(trials.runs[-1], trials.planes, trials.weights[-1])
    errors = Errors(run_noise(trials, theta[..., 1:], G, reading, run), reading, run, mounted, trials)
    disagree = contradiction(trials, A, run)
    influence = Influence(
        speeds=trials.speeds,
        sensors=trials.sensors,
        planes=trials.planes,
        W=theta[..., 1:],
        baseline=theta[..., 0],
        errors=errors,
        labels=trials.labels,
        remarks=Remarks(trials.warnings + reading.warnings + disagree, unseen(trials, run), disagree),
    )
    check_effects(trials, influence.W, influence.known_channels(), disagree)
    return influence


def _gain(A: ComplexArray, variance: FloatArray) -> ComplexArray:
    """(Y₀, W₁, …) = G Y, (S, C, P + 1, R), rows weighted by variances (R, S, C)."""
    R, n = A.shape
    variance = np.moveaxis(variance, 0, -1)
    largest = variance.max(axis=-1, keepdims=True)
    if n == R or not largest.any():
        return np.broadcast_to(gain(A), (*variance.shape[:-1], n, R))
    # a reading near zero would otherwise count infinitely much
    variance = np.where(largest > 0, np.maximum(variance, 1e-4 * largest), 1.0)
    root = 1 / np.sqrt(variance)
    return np.asarray(gain(root[..., None] * A) * root[..., None, :])


def change_of_run(influence: Influence, run: Trials) -> Influence:
    """The coefficients with what a run differs from the bare rotor by as the vibration to correct.

    Its correction is minus what was mounted in the run.

    Parameters
    ----------
    influence
        With a baseline.
    run
        One run of the same speeds, sensors and planes.
    """
    S, C, P = influence.W.shape
    flip = np.diag([-1.0, *np.ones(P)]).astype(complex)
    first = np.zeros((S, C, P + 1, 1), dtype=complex)
    first[..., 0, 0] = 1.0
    new = run_noise(run, influence.W, first, influence.reading, influence.run_errors)
    noise = influence.errors.noise.changed(flip).plus(new)
    errors = replace(influence.errors, noise=noise)
    return replace(influence, baseline=run.mean[0] - influence.baseline, errors=errors)


class WhiteRows(NamedTuple):
    """How rows of readings are divided by their errors.

    `white` makes vectors (S, 2 X C, j) independent and of variance 1, flat; `variance` (S, 2 X C) is that of
    each by itself; `stated` says whether none of the errors are assumed.
    """

    white: Callable[[FloatArray], FloatArray]
    variance: FloatArray
    stated: bool


def white_rows(trials: Trials, W: ComplexArray, take: FloatArray, least: float = 0.0) -> WhiteRows:
    """Joint errors, of readings and between runs, of rows that combine the runs' mean readings.

    Parameters
    ----------
    trials
        R runs at S speeds by C sensors.
    W
        Coefficients of their planes, shape (S, C, P), of about the right size.
    take
        Rows (X, R) as combinations of runs, real.
    least
        Error of a reading, in its unit, that is added in either direction.
    """
    reading, run = reading_of(trials), usual_run_errors(trials)
    (S, C), X = W.shape[:2], len(take)
    G = np.broadcast_to(take.astype(complex), (S, C, *take.shape))
    noise = run_noise(trials, W, G, reading, run)
    more = np.kron(take @ take.T, np.eye(2)) * least**2
    noise = noise._replace(own=noise.own + np.stack((more, 0 * more))[:, None, None])
    sizes = np.array([1.0, *run.typical, 1.0])
    whitening = Whitening(noise, sizes)

    def white(vectors: FloatArray) -> FloatArray:
        parts = vectors.reshape(S, X, C, 2, -1).swapaxes(1, 2)
        return whitening.white(parts.reshape(S, C, 2 * X, -1))

    alone = np.einsum("scii->sci", np.tensordot(sizes[:2] ** 2, noise.own, axes=1))
    variance = alone.reshape(S, C, X, 2).swapaxes(1, 2).reshape(S, -1)
    return WhiteRows(white, variance, "assumed" not in (reading.source, run.origin))
