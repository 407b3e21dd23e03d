"""Errors of a reading and of a run: stated, from repeated and spare runs, or assumed; one standard deviation.

A reading. Y errs by `amplitude`·|Y| along itself, `phase`·|Y| across, and `floor` in both directions.

1. Stated errors hold, unless repeated readings scatter more than they explain (χ², 99 %): then all are
   multiplied by the ratio. An amplitude or phase error that is not stated is that of the repeats. Deviations
   that an instrument measured (`Trials.covariance`) count as stated ones and add to them.
2. Without them repeated readings give the errors. An estimate with ν degrees of freedom is drawn, too:
   variances are those of the repeats times ν/χ²(ν).
3. Without repeats spare runs give them, together with what each sensor has of its own from run to run.
4. Otherwise 2 % and 2° are assumed.

The mean of n readings has 1/n of the variance; the digits in which readings are written do not average out.

A run. Whatever was mounted, temperature and what is not linear change a whole run, however often it is read,

    e = s₁ |Y| z + (s₂ Y + s₃ W T) z' + s₄ Σ cₚ uₚ,

with z for each reading, z' for the run (another one for W T) and u for each plane: complex normal, variance
1 in either direction. T is what is mounted; c are the columns of W, of equal effect, all together as large
as the readings (root mean square). What is common goes with the readings where the machine changes, and
with what weights do of them where these are not mounted, or do not act, alike: on a real rig most of it
does.

Their sizes s follow from what spare runs leave, free of all coefficients (restricted likelihood; Patterson
and Thompson 1971), log L = −log det V − eᴴ V⁻¹ e, on a grid of the own size, the size in common and its
split. The corrected reading, free of the weights, tells of s₁ alone: what is common leaves other weights
there. V is that of the fitted readings; with those that were read, what a run errs by would explain itself.
The grid keeps what data leave open; every draw draws its sizes first. At most `MOST` readings of a run take
part: they tell three sizes as well. |Y| in the own part is between that of the reading and the root mean
square of all sensors at its speed, whichever fits best (`EVENLY`): on a real rig small readings err as much
as large ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from balancing.conditioning import chance
from balancing.regions import real_parts
from balancing.trials import TURNED, ReadingErrors, Trials
from rotorid.base.arrays import ComplexArray, FloatArray, turned
from rotorid.base.text import percent
from rotorid.regression import gain

Source = Literal[
    "stated", "repeats", "stated, enlarged by repeats", "measured", "residuals", "assumed", "unknown"
]
Origin = Literal["stated", "estimated", "assumed", "none"]
ASSUMED = ReadingErrors(amplitude=0.02, phase=float(np.deg2rad(2.0)))
"""Of a reading, where nothing says more."""
ASSUMED_RUN = 0.02
"""Of each of the three parts, where nothing says more."""
CONTRADICTION = 0.99
"""Level of the tests by which repeated readings and spare runs overrule stated errors."""
ROUNDING = 1e-12
"""Relative differences below this are rounding of the arithmetic, not errors of readings."""
SIZES = np.concatenate(([0.0], np.geomspace(1e-3, 0.5, 6)))
"""Of each sensor's own, and of what readings have in common, before they are known roughly."""
SPLITS = np.array([(1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0), (0.5, 0, 0.5), (0, 0.5, 0.5)])
"""Of what readings have in common, in the variance: of the reading, of what weights do, further unbalance."""
OWN_SHARES = np.array([0.0, 0.1, 0.4, 1.0])
"""Of stated errors, in the variance; only spare runs show that nothing is common."""
EVENLY = (0.0, 0.5, 1.0)
"""How much of the own part is alike at all sensors."""
NOTICEABLE = 0.1
"""Relative errors between runs that deserve a question."""
MOST = 64
"""Readings of a run by which sizes are estimated."""


