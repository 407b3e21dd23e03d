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
        """Where the features stand in the equations, (f, equations, 1 + signals)."""
        place = np.zeros((len(self.features), len(self.equations), 1 + len(self.signals)))
        place[np.arange(len(place)), self.equation, self.column] = 1.0
        return place

    def multipliers(
        self, frequencies: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> ComplexArray:
        """(iω)^k and the varying quantities of each feature (n, f), for frequencies (n,)."""
        w, k, rows = np.asarray(frequencies, dtype=float), self.power, varying or {}
        if (k < 0).any() and (w == 0).any():
            raise ValueError("an equation divides by p: an experiment at the frequency 0 cannot be used")
        # exact powers of i, so that a real row has no imaginary dust
        factors = w[:, None] ** k * np.array([1, 1j, -1, -1j])[k % 4]
        every = [(j, *part) for j, feature in enumerate(self.features) for part in feature.varying]
        for j, name, exponent in every:
            if name not in rows:
                raise ValueError(
                    f"{name} stands as a factor in the equations and is neither known nor estimated: "
                    f"the measurements must have its value in every row (a column {name})"
                )
            if exponent < 0 and not np.all(rows[name]):
                raise ValueError(f"an equation divides by {name}, which is 0 in a row of the measurements")
            factors[:, j] *= rows[name] ** float(exponent)
        return np.asarray(factors, dtype=complex)

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
        return np.tensordot(terms, self._place, 1)

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
        size = np.ones(len(frequencies), dtype=complex)
        table = np.array([inputs[name] * size for name in self.inputs]).reshape(-1, len(size)).T
        return dict(zip(self.outputs, self.forced(values, frequencies, table, varying)[0].T, strict=True))

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
        e, (P, dP) = len(self.outputs), self.polynomials(values)
        multipliers = self.multipliers(frequencies, varying)
        A, B = np.split(np.tensordot(multipliers * P, self._place, 1), [e], axis=2)
        given = np.column_stack((inputs, np.ones(len(multipliers))))
        Z = np.linalg.solve(A, -(B @ given[:, :, None]))[:, :, 0]
        load = multipliers * np.column_stack((Z, given))[:, self.column]
        G = (load[:, None] * np.eye(e)[self.equation].T) @ dP
        return Z, np.linalg.solve(A, -G)

    def dynamic_stiffness(
        self, values: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Matrices A_k (k, e, e) of A = Σ A_k z^k with z = ω² = −p², and derivatives (k, e, e, n).

        Of free vibration: odd powers of p, which would need imaginary amplitudes, are left out. Varying
        quantities (1,) have the values of one row.
        """
        P, dP = self.polynomials(values)
        use = (self.column < len(self.outputs)) & (self.power % 2 == 0)
        # multiplied by p^−lowest: a compliance form written with 1/p² would have no polynomial
        k = (self.power[use] - min(self.power[use], default=0)) // 2
        row = self.multipliers(np.ones(1), varying)[0, use].real  # with the signs of p^k
        A = np.zeros((max(k, default=0) + 1, len(self.outputs), len(self.outputs)))
        dA = np.zeros((*A.shape, len(values)))
        at = (k, self.equation[use], self.column[use])
        np.add.at(A, at, row * P[use])
        np.add.at(dA, at, row[:, None] * dP[use])
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
    if theta.all():
        return products, products[:, None] * exponents / theta
    each = [exponents - np.outer(exponents[:, j] != 0, unit) for j, unit in enumerate(np.eye(len(theta)))]
    return products, exponents * np.prod(theta ** np.array(each), axis=-1).T


def eigenvalues(A: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """All z with Σ A_k z^k singular, A (k, e, e), and vectors of the companion form, shapes above."""
    from scipy.linalg import eig

    degree, e = len(A) - 1, A.shape[1]
    if degree < 1:
        return np.zeros(0, dtype=complex), np.zeros((e, 0), dtype=complex)
    # companion form L y = z R y with y = (v, z v, …); z scaled so that its matrices are of one size
    first, last = np.abs(A[[0, -1]]).max(axis=(1, 2))
    unit = float(first / last) ** (1 / degree) if first > 0 and last > 0 else 1.0
    scaled = A * unit ** np.arange(degree + 1)[:, None, None]
    L, R = np.eye(degree * e, k=e), np.eye(degree * e)
    L[-e:], R[-e:, -e:] = -np.hstack([*scaled[:-1]]), scaled[-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        z, y = eig(L, R)
    return z * unit, np.asarray(y)


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
    """The mode most like a measured shape (NaN: not measured) by MAC; within 0.02 the nearest frequency."""
    if not len(z):
        return None
    seen = ~np.isnan(shape)
    u, w = shape[seen], v[seen]
    size = (w * w).sum(axis=0) * float(u @ u)
    mac = np.divide((u @ w) ** 2, size, out=np.zeros_like(z), where=size > 0)
    away = np.abs(np.log(np.sqrt(z) / frequency))
    best = int(np.argmin(np.where(mac >= mac.max() - 0.02, away, np.inf)))
    return float(z[best]), v[:, best]


def mode_slopes(
    A: FloatArray, dA: FloatArray, z: float, v: FloatArray, reference: int
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of z (n,) and of the shape (e, n) whose entry `reference` is kept at 1.

    A and dA as of `dynamic_stiffness`, z and the shape v (e,) of a mode.
    """
    k, e = np.arange(len(A)), len(v)
    slope = np.tensordot(k[1:] * z ** k[:-1], A[1:], axes=1)
    force = -np.einsum("k,keon,o->en", z**k, dA, v)
    bordered = np.zeros((e + 1, e + 1))
    bordered[:e, :e] = np.tensordot(z**k, A, axes=1)
    bordered[:e, e] = slope @ v * z  # unknown: relative change of z, of the size of the others
    bordered[e, reference] = 1.0
    rows = np.abs(bordered).max(axis=1, keepdims=True)
    rows[rows == 0] = 1.0
    solved = np.linalg.solve(bordered / rows, np.vstack((force, np.zeros(force.shape[1]))) / rows)
    return solved[e] * z, solved[:e]


def reference_amplitude(shape: FloatArray) -> int:
    """The first measured amplitude that is no node of the mode."""
    size = np.nan_to_num(np.abs(shape))
    return int(np.flatnonzero(size >= 0.1 * size.max())[0])
