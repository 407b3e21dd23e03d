"""Operator models: equations linear in the amplitudes with coefficients in p = d/dt, what they predict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.harmonic.parameter_combinations import (
    CONSTANT,
    Combinations,
    Feature,
    exact_number,
    lifted,
    merge,
    multipliers,
    powers_product,
    powers_slopes,
)
from rotorid.harmonic.polynomial import ONE, Monomial


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
        return lifted(self.features, self.parameters)

    @cached_property
    def combinations(self) -> Combinations:
        """What data can determine at best: the row space of the coefficients."""
        exact = {name: exact_number(value) for name, value in self.known.items()}
        return merge(self.features, self.monomials, exact)

    @cached_property
    def coefficients(self) -> FloatArray:
        """Of the features in 1 and the monomials, (features, 1 + monomials)."""
        lifted_ = (ONE, *self.monomials)
        return np.array([[float(f.exact.get(m, 0)) for m in lifted_] for f in self.features])

    @cached_property
    def exponents(self) -> FloatArray:
        """Exponents of the parameters, (1 + monomials, parameters); row 0 is the constant 1."""
        place = {name: i for i, name in enumerate(self.parameters)}
        table = np.zeros((1 + len(self.monomials), len(self.parameters)))
        for i, monomial in enumerate(self.monomials):
            for name, exponent in monomial:
                table[i + 1, place[name]] = exponent
        return table

    def monomial_values(self, values: FloatArray) -> FloatArray:
        """Monomials (1 + monomials,) of parameters (n,)."""
        return powers_product(self.exponents, values)

    def monomial_jacobian(self, values: FloatArray) -> FloatArray:
        """Derivatives (1 + monomials, n) of the monomials by the parameters."""
        return powers_slopes(self.exponents, values)

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
        place = np.zeros((len(self.features), len(self.equations) * columns))
        place[np.arange(len(place)), self.equation * columns + self.column] = 1.0
        return place

    def multipliers(
        self, frequencies: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> ComplexArray:
        """p^k · varying of each feature, (n, f)."""
        return multipliers(self.power.tolist(), [f.varying for f in self.features], frequencies, varying)

    def polynomials(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (f,) and derivatives (f, n) of the features' coefficients at parameters (n,)."""
        C = self.coefficients
        return C @ self.monomial_values(values), C @ self.monomial_jacobian(values)

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
        terms = self.multipliers(frequencies, varying) * (self.coefficients @ self.monomial_values(values))
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
        found, _ = self.forced(values, frequencies, table, False, varying)
        return {name: found[:, j] for j, name in enumerate(self.outputs)}

    def forced(
        self,
        values: FloatArray,
        frequencies: FloatArray,
        inputs: ComplexArray,
        slopes: bool = True,
        varying: Mapping[str, FloatArray] | None = None,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Amplitudes of the outputs (n, e) and their derivatives (n, e, parameters).

        From A Z = b with the outputs on one side: Z = A⁻¹ b and dZ/dθ = A⁻¹ (db/dθ − dA/dθ Z) ([S] (17),
        (18)).

        Parameters
        ----------
        values
            Of the parameters.
        frequencies
            ω, shape (n,).
        inputs
            Amplitudes of the inputs, (n, inputs).
        slopes
            False: without derivatives (an empty array).
        varying
            Known quantities (n,) that change from row to row, by name.

        Raises
        ------
        numpy.linalg.LinAlgError
            At a resonance without damping.
        """
        n, e = len(frequencies), len(self.outputs)
        given = np.concatenate((inputs, np.ones((n, 1))), axis=1)
        whole = self.matrices(values, frequencies, varying)
        A = whole[:, :, :e]
        right = -(whole[:, :, e:] @ given[:, :, None])
        Z = np.asarray(np.linalg.solve(A, right)[:, :, 0], dtype=np.complex128)
        if not slopes:
            return Z, np.zeros((n, e, 0), dtype=complex)
        load = self.multipliers(frequencies, varying) * np.concatenate((Z, given), axis=1)[:, self.column]
        _, dP = self.polynomials(values)
        own = [np.flatnonzero(self.equation == i) for i in range(e)]
        G = -np.stack([load[:, f] @ dP[f] for f in own], axis=1)
        return Z, np.asarray(np.linalg.solve(A, G), dtype=np.complex128)

    def dynamic_stiffness(
        self, values: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Matrices A_k (k, e, e) of A = Σ A_k z^k with z = ω² = −p², and derivatives (k, e, e, n).

        Of free vibration: odd powers of p, which would need imaginary amplitudes, are left out. Varying
        quantities (1,) have the values of one row.
        """
        P, dP = self.polynomials(values)
        if self.varying:
            row = multipliers([0] * len(P), [f.varying for f in self.features], np.ones(1), varying)[0].real
            P, dP = P * row, dP * row[:, None]
        e = len(self.outputs)
        use = (self.column < e) & (self.power % 2 == 0)
        low = int(self.power[use].min()) if use.any() else 0
        k = (self.power - low) // 2
        # multiplied by p^−low: without this a compliance form written with 1/p² would have no polynomial
        sign = np.where(k % 2 == 0, 1.0, -1.0)
        degree = int(k[use].max()) + 1 if use.any() else 1
        A, dA = np.zeros((degree, e, e)), np.zeros((degree, e, e, len(values)))
        at = (k[use], self.equation[use], self.column[use])
        np.add.at(A, at, sign[use] * P[use])
        np.add.at(dA, at, sign[use, None] * dP[use])
        return A, dA

    def check_square(self) -> None:
        """Raise ValueError if amplitudes cannot be predicted: not as many outputs as equations."""
        if len(self.outputs) != len(self.equations):
            raise ValueError(
                f"predicting amplitudes needs as many equations as outputs; there are {len(self.equations)} "
                f"equations and {len(self.outputs)} outputs ({', '.join(self.outputs) or 'none'}): say which "
                "signals are given with inputs = [...], or use the equation-error method"
            )
