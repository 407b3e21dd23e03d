"""Operator models: equations linear in the amplitudes with coefficients in p = d/dt, what they predict.

Forced vibration: A(iω; θ) Z = b with the outputs on one side, so Z = A⁻¹ b and dZ/dθ = A⁻¹ (db/dθ − dA/dθ Z),
[S] (17), (18). Free vibration: A(z; θ) v = 0 with z = ω² = −p² and even powers of p only. With A′ = dA/dz

    A dv + A′ v dz = −dA/dθ v,    dv[reference] = 0

gives the derivatives of z and of the shape v, whose entry `reference` is kept at 1.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.identify.combinations import (
    CONSTANT,
    ONE,
    Combinations,
    Feature,
    Monomial,
    exact_number,
    merge,
    monomials_of,
)

POWERS_OF_I = np.array([1, 1j, -1, -1j])
MAC_SLACK = 0.02
"""Modes whose MAC is this near to the best count as equally like; the nearest frequency decides."""


@dataclass(frozen=True, eq=False)
class HarmonicModel:
    """Linear operator equations; made by `harmonic_model`: sums of terms c · Πθ^e · p^k · signal.

    Attributes
    ----------
    equations
        As written.
    parameters
        Names to be estimated, in their order.
    known
        Numbers by name.
    signals, inputs, outputs
        Names of all amplitudes, of the exciting ones and of the others.
    features
        The coefficients of p^k · signal in each equation.
    varying
        Names of known quantities that change from row to row, [S] (4): columns of the measurements.
    """

    equations: tuple[str, ...]
    parameters: tuple[str, ...]
    known: Mapping[str, float]
    signals: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    features: tuple[Feature, ...] = field(repr=False)
    varying: tuple[str, ...] = ()

    @property
    def has_constant_terms(self) -> bool:
        """Whether a term stands without a signal (amplitude 1), such as a known force."""
        return any(f.signal == CONSTANT for f in self.features)

    @cached_property
    def monomials(self) -> tuple[Monomial, ...]:
        """Products and powers of parameters, lifted into unknowns of the regression."""
        return monomials_of(self.features, self.parameters)

    @cached_property
    def combinations(self) -> Combinations:
        """What data can determine at best: the row space of the coefficients."""
        exact = {name: exact_number(value) for name, value in self.known.items()}
        return merge(self.features, self.monomials, exact)

    @cached_property
    def coefficients(self) -> FloatArray:
        """Of the features in 1 and the monomials, (features, 1 + monomials)."""
        return np.array([[float(f.exact.get(m, 0)) for m in (ONE, *self.monomials)] for f in self.features])

    @cached_property
    def of_unknowns(self) -> FloatArray:
        """Of the features in the combinations, the unknowns of regression, (features, u)."""
        return self.coefficients[:, 1:][:, self.combinations.pivots] / self.combinations.scales

    @cached_property
    def exponents(self) -> FloatArray:
        """Exponents of the parameters, (1 + monomials, parameters); row 0 is the constant 1."""
        powers = [dict(m) for m in (ONE, *self.monomials)]
        return np.array([[float(one.get(name, 0)) for name in self.parameters] for one in powers])

    @cached_property
    def equation(self) -> IntArray:
        """Of each feature (f,)."""
        return np.array([f.equation for f in self.features], dtype=np.int_)

    @cached_property
    def power(self) -> IntArray:
        """Of p in each feature (f,)."""
        return np.array([f.power for f in self.features], dtype=np.int_)

    @cached_property
    def column(self) -> IntArray:
        """Signal of each feature (f,): outputs, then inputs, at last the amplitude 1 of constant terms."""
        names = (*self.outputs, *self.inputs, CONSTANT)
        return np.array([names.index(f.signal) for f in self.features], dtype=np.int_)

    @cached_property
    def _place(self) -> FloatArray:
        """Where the features stand in the equations, (f, equations · (1 + signals))."""
        columns = 1 + len(self.signals)
        return np.asarray(np.eye(len(self.equations) * columns)[self.equation * columns + self.column])

    def multipliers(
        self, frequencies: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> ComplexArray:
        """(iω)^k and the varying quantities of each feature (n, f), for frequencies (n,)."""
        w, k, rows = np.asarray(frequencies, dtype=float), self.power, varying or {}
        if (k < 0).any() and (w == 0).any():
            raise ValueError("an equation divides by p: an experiment at the frequency 0 cannot be used")
        # exact powers of i, so that a real row has no imaginary dust
        factors = w[:, None] ** k * POWERS_OF_I[k % 4]
        for j, feature in enumerate(self.features):
            for name, exponent in feature.varying:
                if name not in rows:
                    raise ValueError(
                        f"{name} stands as a factor in the equations and is neither known nor estimated: "
                        f"the measurements must have its value in every row (a column {name})"
                    )
                if exponent < 0 and (rows[name] == 0).any():
                    raise ValueError(
                        f"an equation divides by {name}, which is 0 in a row of the measurements"
                    )
                factors[:, j] *= rows[name] ** float(exponent)
        return np.asarray(factors)

    def polynomials(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (f,) and derivatives (f, n) of the features' coefficients at parameters (n,)."""
        products, slopes = products_of_powers(self.exponents, values)
        return self.coefficients @ products, self.coefficients @ slopes

    def matrices(
        self, values: FloatArray, frequencies: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> ComplexArray:
        """Coefficients A(iω; θ) of outputs, inputs and 1, (n, equations, 1 + signals).

        Parameters
        ----------
        values
            Of the parameters.
        frequencies
            (n,), rad/s.
        varying
            Known quantities (n,) that change from row to row, by name.
        """
        terms = self.multipliers(frequencies, varying) * self.polynomials(values)[0]
        return np.asarray((terms @ self._place).reshape(len(terms), len(self.equations), -1))

    def predict(
        self,
        values: FloatArray,
        frequencies: FloatArray,
        inputs: Mapping[str, ComplexArray],
        varying: Mapping[str, FloatArray] | None = None,
    ) -> dict[str, ComplexArray]:
        """Amplitudes of the outputs at frequencies (n,) for inputs and varying quantities (n,).

        Raises
        ------
        ValueError
            If there are not as many outputs as equations.
        """
        self.check_square()
        table = np.zeros((len(frequencies), len(self.inputs)), dtype=complex)
        for j, name in enumerate(self.inputs):
            table[:, j] = inputs[name]
        amplitudes = self.forced(values, frequencies, table, varying=varying)[0]
        return dict(zip(self.outputs, amplitudes.T, strict=True))

    def forced(
        self,
        values: FloatArray,
        frequencies: FloatArray,
        inputs: ComplexArray,
        varying: Mapping[str, FloatArray] | None = None,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Amplitudes of the outputs (n, e) and their derivatives (n, e, parameters).

        Parameters
        ----------
        values
            Of the parameters.
        frequencies
            ω, shape (n,).
        inputs
            Amplitudes of the inputs, (n, inputs).
        varying
            Known quantities (n,) that change from row to row, by name.

        Raises
        ------
        numpy.linalg.LinAlgError
            At a resonance without damping.
        """
        n, e = len(frequencies), len(self.outputs)
        multipliers = self.multipliers(frequencies, varying)
        P, dP = self.polynomials(values)
        whole = (multipliers * P @ self._place).reshape(n, e, 1 + len(self.signals))
        given = np.concatenate((inputs, np.ones((n, 1))), axis=1)
        A = whole[:, :, :e]
        Z = np.asarray(np.linalg.solve(A, -(whole[:, :, e:] @ given[:, :, None]))[:, :, 0])
        load = multipliers * np.concatenate((Z, given), axis=1)[:, self.column]
        G = [load[:, self.equation == i] @ dP[self.equation == i] for i in range(e)]
        return Z, np.asarray(np.linalg.solve(A, -np.stack(G, axis=1)))

    def dynamic_stiffness(
        self, values: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Matrices A_k (k, e, e) of A = Σ A_k z^k with z = ω² = −p², and derivatives (k, e, e, n).

        Of free vibration: odd powers of p, which would need imaginary amplitudes, are left out. Varying
        quantities (1,) have the values of one row.
        """
        P, dP = self.polynomials(values)
        row = np.real(self.multipliers(np.ones(1), varying)[0] / POWERS_OF_I[self.power % 4])
        e = len(self.outputs)
        use = np.flatnonzero((self.column < e) & (self.power % 2 == 0))
        # multiplied by p^−lowest: a compliance form written with 1/p² would have no polynomial
        k = (self.power[use] - min(self.power[use], default=0)) // 2
        shape = max(k, default=0) + 1, e, e
        A, dA = np.zeros(shape), np.zeros((*shape, len(values)))
        at, sign = (k, self.equation[use], self.column[use]), (-1.0) ** k * row[use]
        np.add.at(A, at, sign * P[use])
        np.add.at(dA, at, sign[:, None] * dP[use])
        return A, dA

    def check_square(self) -> None:
        """Raise ValueError if amplitudes cannot be predicted: not as many outputs as equations."""
        if len(self.outputs) != len(self.equations):
            raise ValueError(
                f"predicting amplitudes needs as many equations as outputs; there are {len(self.equations)} "
                f"equations and {len(self.outputs)} outputs ({', '.join(self.outputs) or 'none'}): say which "
                "signals are given with inputs = [...]"
            )


def products_of_powers(exponents: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Products Π θ^e (m,) of exponents (m, n), and their derivatives (m, n) by θ."""
    theta = np.asarray(values, dtype=float)
    products = np.prod(theta**exponents, axis=1)
    slopes = products[:, None] * exponents / np.where(theta == 0, 1.0, theta)
    for j in np.flatnonzero(theta == 0):
        used = np.flatnonzero(exponents[:, j])
        lower = exponents[used] - np.eye(len(theta))[j]
        slopes[used, j] = exponents[used, j] * np.prod(theta**lower, axis=1)
    return products, slopes


def eigenvalues(A: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """All z with Σ A_k z^k singular, A (k, e, e), and vectors of the companion form, shapes above."""
    from scipy.linalg import eig

    degree, e = len(A) - 1, A.shape[1]
    # companion form L y = z R y with y = (v, z v, …)
    L, R = np.eye(degree * e, k=e), np.eye(degree * e)
    if not degree:
        return np.zeros(0, dtype=complex), np.zeros((e, 0), dtype=complex)
    L[-e:], R[-e:, -e:] = -np.hstack([*A[:-1]]), A[-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        z, vectors = eig(L, R)
    return np.asarray(z), np.asarray(vectors)


def natural_modes(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positive real z = ω² with Σ A_k z^k singular, and shapes.

    Parameters
    ----------
    A
        Shape (k, e, e).

    Returns
    -------
    z (modes,), ascending, and shapes (e, modes), each of unit length. Complex, negative and infinite
    z are left out: they belong to no free vibration.
    """
    z, y = eigenvalues(A)
    size = np.abs(z, where=np.isfinite(z), out=np.full(len(z), np.inf))
    good = np.isfinite(size) & (np.abs(z.imag) <= 1e-8 * size)
    good &= z.real > 1e-12 * size[good].max(initial=0.0)
    order = np.flatnonzero(good)[np.argsort(z[good].real)]
    v = y[: A.shape[1], order]
    v = (v / v[np.abs(v).argmax(axis=0), np.arange(v.shape[1])]).real
    return z[order].real, v / np.linalg.norm(v, axis=0)


def nearest_mode(
    z: FloatArray, v: FloatArray, frequency: float, shape: FloatArray
) -> tuple[float, FloatArray] | None:
    """The mode most like a measured shape (NaN: not measured) by MAC; among equals the nearest frequency."""
    if not len(z):
        return None
    seen = ~np.isnan(shape)
    size = np.linalg.norm(v[seen], axis=0) * np.linalg.norm(shape[seen])
    mac = np.divide(shape[seen] @ v[seen], size, out=np.zeros_like(z), where=size > 0) ** 2
    away = np.abs(np.log(np.sqrt(z) / frequency))
    best = int(np.argmin(np.where(mac >= mac.max() - MAC_SLACK, away, np.inf)))
    return float(z[best]), np.asarray(v[:, best])


def mode_slopes(
    A: FloatArray, dA: FloatArray, z: float, v: FloatArray, reference: int
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of z (n,) and of the shape (e, n) whose entry `reference` is kept at 1.

    A and dA as of `dynamic_stiffness`, z and the shape v (e,) of a mode.
    """
    k, e = np.arange(len(A)), len(v)
    bordered, right = np.zeros((e + 1, e + 1)), np.zeros((e + 1, dA.shape[-1]))
    bordered[:e, :e] = np.tensordot(z**k, A, axes=1)
    bordered[:e, e] = np.tensordot(k * z**k, A, axes=1) @ v  # unknown: relative change of z, of others' size
    right[:e] = -np.einsum("k,keon,o->en", z**k, dA, v)
    size = np.abs(bordered).max()
    bordered[e, reference] = size
    solved = np.linalg.solve(bordered / size, right / size)
    return solved[e] * z, solved[:e]


def reference_amplitude(shape: FloatArray) -> int:
    """The first measured amplitude that is no node of the mode."""
    size = np.nan_to_num(np.abs(shape))
    return int(np.flatnonzero(size >= 0.1 * size.max())[0])
