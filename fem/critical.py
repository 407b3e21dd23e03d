"""Critical speeds of the undamped rotor."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem.matrices.bands import Matrices, assemble, ignored_inertia
from fem.matrices.pencil import TO_XY, Pencil, whole_rotor
from fem.model.rotor import Rotor, whole
from fem.modes import Modes
from fem.solvers.eigen import fine_mesh_warning, finite_modes, lowest_modes
from rotorid.base.arrays import AnyArray, FloatArray

_LINE = 1e-6  # relative difference of forward and backward amplitude below which an orbit is a line
_SHAPES = 1e-8  # tolerance of mode shapes; that of frequencies is its square
_STEPS = 2  # trial speeds per interval of a bearing table


@dataclass(frozen=True, eq=False)
class _Found:
    """Critical speeds squared, and vectors of the pencil they belong to."""

    squares: FloatArray
    vectors: AnyArray
    pencil: Pencil
    rounding: FloatArray


def critical_speeds(rotor: Rotor, n: int = 3) -> Modes:
    """Compute the n lowest critical speeds and mode shapes of the undamped rotor.

    At a critical speed the rotor, turning at this speed, whirls freely once per turn: the gyroscopic moment
    then acts as the mass −G on forward whirl. Damping plays no part, nor does the antisymmetric part of
    the supports' stiffness, (kxy − kyx) / 2, which acts like damping. Stiffness over speed is
    taken at the critical speed itself. On rotationally symmetric supports the forward critical speeds are
    listed; on others all, with their `direction`. Moments of inertia that the model leaves out are
    said in `warnings`. Reference: [S] task 9.1.

    Parameters
    ----------
    rotor
        The rotor; without enough supports its rigid-body motions come first, with frequency 0.
    n
        How many, from 1.

    Returns
    -------
    Modes
        Frequencies in rad/s and shapes; of fewer than n where bearing tables end before, with a warning.

    Raises
    ------
    ValueError
        If the model has fewer than n modes, the bearing tables hold no critical speed, nothing
        that moves has mass, or the mesh is too fine for float64.
    """
    n = whole(n, "the number of critical speeds")
    A = assemble(rotor)
    said: tuple[str, ...] = ()
    if rotor.constant:
        pencil = whole_rotor(rotor, A)
        _check_number(n, finite_modes(pencil))
        found = [_lowest(pencil, n)]
    else:
        _check_number(n, finite_modes(A) * (1 if rotor.symmetric else 2))
        found, said = _over_speed(rotor, A, n)
    return _modes(rotor, found, said)


def _check_number(n: int, available: int, reason: str = "") -> None:
    if not 1 <= n <= available:
        raise ValueError(
            f"{n} critical speeds cannot be found: the model has 1 to {available}{reason}; "
            "choose n in this range, or divide the shaft into more elements"
        )


def _lowest(pencil: Pencil, n: int) -> _Found:
    """The n lowest modes of positive mass."""
    available, m = finite_modes(pencil), n
    while True:
        spectrum = lowest_modes(pencil.rotor, pencil.matrices, m, pencil, _SHAPES)
        real = np.flatnonzero(spectrum.squares >= 0)
        if real.size >= n or m == available:
            break
        m = min(available, 2 * m + 2)
    _check_number(n, real.size, " (discs whose polar inertia exceeds the diametral one take some away)")
    real = real[np.argsort(spectrum.squares[real], kind="stable")][:n]
    return _Found(spectrum.squares[real], spectrum.vectors[:, real], pencil, spectrum.rounding[real])


def _over_speed(rotor: Rotor, A: Matrices, n: int) -> tuple[list[_Found], tuple[str, ...]]:
    """The n lowest intersections of natural frequency and speed, over the range of all bearing tables.

    There may be fewer; then warnings say so.
    """
    tables = [support.speeds for support in rotor.supports if support.speeds]
    first, last = max(table[0] for table in tables), min(table[-1] for table in tables)
    if first >= last:
        raise ValueError("the tables of the supports have no speed in common: extend them")
    knots = np.unique(np.concatenate([np.array(table) for table in tables]))
    knots = knots[(knots >= first) & (knots <= last)]
    grid = np.unique(np.concatenate([np.linspace(a, b, _STEPS + 1) for a, b in itertools.pairwise(knots)]))

    def at(omega: float, count: int) -> _Found:
        pencil = whole_rotor(rotor, A, omega)
        return _lowest(pencil, min(count, finite_modes(pencil)))

    def surplus(omega: float, k: int) -> float:
        return float(np.sqrt(max(at(omega, k + 1).squares[k], 0.0)) - omega)

    m, below = n, 0  # modes to follow; those below the first speed are met where nothing is known
    while True:
        frequencies = [np.sqrt(np.maximum(at(first, m).squares, 0.0))]
        below = int(np.count_nonzero(frequencies[0] < first))
        if frequencies[0].size < m or m >= n + below:
            break
        m = n + below
    found: list[tuple[float, int]] = []
    for left, right in itertools.pairwise(grid):
        frequencies.append(np.sqrt(np.maximum(at(right, m).squares, 0.0)))
        a, b = frequencies[-2] - left, frequencies[-1] - right
        crossing = [k for k in range(min(a.size, b.size)) if (a[k] >= 0) != (b[k] >= 0)]
        found += [(_root(surplus, k, left, right, a[k], b[k]), k) for k in crossing]
        if len(found) >= n:
            break
    found = sorted(found)[:n]
    if not found:
        reason = (
            f"the first natural frequency at {first:.6g} rad/s is {frequencies[0][0]:.6g} rad/s"
            if below
            else f"the first natural frequency at {last:.6g} rad/s is {frequencies[-1][0]:.6g} rad/s"
        )
        raise ValueError(
            f"no critical speed lies between {first:.6g} and {last:.6g} rad/s, where the bearing tables "
            f"hold; {reason}: extend the tables"
        )
    warnings: tuple[str, ...] = ()
    if len(found) < n:
        warnings += (
            f"only {len(found)} of {n} critical speeds {'lies' if len(found) == 1 else 'lie'} between "
            f"{first:.6g} and {last:.6g} rad/s, where the tables hold; extend them to find more",
        )
    if below:
        warnings += (
            f"at {first:.6g} rad/s, where the bearing tables begin, the lowest natural frequency is only "
            f"{frequencies[0][0]:.6g} rad/s: critical speeds below the tables are not known, nor counted",
        )
    result = []
    for omega, k in found:
        modes = at(omega, k + 1)
        pick = slice(k, k + 1)
        result.append(
            _Found(np.array([omega * omega]), modes.vectors[:, pick], modes.pencil, modes.rounding[pick])
        )
    return result, warnings


def _root(function: Callable[[float, int], float], k: int, a: float, b: float, fa: float, fb: float) -> float:
    """Zero of `function(·, k)` between a and b: secants kept inside the bracket (Illinois)."""
    for _ in range(60):
        if fb == fa:
            break
        c = b - fb * (b - a) / (fb - fa)
        if not min(a, b) < c < max(a, b):
            c = (a + b) / 2
        fc = function(c, k)
        if abs(fc) <= 1e-13 * c:
            return c
        if (fc < 0) == (fb < 0):
            fa = fa / 2
        else:
            a, fa = b, fb
        b, fb = c, fc
        if abs(b - a) <= 1e-14 * abs(b):
            break
    return b


def _modes(rotor: Rotor, found: list[_Found], said: tuple[str, ...]) -> Modes:
    squares = np.concatenate([part.squares for part in found])
    rounding = np.concatenate([part.rounding for part in found])
    warnings = said + ignored_inertia(rotor) + fine_mesh_warning(rotor, rounding)
    rigid = int(np.count_nonzero(squares == 0))
    if rigid:
        motions = "motion" if rigid == 1 else "motions"
        warnings += (
            f"the supports leave {rigid} rigid-body {motions} of the rotor free; "
            f"{'it comes' if rigid == 1 else 'they come'} first, with critical speed 0",
        )
    parts = [_shapes(part) for part in found]
    arrays = [
        np.sqrt(np.maximum(squares, 0.0)),
        *(np.concatenate([part[i] for part in parts], axis=1) for i in range(4)),
    ]
    for array in arrays:
        array.flags.writeable = False
    frequencies, shapes, slopes, x, y = arrays
    direction = tuple(word for part in parts for word in part[4])
    return Modes(frequencies, shapes, slopes, rotor, direction, x, y, warnings)


def _shapes(part: _Found) -> tuple[FloatArray, FloatArray, AnyArray, AnyArray, list[str]]:
    """Shapes, slopes, amplitudes in x and y, each (N, n), and directions."""
    w, tilt = part.vectors[part.pencil.waves], part.vectors[part.pencil.tilts]
    if len(w) == 1:
        scale = _scale(w[0])
        shapes = w[0] / scale
        return shapes, tilt[0] / scale, shapes.astype(complex), -1j * shapes, ["forward"] * part.squares.size
    x, y = np.einsum("ap,pnk->ank", TO_XY, w)
    tilt_x, tilt_y = np.einsum("ap,pnk->ank", TO_XY, tilt)
    along_x = np.abs(x).max(axis=0) >= np.abs(y).max(axis=0) * (1 - _LINE)
    major = np.where(along_x, x, y)
    scale = 1.0 / _scale(major)
    shapes, slopes = (major * scale).real, (np.where(along_x, tilt_x, tilt_y) * scale).real
    return shapes, slopes, x * scale, y * scale, [_direction(w[:, :, k]) for k in range(part.squares.size)]


def _scale(shapes: AnyArray) -> AnyArray:
    """First entry of each column, or its largest where the first is zero, shape (n,)."""
    size = np.abs(shapes)
    largest = shapes[np.argmax(size, axis=0), np.arange(shapes.shape[1])]
    return np.asarray(np.where(size[0] > 1e-6 * np.abs(largest), shapes[0], largest))


def _direction(waves: AnyArray) -> str:
    """How the orbits of forward and backward amplitudes, shape (2, N), run."""
    forward, backward = np.abs(waves)
    moving = np.maximum(forward, backward) > 1e-6 * max(forward.max(), backward.max())
    difference = (forward - backward)[moving]
    margin = _LINE * (forward + backward)[moving]
    if (difference > margin).all():
        return "forward"
    return "backward" if (difference < -margin).all() else "mixed"
