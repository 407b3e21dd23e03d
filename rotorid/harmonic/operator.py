"""Predicted amplitudes of an operator model and their exact derivatives.

The equations are sums of terms c · Πθ^e · p^k · signal. With the outputs on one side they are
A(p; θ) Z = b(p; θ), so Z = A⁻¹ b and dZ/dθ = A⁻¹ (db/dθ − dA/dθ Z) ([S] (17), (18)). In free vibration
p² = −ω², b = 0, and odd powers of p, which would need imaginary amplitudes, are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorid.harmonic.features import multipliers
from rotorid.harmonic.model import HarmonicModel


@dataclass(frozen=True, eq=False)
class Operator:
    """A model ready for prediction: f features (equation, signal, power of p), each a polynomial of θ.

    Attributes
    ----------
    model
        With as many outputs as equations.
    """

    model: HarmonicModel

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of what is predicted."""
        return self.model.outputs

    @cached_property
    def equation(self) -> IntArray:
        """Of each feature (f,)."""
        return np.array([f.equation for f in self.model.features], dtype=np.int_)

    @cached_property
    def power(self) -> IntArray:
        """Of p in each feature (f,)."""
        return np.array([f.power for f in self.model.features], dtype=np.int_)

    @cached_property
    def signal(self) -> IntArray:
        """Of each feature (f,): outputs, then inputs, then −1 for none."""
        names = [*self.outputs, *self.model.inputs]
        return np.array(
            [names.index(f.signal) if f.signal else -1 for f in self.model.features], dtype=np.int_
        )

    @cached_property
    def _is_output(self) -> BoolArray:
        return (self.signal >= 0) & (self.signal < len(self.outputs))

    @cached_property
    def _place(self) -> FloatArray:
        """Where the output features stand in A: (f, e·e)."""
        e = len(self.outputs)
        place = np.zeros((len(self.signal), e * e))
        at = np.flatnonzero(self._is_output)
        place[at, self.equation[at] * e + self.signal[at]] = 1.0
        return place

    @cached_property
    def rows(self) -> list[IntArray]:
        """Features of each equation."""
        return [np.flatnonzero(self.equation == i) for i in range(len(self.outputs))]

    def polynomials(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values (f,) and derivatives (f, n) of the features' coefficients at θ (n,)."""
        C = self.model.coefficients
        return C @ self.model.monomial_values(theta), C @ self.model.monomial_jacobian(theta)

    def forced(
        self,
        theta: FloatArray,
        frequencies: FloatArray,
        inputs: ComplexArray,
        slopes: bool = True,
        varying: Mapping[str, FloatArray] | None = None,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Amplitudes (n, e) and their derivatives (n, e, parameters).

        Parameters
        ----------
        theta
            Parameters.
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
        P, dP = self.polynomials(theta)
        n, e = len(frequencies), len(self.outputs)
        pk = self.multipliers(frequencies, varying)
        A = ((pk * P) @ self._place).reshape(n, e, e)
        # only inputs and terms without a signal are in it so far
        load = pk * self._amplitudes(np.zeros((n, e), dtype=complex), inputs)
        b = -np.stack([load[:, f] @ P[f] for f in self.rows], axis=1)
        Z: ComplexArray = np.asarray(np.linalg.solve(A, b[..., None])[..., 0], dtype=np.complex128)
        if not slopes:
            return Z, np.zeros((n, e, 0), dtype=complex)
        load = pk * self._amplitudes(Z, inputs)
        G = -np.stack([load[:, f] @ dP[f] for f in self.rows], axis=1)
        return Z, np.asarray(np.linalg.solve(A, G), dtype=np.complex128)

    def dynamic_stiffness(
        self, theta: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Matrices A_k (k, e, e) of A = Σ A_k z^k with z = ω² = −p², and derivatives (k, e, e, n).

        Varying quantities (1,) have the values of one row.
        """
        P, dP = self.polynomials(theta)
        if self.model.varying:
            products = [f.varying for f in self.model.features]
            row = multipliers([0] * len(P), products, np.ones(1), varying)[0].real
            P, dP = P * row, dP * row[:, None]
        e = len(self.outputs)
        use = self._is_output & (self.power % 2 == 0)
        low = int(self.power[use].min()) if use.any() else 0
        k = (self.power - low) // 2
        # multiplied by p^−low: without this a compliance form written with 1/p² would have no polynomial
        sign = np.where(k % 2 == 0, 1.0, -1.0)
        degree = int(k[use].max()) + 1 if use.any() else 1
        A, dA = np.zeros((degree, e, e)), np.zeros((degree, e, e, len(theta)))
        for f in np.flatnonzero(use):
            at = (k[f], self.equation[f], self.signal[f])
            A[at] += sign[f] * P[f]
            dA[at] += sign[f] * dP[f]
        return A, dA

    def _amplitudes(self, Z: ComplexArray, inputs: ComplexArray) -> ComplexArray:
        """Amplitude that each feature multiplies, (n, f)."""
        table = np.concatenate((Z, inputs, np.ones((len(Z), 1))), axis=1)
        return np.asarray(table[:, self.signal])

    def multipliers(
        self, frequencies: FloatArray, varying: Mapping[str, FloatArray] | None = None
    ) -> ComplexArray:
        """p^k · varying of each feature, (n, f)."""
        return multipliers(
            self.power.tolist(), [f.varying for f in self.model.features], frequencies, varying
        )


def operator_of(model: HarmonicModel) -> Operator:
    """Prepare a model for prediction; ValueError if equations and outputs differ in number."""
    if len(model.equations) != len(model.outputs):
        raise ValueError(
            f"predicting amplitudes needs as many equations as outputs; there are {len(model.equations)} "
            f"equations and {len(model.outputs)} outputs ({', '.join(model.outputs) or 'none'}): say which "
            "signals are known with inputs = [...], or use the equation-error method"
        )
    return Operator(model)
