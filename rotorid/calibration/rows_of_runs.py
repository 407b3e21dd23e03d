"""Readings of runs as rows of a calibration: what a rotor with other numbers would have read.

A run reads Y = Y₀ + W(θ) T with the weights T that were mounted. The bare rotor's Y₀ is either free at every
speed and sensor, so that only differences between runs count, or it is what unknown unbalances u at given
nodes and amplitudes of a bow do, Y₀ = W_u(θ) u with the same u in all runs and at all speeds: u is
eliminated for each θ (variable projection, Kaufman's Jacobian P ∂r of the projected residual P r, whose
gradient is exact). Rows are divided by the root of the joint covariance of reading and run errors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag

from balancing import RunErrors, Trials, reading_of, real_parts, usual_run_errors
from balancing.error_draws import Noise, Whitening, kind_sizes, run_noise
from fem import (
    MatrixChange,
    Rotor,
    Sensor,
    finite_modes,
    is_reading,
    lowest_modes,
    matrix_change,
    one_plane,
    receptance_with_derivatives,
    unit_loads,
)
from fem.assembly import assemble, multiply, supported
from fem.parameters import as_change, typical_size, with_changes, with_parameters
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.text import counted
from rotorid.calibration.unknowns import as_they_stand
from rotorid.regression import covariance_root, least_squares, solution

STEP = 1e-4
"""Of a number's typical size, for differences of matrices."""
UNSEEN = 1e-9
"""Relative change of the largest coefficient: a number whose whole size makes less is not seen."""
NO_ERROR = 1e-9
"""Of the largest reading: the least error, for data that state none."""


@dataclass(frozen=True, eq=False)
class RunReadings:
    """Runs of one machine in one state, and where its planes and sensors are in the model.

    Attributes
    ----------
    trials
        Readings (SI, phase lead) and mounted weights.
    nodes, radii
        Node of each plane of the trials and what its weights are multiplied by to be kg·m, (P,).
    sensors
        Of each sensor of the trials.
    derivative
        0: they read displacements, 1: velocities, 2: accelerations.
    key_phasor
        Direction of the key phasor, degrees from x with the rotation.
    unbalance, bow
        Nodes of the bare rotor's unknown unbalances, and number of its bow's shapes, modes of the free shaft;
        none: the bare rotor's readings are free.
    """

    trials: Trials
    nodes: tuple[int, ...]
    radii: FloatArray
    sensors: tuple[Sensor, ...]
    derivative: int = 0
    key_phasor: float = 0.0
    unbalance: tuple[int, ...] = ()
    bow: int = 0

    @property
    def modelled(self) -> bool:
        """Whether the bare rotor's readings are those of unknown unbalances."""
        return bool(self.unbalance or self.bow)

    def coefficients(
        self, start: Rotor, values: Mapping[str, float], derivatives: Sequence[str] = ()
    ) -> tuple[ComplexArray, ComplexArray]:
        """What weights in the planes, unbalances and bows do: (S, C, P + q), and its derivatives.

        Parameters
        ----------
        start
            The rotor whose numbers are changed.
        values
            All numbers, by path.
        derivatives
            n of these paths; the second array has the shape (n, S, C, P + q).
        """
        rotor, speeds = with_parameters(start, values), self.trials.speeds
        A = assemble(rotor)
        names = [f"probe[{sensor}].angle" for sensor in self.trials.sensors]
        turned = np.array([values.get(name, 0.0) for name in names])
        angles = np.radians([sensor.angle for sensor in self.sensors] + turned)
        rows = np.array([A.deflection(rotor.node(sensor.node)) for sensor in self.sensors], dtype=np.intp)
        at = np.array([A.deflection(node) for node in (*self.nodes, *self.unbalance)], dtype=np.intp)
        loads = [unit_loads(A, at)]
        if self.bow:
            loads.append(self._bow_loads(start, rotor))

        on_pedestals = any(support.pedestal for support in start.supports)

        def change(path: str) -> MatrixChange:
            # a coefficient acts the same at all values, unless a pedestal gives way
            constant = as_change(start, path).endswith("offset") and not on_pedestals
            at, key = start if constant else rotor, (path, speeds.tobytes())
            kept: dict[Any, MatrixChange] = vars(at).setdefault("_changes", {})  # with the rotor
            if key not in kept:
                step = STEP * sizes[path]
                kept[key] = matrix_change(lambda by: with_changes(at, {path: by}), step, speeds)
            return kept[key]

        of_rotor = [path for path in derivatives if not is_reading(path)]
        # also of a number near 0
        sizes = {path: max(typical_size(start, path), abs(values[path])) for path in of_rotor}
        receptance = receptance_with_derivatives(
            rotor, np.hstack(loads), rows, angles, speeds, [change(path) for path in of_rotor]
        )
        clock = np.exp(1j * np.radians(self.key_phasor + values.get("key_phasor.angle", 0.0)))
        factor = np.ones((speeds.size, loads[0].shape[1] + self.bow), dtype=complex)
        factor[:, : at.size] = (speeds**2)[:, None]
        factor[:, : len(self.nodes)] *= self.radii
        factor *= clock * ((1j * speeds) ** self.derivative)[:, None]
        gains = np.array([values.get(f"probe[{name}].gain", 1.0) for name in self.trials.sensors])
        factor = factor[:, None] * gains[:, None]  # (S, C, P + q)
        W = receptance.H * factor
        out = np.zeros((len(derivatives), *W.shape), dtype=complex)
        to = as_they_stand(start, {path: values[path] for path in of_rotor})
        for path, by in zip(of_rotor, receptance.by_number, strict=True):
            # what rounding leaves of a number that does nothing
            by *= np.abs(by).max() * sizes[path] > UNSEEN * np.abs(receptance.H).max()
        by_number = np.tensordot(to.T, receptance.by_number, 1)
        for k, path in enumerate(derivatives):
            if path in of_rotor:
                out[k] = by_number[of_rotor.index(path)] * factor
            elif path == "key_phasor.angle":
                out[k] = W * 1j * np.radians(1.0)
            elif path in names:
                c = names.index(path)
                out[k, :, c] = receptance.by_angle[:, c] * factor[:, c] * np.radians(1.0)
            else:
                c = self.trials.sensors.index(path.removeprefix("probe[").removesuffix("].gain"))
                out[k, :, c] = W[:, c] / gains[c]
        return W, out

    def _bow_loads(self, start: Rotor, rotor: Rotor) -> FloatArray:
        """Loads (size, bow) of shafts bent, at most by 1 m, as the lowest modes of the rotor at the start.

        On the springs of its supports; shapes that do not change with the numbers, of the shaft alone.
        """
        first, now = (
            replace(each, supports=[replace(s, tilting_stiffness=0.0) for s in each.supports])
            for each in (start, rotor)
        )
        A, at = assemble(first), supported(first, self.trials.speeds)
        pencil = one_plane(first, A, 0, at.springs.items())
        still = pencil.rigid.shape[1]
        if self.bow > (most := finite_modes(pencil) - still):
            raise ValueError(f"the shaft has {counted(most, 'shape')} of a bow, not {self.bow}")
        shapes = lowest_modes(pencil, self.bow + still).vectors[:, still:]
        bent: FloatArray = shapes / np.abs(shapes[A.deflections]).max(axis=0)
        return multiply(assemble(now).shaft, bent)

    def rows(self, W: ComplexArray) -> ReadingRows:
        """The rows with their errors, which coefficients W (S, C, P + q) of about this size tell."""
        R, trials = len(self.trials.runs), self.trials
        take = np.eye(R) if self.modelled else np.column_stack((-np.ones(R - 1), np.eye(R - 1)))
        reading, run = reading_of(trials), usual_run_errors(trials)
        noise = run_noise(trials, W[..., : len(self.nodes)], take.astype(complex), reading, run)
        least = NO_ERROR * float(np.abs(trials.mean).max())
        noise.blocks[0] += np.kron(take @ take.T, np.eye(2)) * least**2
        stated = "assumed" not in (reading.source, run.origin)
        return ReadingRows(self, take, noise, Whitening(noise, kind_sizes(run)), stated)


