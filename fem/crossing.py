"""Where a mode does something at a speed: crosses the 1× line, or loses stability. Refined on the model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem.planes import ComplexArray, Quadratic
from fem.quadratic import polish
from fem.rotor import FloatArray
from fem.whirlsolve import Whirl, enriched

_CONVERGED = 1e-13
_STEPS = 60
Function = Callable[[ComplexArray, FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Crossings:
    """Roots over speed, ascending.

    Attributes
    ----------
    speeds
        rad/s, shape (c,).
    modes
        Column of each, from 0, shape (c,).
    values
        Eigenvalue there, shape (c,).
    shapes
        Deflections of all nodes, shape (c, planes, N).
    """

    speeds: FloatArray
    modes: NDArray[np.intp]
    values: ComplexArray
    shapes: ComplexArray


def synchronous(whirl: Whirl, values: ComplexArray, vectors: ComplexArray) -> Crossings:
    """Speeds that equal the whirl frequency of a mode."""
    return crossings(whirl, values, vectors, lambda lam, speed: np.abs(lam.imag) - speed)


def crossings(whirl: Whirl, values: ComplexArray, vectors: ComplexArray, function: Function) -> Crossings:
    """Roots of a function of eigenvalue and speed on each mode, shapes (S, n) and (S, n, R)."""
    speeds, Q = whirl.speeds, whirl.Q
    f = function(values, speeds[:, None])
    change = (f[:-1] * f[1:] < 0) | ((f[1:] == 0) & (f[:-1] != 0))
    change[:1] |= f[:1][:, :] == 0 if len(change) else False
    k, mode = np.nonzero(change)
    part = f[k, mode] / (f[k, mode] - f[k + 1, mode])
    near = np.where(part < 0.5, k, k + 1)
    start = values[k, mode] + part * (values[k + 1, mode] - values[k, mode])
    ends = np.stack((speeds[k], speeds[k + 1]))
    found, lam, X = _roots(
        Q, ends, np.stack((f[k, mode], f[k + 1, mode])), start, vectors[near, mode], function
    )
    if k.size:
        # The same once more in a basis that holds the full model's vectors there.
        Q, X = enriched(whirl, found, lam, X)
        slack = 1e-6 * (ends[1] - ends[0])
        tight = np.clip(np.stack((found - slack, found + slack)), ends[0], ends[1])
        found, lam, X = _secant(Q, found, tight, lam, X, function)
    order = np.argsort(found, kind="stable")
    return Crossings(found[order], mode[order], lam[order], Q.nodes(X[order]))


def _roots(
    Q: Quadratic, ends: FloatArray, f: FloatArray, lam: ComplexArray, X: ComplexArray, function: Function
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    """Bracketed roots, all at once, by regula falsi after Anderson and Björck."""
    (a, b), (fa, fb) = ends.copy(), f.copy()
    root = (a * fb - b * fa) / np.where(fa == fb, 1.0, fb - fa)
    for _ in range(_STEPS):
        new, Y, _ = polish(Q, root, np.arange(root.size), lam, X, 2)
        value = function(new, root)
        lam, X = new, Y
        left = np.sign(value) == np.sign(fa)
        held = np.where(left, fa, fb)
        ratio = 1 - value / np.where(held == 0, 1.0, held)
        ratio = np.where(ratio > 0, ratio, 0.5)
        fa, fb = np.where(left, value, fa * ratio), np.where(left, fb * ratio, value)
        a, b = np.where(left, root, a), np.where(left, b, root)
        step = (a * fb - b * fa) / np.where(fa == fb, 1.0, fb - fa)
        step = np.where(value == 0, root, np.clip(step, np.minimum(a, b), np.maximum(a, b)))
        moved, root = np.abs(step - root), step
        if (moved <= 1e-11 * np.maximum(ends[1], 1e-300)).all():
            break
    lam, X, _ = polish(Q, root, np.arange(root.size), lam, X, 2)
    return root, lam, X


def _secant(
    Q: Quadratic,
    root: FloatArray,
    tight: FloatArray,
    lam: ComplexArray,
    X: ComplexArray,
    function: Function,
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    """Last digits of roots that are known well."""
    at = np.arange(root.size)
    lam, X, _ = polish(Q, root, at, lam, X, 2)
    here = function(lam, root)
    other = np.where(tight[1] - root > root - tight[0], tight[1], tight[0])
    there = function(polish(Q, other, at, lam, X, 3)[0], other)
    slope = (there - here) / np.where(other == root, 1.0, other - root)
    for _ in range(3):
        root = root - here / np.where(slope == 0, 1.0, slope)
        lam, X, _ = polish(Q, np.maximum(root, 0.0), at, lam, X, 2)
        here = function(lam, root)
        if (np.abs(here) <= _CONVERGED * np.abs(slope) * root).all():
            break
    return root, lam, X