class Reading(NamedTuple):
    """Errors of a single reading.

    Attributes
    ----------
    errors
        None: unknown, or zero. Where they are measured, their root mean square: each reading has its own.
    source
        Where they come from, in words.
    warnings
        Sentences.
    dof
        Degrees of freedom of an estimate, infinite for errors that are taken as they are.
    """

    errors: ReadingErrors | None = None
    source: Source = "unknown"
    warnings: tuple[str, ...] = ()
    dof: float = np.inf

    def scales(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Drawn factors by which the errors may be larger than estimated, (count,)."""
        draws = rng.chisquare(min(self.dof, 1e9), count)
        return np.sqrt(self.dof / draws) if np.isfinite(self.dof) else np.ones(count)

    def covariance(self, trials: Trials, *, digits: bool = True) -> FloatArray:
        """Covariance of real and imaginary part of the means of repeated readings, (R, S, C, 2, 2)."""
        mean, count = trials.mean, trials.repeats[..., None, None]
        out = np.zeros((*mean.shape, 2, 2))
        if self.errors is not None and self.source not in ("measured", "residuals"):
            out = reading_covariance(mean, self.errors) / count
        if trials.covariance is not None:
            out = out + np.moveaxis(np.nansum(trials.covariance, axis=2), (0, 1), (-2, -1)) / count**2
        if trials.steps is not None and digits:
            amplitude, phase = np.nanmean(trials.steps, axis=1) / np.sqrt(12.0)
            out = out + turned(mean, amplitude**2, (phase * np.abs(mean)) ** 2)
        return out


def reading_covariance(readings: ArrayLike, errors: ReadingErrors) -> FloatArray:
    """Covariance (…, 2, 2) of real and imaginary part of single complex readings (…)."""
    z = np.asarray(readings, dtype=complex)
    size, floor = np.abs(z), errors.floor**2
    return turned(z, (errors.amplitude * size) ** 2 + floor, (errors.phase * size) ** 2 + floor)


def mean_variance(covariance: FloatArray) -> FloatArray:
    """Mean variance of both directions, (…), of covariances (…, 2, 2)."""
    return np.asarray(np.trace(covariance, axis1=-2, axis2=-1) / 2)


def reading_of(trials: Trials) -> Reading:
    """Errors of a reading of these runs: stated, measured, from repeats, or assumed.

    Parameters
    ----------
    trials
        The runs.

    Raises
    ------
    ValueError
        For readings without phases.
    """
    stated, scatter = trials.with_phases().errors, _scatter(trials)
    ratio, dof = _against_repeats(trials)
    scattered, enlarged = f"repeated readings scatter {ratio:.2g} times as much as the ", ratio > 1.0
    if stated is None:
        estimate = _from_repeats(*scatter)
        if trials.covariance is None:
            return estimate
        if not enlarged:
            variance = np.nanmean(trials.covariance[[0, 1], [0, 1]])
            return Reading(ReadingErrors(floor=float(np.sqrt(variance))), "measured")
        words = f"{scattered}measured standard deviations: their scatter was added"
        return estimate._replace(warnings=(words, *estimate.warnings))
    sizes = {"amplitude": stated.amplitude * ratio, "phase": stated.phase * ratio}
    warnings = (f"{scattered}stated errors: the errors were enlarged accordingly",) if enlarged else ()
    degrees = dof if enlarged else np.inf
    if stated.floor == 0:
        # an error that was left out is not zero if the repeats show it
        for kind, size in zip(sizes, scatter, strict=False):
            if not sizes[kind] and size > ROUNDING:
                sizes[kind], degrees = size, min(scatter[2], degrees)
    source: Source = "stated" if degrees == np.inf else "stated, enlarged by repeats"
    return Reading(ReadingErrors(**sizes, floor=stated.floor * ratio), source, warnings, degrees)


def _from_repeats(radial: float, tangential: float, dof: int) -> Reading:
    if max(radial, tangential) < ROUNDING:
        words = "all repeated readings are equal to the last digit: they say nothing about the errors"
        return Reading(ASSUMED, "assumed", (words,) if dof else ())
    if min(radial, tangential) < ROUNDING:  # read in whole degrees, say
        radial = tangential = max(radial, tangential)
    return Reading(ReadingErrors(radial, tangential), "repeats", (), dof)


def _scatter(trials: Trials) -> tuple[float, float, int]:
    """Pooled relative radial and tangential standard deviation and their degrees of freedom."""
    mean, count = trials.mean, trials.repeats
    used = (count > 1) & (mean != 0)
    dof = int(np.sum(count[used] - 1))
    relative = trials.readings[:, used] / mean[used] - 1
    squares = (np.nansum(part**2) for part in (relative.real, relative.imag))
    radial, tangential = (float(np.sqrt(square / max(dof, 1))) for square in squares)
    return radial, tangential, dof


def _against_repeats(trials: Trials) -> tuple[float, int]:
    """How many times more repeats scatter than stated and measured errors explain; degrees of freedom."""
    many = trials.repeats > 1
    count = trials.repeats[many]
    of_means = Reading(trials.errors, "stated").covariance(trials, digits=False)[many]
    V = of_means * count[:, None, None]
    inverse = np.linalg.pinv(V, 1e-9, hermitian=True)  # what has no error is not compared
    parts = real_parts(np.nan_to_num(trials.readings[:, many] - trials.mean[many])[..., None])
    chi_square = float(np.einsum("kgi,gij,kgj->", parts, inverse, parts))
    dof = round(np.einsum("g,gij,gji->", count - 1, inverse, V))
    contradicted = dof > 0 and chance(chi_square, dof) < 1 - CONTRADICTION
    return (float(np.sqrt(chi_square / dof)) if contradicted else 1.0), dof


@dataclass(frozen=True, eq=False)
class RunErrors:
    """What changes from run to run: points of a grid, and how likely each is.

    Attributes
    ----------
    sizes
        Of each sensor's own; common to the run, of the readings and of what mounted weights do of them; by
        further unbalance: relative to the readings, (G, 4).
    probability
        (G,), sum 1.
    origin
        Where they come from.
    level
        Root mean square reading that the size of further unbalance refers to, SI; 0: that of the runs.
    evenly
        How much of each sensor's own part is alike at all sensors at a speed, 0 … 1; the rest is in
        proportion to each reading.
    """

    sizes: FloatArray
    probability: FloatArray
    origin: Origin
    level: float = 0.0
    evenly: float = 0.5

    def draw(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Sizes of so many draws, (count, 4)."""
        return self.sizes[rng.choice(len(self.sizes), count, p=self.probability)]

    @property
    def typical(self) -> FloatArray:
        """One set of sizes (4,): variances averaged by their precision, so that large ones do not decide."""
        total = np.sum(self.sizes**2, axis=1)
        if not total.all():
            return np.sqrt(self.probability @ self.sizes**2)
        precision = self.probability / total
        return np.asarray(np.sqrt(precision @ self.sizes**2 / precision.sum()))


NO_RUN_ERRORS = RunErrors(np.zeros((1, 4)), np.ones(1), "none")


def rms(values: ArrayLike) -> float:
    """Root mean square of real or complex numbers."""
    return float(np.sqrt(np.mean(np.abs(values) ** 2)))


def unbalances(W: ComplexArray, size: float) -> ComplexArray:
    """Readings by one unbalance in each plane, of equal effect, together of mean square size², (S, C, P)."""
    mean = np.sqrt(np.mean(np.abs(W) ** 2, axis=(0, 1)) * W.shape[-1])
    return W * (size / np.where(mean > 0, mean, np.inf))


def own_variance(readings: ComplexArray, evenly: float) -> FloatArray:
    """Variance of readings (R, S, C) by their own part of size 1; `evenly` of it alike at all sensors."""
    square = np.abs(readings) ** 2
    return np.asarray(evenly * square.mean(axis=-1, keepdims=True) + (1 - evenly) * square)


def job_columns(trials: Trials, W: ComplexArray) -> ComplexArray:
    """Errors of the runs by placement and drift, (M, R, S, C), each times a real number of variance 1.

    A weight that stays in its plane from one run to the next has one error in both.
    """
    out = []
    for p, weights in enumerate(trials.weights.T):
        stays = np.cumsum(weights != np.append(0, weights[:-1]))
        for k in np.unique(stays[weights != 0]) if trials.planes[p] != TURNED else ():
            effect = np.where(stays == k, weights, 0)[:, None, None] * W[..., p]
            out += [size * effect for size in (trials.placement.mass, 1j * trials.placement.angle) if size]
    if trials.drift:
        course = trials.drift * np.linspace(0.0, 1.0, len(trials.runs))[:, None, None] * trials.mean
        out += [course, 1j * course]
    return np.array(out).reshape(len(out), *trials.mean.shape)


class Block(NamedTuple):
    """A combination of runs that holds no coefficient: residuals (n,), and variances of either direction.

    `spare`: of spare runs, or of the corrected reading;
    `parts` (5, n, n): by the parts at size 1, the first alike at all sensors and in proportion;
    `fixed` (n, n): by errors whose sizes are known.
    """

    spare: bool
    e: ComplexArray
    parts: ComplexArray
    fixed: ComplexArray

    def at(self, sizes: FloatArray, evenly: float) -> tuple[FloatArray, FloatArray]:
        """Log det V and eᴴ V⁻¹ e / 2 at sizes (G, 4)."""
        alone, *common = sizes.T**2
        squares = np.array([evenly * alone, (1 - evenly) * alone, *common])
        V = np.tensordot(squares.T, self.parts, axes=1) + self.fixed
        n = len(self.e)
        least = 1e-9 * np.trace(V, axis1=1, axis2=2).real + 1e-12 * np.trace(self.parts[0]).real
        V += (least / n)[:, None, None] * np.eye(n)
        L = np.linalg.cholesky(V)
        white = np.linalg.solve(L, np.broadcast_to(self.e[:, None], (len(V), n, 1)))
        log = 2 * np.log(np.einsum("gii->gi", L).real).sum(axis=1)
        return log, np.sum(np.abs(white) ** 2, axis=(1, 2)) / 2


def blocks(trials: Trials, theta: ComplexArray, covariance: FloatArray) -> list[Block]:
    """What runs tell of their errors: those of spare runs, and that of the corrected reading at the end.

    Parameters
    ----------
    trials
        R runs.
    theta
        (Y₀, W₁, …), (S, C, P + 1).
    covariance
        Of the readings, by their errors alone, (R, S, C, 2, 2).
    """
    A = np.column_stack((np.ones(len(trials.runs)), trials.weights)).astype(complex)
    n, N = A.shape[1], theta[..., 0].size
    at = np.linspace(0, N - 1, min(N, MOST)).round().astype(np.int64)
    s, c = np.unravel_index(at, theta.shape[:2])

    W, further = theta[s, c, 1:], unbalances(theta[..., 1:], rms(trials.mean))[s, c].T
    others = job_columns(trials, theta[..., 1:])[..., s, c]
    # as the coefficients say: what each run errs by would explain itself
    whole = np.einsum("rp,scp->rsc", A, theta)
    each = (trials.mean, whole, whole - theta[..., 0])
    variances = (own_variance(whole, 1.0), own_variance(whole, 0.0), mean_variance(covariance))
    Y, fitted, effect, even, uneven, variance = (part[:, s, c] for part in (*each, *variances))

    def alike(rows: ComplexArray) -> ComplexArray:
        return rows.T @ rows.conj()

    def block(m: ComplexArray, free: ComplexArray) -> Block:
        share = np.abs(m) ** 2
        moved, loads = (alike(m[:, None] * part) for part in (fitted, effect))
        own, unbalance = (np.diag(share @ part) for part in (even, uneven)), share.sum() * alike(further)
        fixed = np.diag(share @ variance) + alike(np.einsum("r,mrn->mn", m, others)) / 2
        keep = np.linalg.qr(free, mode="complete")[0][:, free.shape[1] :].conj().T
        inside = keep @ np.array([*own, moved, loads, unbalance, fixed]) @ keep.conj().T
        return Block(not free.size, keep @ (m @ Y), inside[:5], inside[5])

    # combinations whose errors are independent
    basis = np.linalg.svd(A)[0][:, n:]
    squares = np.abs(Y) ** 2
    size = np.mean(squares / squares.mean(axis=0).clip(1e-300), axis=1)
    basis = basis @ np.linalg.eigh(basis.conj().T @ (size[:, None] * basis))[1]
    # a rotor at rest repeats itself to the last digit
    moving = [m for m in basis.T if np.max(np.abs(m) @ np.abs(fitted)) > ROUNDING * np.abs(fitted).max()]
    out = [block(m.conj(), W[:, :0]) for m in moving]
    if len(at) >= n and theta[..., 0].any():
        flat = theta.reshape(N, n)
        m = np.concatenate(([1.0], -gain(flat[:, 1:]) @ flat[:, 0])) @ gain(A)
        row = block(m, W)
        # what is common to a run leaves other weights, not a rest
        out.append(row._replace(parts=row.parts * np.array([1, 1, 0, 0, 0])[:, None, None]))
    return out


def run_errors(
    trials: Trials, theta: ComplexArray | None, covariance: FloatArray, reading: Reading
) -> RunErrors:
    """Stated, estimated by spare runs, none beside stated errors of a reading, or assumed.

    Parameters
    ----------
    trials, theta, covariance
        As `blocks`; None: no spare run tells of them.
    reading
        Where these come from.
    """
    all_ = [] if theta is None else blocks(trials, theta, covariance)
    spare = [block for block in all_ if block.spare]
    level = rms(trials.mean)
    if trials.run_errors is not None:
        relative, floor = trials.run_errors[0] ** 2, (trials.run_errors[1] / (level or 1.0)) ** 2
        share = OWN_SHARES[: 4 if spare else 3, None]
        sizes = np.sqrt(np.hstack((share * (relative + floor), (1 - share) * (relative, 0.0, floor))))
        evenly = floor / ((relative + floor) or 1.0)
        if not spare or tail(spare, sizes, evenly) > 1 - CONTRADICTION:
            return RunErrors(sizes, _posterior(all_, sizes, evenly), "stated", level, evenly)
    if spare:
        return _estimated(all_, level)
    if reading.source == "stated":
        return NO_RUN_ERRORS
    return RunErrors(ASSUMED_RUN * np.array([[1.0, 1.0, 0.0, 1.0]]), np.ones(1), "assumed", level)


def usual_run_errors(trials: Trials) -> RunErrors:
    """Errors between runs where no spare run tells of them.

    Parameters
    ----------
    trials
        The runs, whose statement counts; none beside stated errors of a reading, else they are assumed.
    """
    return run_errors(trials, None, np.zeros(0), reading_of(trials))


def _estimated(each: Sequence[Block], level: float) -> RunErrors:
    """The grid, drawn closer around what data do not exclude; own parts as they fit best."""
    alone = common = SIZES
    seen, loaded = (sum(np.trace(block.parts[k]).real for block in each) for k in (2, 3))
    # runs without weights tell nothing of what goes with the weights
    splits = SPLITS if loaded > 0.03 * seen else SPLITS[SPLITS[:, 1] == 0]
    sizes = _grid(alone, common, splits)
    log = [-np.sum([block.at(sizes, evenly) for block in each], axis=(0, 1)) for evenly in EVENLY]
    evenly = EVENLY[int(np.argmax([np.logaddexp.reduce(values) for values in log]))]
    for _ in range(2):  # closer around what data do not exclude
        chance = _posterior(each, sizes, evenly).reshape(len(alone), len(common), -1)
        alone = _finer(alone, chance.sum(axis=(1, 2)), 5)
        common = _finer(common, chance.sum(axis=(0, 2)), 6)
        sizes = _grid(alone, common, splits)
    return RunErrors(sizes, _posterior(each, sizes, evenly), "estimated", level, evenly)


def _grid(alone: FloatArray, common: FloatArray, splits: FloatArray) -> FloatArray:
    """All combinations of sizes of one sensor alone, sizes in common and splits, (G, 4)."""
    each = np.sqrt(splits)
    return np.array([(a, *(b * split)) for a in alone for b in common for split in each])


def _finer(values: FloatArray, probability: FloatArray, count: int) -> FloatArray:
    """So many values between those that are not excluded."""
    seen = np.flatnonzero(probability > 1e-4)
    low, high = max(seen[0] - 1, 0), min(seen[-1] + 1, len(values) - 1)
    zero = int(values[low] == 0)
    return np.append(np.zeros(zero), np.geomspace(values[low + zero], values[high], count - zero))


def tail(used: Sequence[Block], sizes: FloatArray, evenly: float) -> float:
    """Probability that errors of one of these sizes leave more than was read, at the likeliest of them."""
    log, q = np.sum([block.at(sizes, evenly) for block in used], axis=0)
    likely = q[log + q < np.min(log + q) + 3.0]
    return chance(2 * likely.min(), 2 * sum(len(block.e) for block in used))


def _posterior(each: Sequence[Block], sizes: FloatArray, evenly: float) -> FloatArray:
    """Probability of every point; the corrected reading takes part unless unbalance elsewhere shows in it."""
    weight = np.zeros(len(sizes))
    for block in each:
        likely = sizes[weight > weight.max() - 3.0]
        if block.spare or (len(block.e) and tail([block], likely, evenly) > 0.05):
            weight -= np.sum(block.at(sizes, evenly), axis=0)
    probability = np.exp(weight - weight.max())
    return np.asarray(probability / probability.sum())


def contradiction(trials: Trials, A: ComplexArray, run: RunErrors) -> tuple[str, ...]:
    """Whether spare runs disagree by more than was stated, or than any rotor should."""
    R, n = A.shape
    if run.origin != "estimated":
        return ()
    Y = trials.mean.reshape(R, -1)
    levels = np.mean(np.abs(Y) ** 2, axis=1)
    left = np.mean(np.abs(Y - A @ (gain(A) @ Y)) ** 2, axis=1) / np.maximum(levels, 0.1 * levels.max())
    size = float(np.sqrt(left.sum() / 2 / (R - n)))
    if trials.run_errors is None and size < NOTICEABLE:
        return ()
    stated = "" if trials.run_errors is None else ", more than stated"
    worst = np.argmax(left)
    typed = worst == R - 1 and levels[worst] < levels[0] / 2 and not trials.weights[worst].any()
    hint = '; a check run goes into a table of its own, check = "check.csv"' if typed else ""
    return (
        f"the runs disagree by {percent(size)} % of the readings{stated}, most of all in run "
        f"{trials.runs[worst]!r}: the rotor does not repeat itself or is not linear, or a row is missing in "
        f"the weights table (of a check run: check_weights){hint}",
    )


def unseen(run: RunErrors, trials: Trials) -> tuple[str, ...]:
    """Notes about what no run measures."""
    whole = float(np.linalg.norm(run.typical))
    if run.origin == "estimated":
        notes = {
            "runs that should agree differ little: if the machine was not stopped between them, they do not "
            "show what changes from run to run (state run_percent)": whole < ASSUMED_RUN / 2,
            "trial weights are taken as exact, which these runs do not show (state placement_percent and "
            "placement_deg)": not (any(trials.placement) or trials.relative or trials.planes[-1] == TURNED),
        }
        return tuple(filter(notes.get, notes))
    taken = {
        "none": "none are stated, and the ± are smaller, those of readings alone",
        "assumed": f"{percent(ASSUMED_RUN)} % are assumed of each of three kinds, {percent(whole)} % in all",
    }.get(run.origin, "")
    words = (
        f"errors between runs (mounting, temperature, drift) are not seen here, {taken}: one more baseline "
        "run at the end, or one more trial run, would measure them; repeated readings do not"
    )
    return (words,) if taken else ()