class _AnyShare(RunErrors):
    """Run errors of which the last size, drawn as the others, has no part in weights of least squares."""

    @property
    def typical(self) -> FloatArray:
        """As without it."""
        return RunErrors(self.sizes[:-1], self.probability[:-1], self.origin).typical


def run_errors(trials: Trials) -> RunErrors:
    """What changes from run to run where a model stands in place of coefficients.

    Parameters
    ----------
    trials
        The runs, whose statement counts.

    Returns
    -------
    RunErrors
        Stated or assumed. No spare run tells how much of stated ones a run has in common: it may be nothing.
    """
    run = usual_run_errors(trials)
    if run.origin != "stated":
        return run
    sizes = np.vstack((run.sizes, np.linalg.norm(run.sizes[0]) * np.eye(4)[:1]))
    return _AnyShare(sizes, np.full(len(sizes), 1 / len(sizes)), run.origin, run.level, run.evenly)


def _beside(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """What a basis (m, 2q) leaves of columns (m, k)."""
    return columns - basis @ solution(basis, columns) if basis.size else columns


class Bare(NamedTuple):
    """Unbalances and bows u (q,) of a bare rotor, NaN where not determined, and what their errors come from.

    Covariance (2q, 2q) of their parts by errors of the readings, derivatives (2q, n) by the numbers, and how
    many parts are determined.
    """

    u: ComplexArray
    covariance: FloatArray
    by: FloatArray
    rank: int

    def std(self, covariance: FloatArray, times: float) -> FloatArray:
        """One standard deviation in each direction (q,), with the covariance of the numbers (n, n)."""
        parts = np.diag(times * self.covariance + self.by @ covariance @ self.by.T).reshape(-1, 2)
        return np.asarray(np.where(np.isnan(self.u), np.nan, np.sqrt(parts.mean(axis=1))))


@dataclass(frozen=True, eq=False)
class ReadingRows:
    """Residuals of `RunReadings` in standard deviations.

    Attributes
    ----------
    data
        What they are of.
    take
        How rows are made of the runs: these themselves, or differences from the first, (x, R).
    noise
        Errors of readings, and between runs, of the rows.
    whitening
        Divides them by the root of their joint covariance, with usual shares of errors between runs.
    stated
        Whether the errors are stated or measured, not assumed.
    """

    data: RunReadings
    take: FloatArray
    noise: Noise
    whitening: Whitening
    stated: bool

    @property
    def variance(self) -> FloatArray:
        """Of single rows by errors that no other row shares, (S, x, C), in each direction."""
        alone = np.einsum("scii->sci", self.whitening.blocks)
        return np.asarray(alone.reshape(*alone.shape[:2], -1, 2).mean(axis=3).swapaxes(1, 2))

    def spreads(self, W: ComplexArray) -> list[FloatArray]:
        """Roots (m, k) of covariances of the residuals, one for each share that runs may have in common.

        Of stated errors also one by which readings have as much in common at each speed alone.
        """
        run, basis, spreads = run_errors(self.data.trials), self.residual(W)[1], []
        for k in range(len(run.sizes) + (run.origin == "stated")):
            separate, columns = self.noise.at(np.array([1.0, *run.sizes[k % len(run.sizes)], 1.0]))
            S, C, n, _ = separate.shape
            alone = block_diag(
                *covariance_root(separate, np.einsum("...ii->...i", separate)).reshape(-1, n, n)
            )
            shared = np.moveaxis(real_parts(columns), 0, -1)
            if k == len(run.sizes):
                shared = block_diag(*shared.reshape(S, C * n, -1)).reshape(S, C, n, -1)
            E = self.whitening.white(np.concatenate((alone.reshape(S, C, n, -1), shared), axis=-1))
            spreads.append(_beside(basis, E))
        return spreads

    def raw(self, W: ComplexArray) -> ComplexArray:
        """What weights do less what was read, (S, x, C)."""
        trials, P = self.data.trials, len(self.data.nodes)
        left = np.einsum("scp,rp->rsc", W[..., :P], trials.weights) - trials.mean
        return np.asarray(np.einsum("xr,rsc->sxc", self.take, left))

    def effect(self, W: ComplexArray) -> ComplexArray:
        """What weights do by W or changes of W (…, S, C, P), (…, S, x, C)."""
        P, take = len(self.data.nodes), self.take @ self.data.trials.weights
        return np.asarray(np.einsum("...scp,xp->...sxc", W[..., :P], take))

    def residual(self, W: ComplexArray) -> tuple[FloatArray, FloatArray, ComplexArray]:
        """Residuals (m,), the basis (m, 2q) that was projected out of them, and the unknowns u (q,)."""
        return self._project(W, self._white(self.raw(W)[..., None])[:, 0])

    def jacobian(self, W: ComplexArray, dW: ComplexArray) -> FloatArray:
        """Derivatives (m, n) of the residuals by n numbers, dW (n, S, C, P + q)."""
        _, basis, u = self.residual(W)
        return _beside(basis, self._changes(dW, u))

    def bare(self, W: ComplexArray, dW: ComplexArray) -> Bare:
        """What the rows say of the bare rotor besides."""
        _, basis, u = self.residual(W)
        if not u.size:
            return Bare(u, np.zeros((0, 0)), np.zeros((0, len(dW))), 0)
        alone = least_squares(basis, np.zeros(len(basis)), sigma=1.0)
        u = np.where(np.isnan(alone.values[::2] + alone.values[1::2]), np.nan, u)
        assert alone.solution_covariance is not None
        return Bare(u, alone.solution_covariance, solution(basis, self._changes(dW, u)), alone.rank)

    def _changes(self, dW: ComplexArray, u: ComplexArray) -> FloatArray:
        """Derivatives (m, n) of what the rows say, with what dW makes of the unknowns u."""
        bare = np.einsum("nscq,q->nsc", dW[..., len(self.data.nodes) :], u)
        change = self.effect(dW) + bare[:, :, None, :] * self.take.sum(axis=1)[:, None]
        return self._white(np.moveaxis(change, 0, -1))

    def _project(self, W: ComplexArray, r: FloatArray) -> tuple[FloatArray, FloatArray, ComplexArray]:
        if not self.data.modelled:
            return r, np.zeros((r.size, 0)), np.zeros(0, dtype=complex)
        each = W[..., len(self.data.nodes) :]  # (S, C, q), the same in all rows of runs
        both = np.repeat(each[:, None], len(self.take), axis=1)
        basis = self._white(np.stack((both, 1j * both), axis=-1).reshape(*both.shape[:3], -1))
        u = solution(basis, -r)
        return r + basis @ u, basis, u[::2] + 1j * u[1::2]

    def _white(self, columns: ComplexArray) -> FloatArray:
        """Complex columns (S, x, C, j) as whitened real ones, (m, j)."""
        S, x, C, j = columns.shape
        real = np.stack((columns.real, columns.imag), axis=2).reshape(S, 2 * x, C, j)
        return self.whitening.white(real.swapaxes(1, 2))
