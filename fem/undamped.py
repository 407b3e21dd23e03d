"""Undamped critical speeds: the conservative rotor on its supports at synchronous whirl, K φ = λ M φ, λ = ω².

Turning at Ω = ω, a rotor whirls in orbits x + i y = F e^{iωt} + b e^{−iωt}: the gyroscopic moment is an
inertia, M − G for the forward wave F and M + G for the backward wave b. Thin discs make M − G indefinite; a
forward mode of negative mass has λ < 0 and no critical speed. With x = F + b and y = −i (F − b) a symmetric
stiffness k of (x, y) is on (F, b) the mean of kxx and kyy on the diagonal, and (kxx − kyy) / 2 ± i kxy beside
it: real without cross-coupling, and where x and y are alike F stands alone. A pedestal is one more unknown of
each wave beside its node.

With the Cholesky factor K + σ M = Uᴴ U (σ > 0 only where supports are soft or missing), U⁻ᴴ M U⁻¹ has the
eigenvalues 1 / (λ + σ), the wanted ones the largest: from its block Krylov space, in which equal frequencies
are not missed, or, of few unknowns, from all of them. These vectors span a Rayleigh–Ritz step with energies
summed from the strains of the elements: they keep digits that the matrices lose, so that an element
of 1/1000 of its neighbour costs 1e-8 of a frequency, not 1e-4.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fem.assembly import (
    TO_XY,
    Matrices,
    assemble,
    free_motions,
    ignored_inertia,
    multiply,
    on_waves,
    rounding_error,
)
from fem.elements import DENSE, dense, strains
from fem.orbits import DIRECTION_NAMES, whirl_direction
from fem.result import NORMAL_95, Result, holding_arrays
from fem.rotor import Pedestal, Rotor, refined
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray, IndexArray, whole
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, error_figures, listing, percent

NOT_COUNTED = "critical speeds below the tables are not known, nor counted"
NO_MASS = (
    "the rotor can move as a rigid body without moving any mass: give the shaft a density, or add supports"
)
_UNSTABLE = (
    "the rotor on its supports is statically unstable, or its stiffness is lost in float64: a support has "
    "negative stiffness, elements are far too short, or thin discs (polar inertia above diametral) turn a "
    "free rotor, which soft supports at two nodes would hold"
)
_PARTS = (1 - np.cos(np.linspace(0, np.pi, 11))) / 2  # of an interval of the tables: fine at its ends


@holding_arrays
class Modes(Result):
    """The lowest critical speeds of a rotor, and its shapes there.

    Attributes
    ----------
    frequencies
        Critical speeds: where the frequency of free whirl equals the speed of rotation, rad/s, ascending,
        shape (n,); 0 for a rigid-body motion.
    shapes
        Lateral deflection of each node in each mode, shape (N, n), scaled to 1 at the first node, or to
        the largest value 1 where the first node is a node of the mode. On supports that differ in x and y
        this is the deflection in the direction (x or y) in which the rotor moves more.
    slopes
        Slopes of these shapes at the nodes, 1/m per unit of deflection in m, shape (N, n); with shear, the
        tilt of the cross-section.
    rotor
        The rotor.
    direction
        Of each mode: "forward" (with the rotation), "backward", or "mixed" where the orbits of different
        nodes turn in different directions or are straight lines, as `whirl_direction` has it: orbits of less
        than 1 % of the largest area do not count. On rotationally symmetric supports
        only forward critical speeds are listed: unbalance does not excite the others.
    x, y
        Complex amplitudes of both lateral directions, shape (N, n), in the scale of `shapes`.
    warnings
        What the reader must know.
    cut
        Which critical speeds the bearing tables hold beyond the n asked for; else empty.
    std
        Standard deviations of `frequencies`, from the calibration of the rotor; None without.
    """

    frequencies: FloatArray
    shapes: FloatArray
    slopes: FloatArray
    rotor: Rotor
    direction: tuple[str, ...]
    x: ComplexArray
    y: ComplexArray
    warnings: tuple[str, ...] = ()
    cut: str = ""
    std: FloatArray | None = None

    @property
    def positions(self) -> FloatArray:
        """Axial position of each node, m, shape (N,)."""
        return self.rotor.positions

    @property
    def rpm(self) -> FloatArray:
        """Critical speeds in revolutions per minute, shape (n,)."""
        return self.frequencies * RPM

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid critical`."""
        errors = {} if self.std is None else {"critical_speeds_std_rad_s": self.std}
        return plain(
            {
                "critical_speeds_rad_s": self.frequencies,
                **errors,
                "critical_speeds_rpm": self.rpm,
                "positions_m": self.positions,
                "mode_shapes": self.shapes.T,
                "direction": self.direction,
                "critical_speeds_cut": self.cut or None,
                "warnings": self.warnings,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """The critical speeds; and the shapes, a row for each node."""
        shown, hertz = "{:.4f}".format, self.frequencies / math.tau
        whirl = np.where(self.frequencies > 0, self.direction, "rigid body")
        errors = () if self.std is None else (NORMAL_95 * RPM * self.std,)
        speeds = (
            Column("mode", range(1, self.frequencies.size + 1)),
            Column("whirl", whirl.tolist()),
            Column("rpm", self.rpm, "{:.2f}".format, "critical_speeds_rpm.*"),
            *(Column("± (95 %)", values, error_figures) for values in errors),
            Column("Hz", hertz, shown, "critical_speeds_rad_s.*", 1 / math.tau),
            Column("rad/s", self.frequencies, shown, "critical_speeds_rad_s.*"),
        )
        shapes = (
            Column("node", range(1, self.rotor.n_nodes + 1)),
            Column("position_m", self.positions, "{:.6g}".format, "positions_m.*"),
            *(
                Column(f"mode_{k + 1}", shape, shown, f"mode_shapes.{k}.*")
                for k, shape in enumerate(self.shapes.T)
            ),
        )
        return (Table("critical speeds", speeds), Table("mode shapes", shapes))

    def sentence(self) -> str:
        """How many critical speeds there are, and the first, in rpm."""
        rpm = [f"{speed:.6g}" for speed in self.rpm if speed > 0]
        shown = listing(rpm, "and") if len(rpm) < 6 else f"{', '.join(rpm[:6])} …"
        return f"{counted(len(rpm), 'critical speed')} without damping{f': {shown} rpm' if rpm else ''}."


@holding_arrays
class MeshCheck(Result):
    """Estimated discretisation errors of the critical speeds.

    Attributes
    ----------
    frequencies
        Of the model as it is, rad/s, shape (n,).
    extrapolated
        Estimate for infinitely fine elements, rad/s, shape (n,).
    errors
        Estimated relative error of `frequencies`, shape (n,); positive: they are too high.
    elements
        Of the model.
    """

    frequencies: FloatArray
    extrapolated: FloatArray
    errors: FloatArray
    elements: int

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return plain(
            {
                "elements": self.elements,
                "frequencies_rad_s": self.frequencies,
                "extrapolated_rad_s": self.extrapolated,
                "relative_error": self.errors,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """The errors, a row for each critical speed."""
        columns = (
            Column("mode", range(1, self.errors.size + 1)),
            Column("rpm", self.frequencies * RPM, "{:.2f}".format, "frequencies_rad_s.*", RPM),
            Column("error of the mesh", self.errors, "{:.1e}".format, "relative_error.*"),
        )
        return (Table("errors of the mesh", columns),)

    def sentence(self) -> str:
        """Whether the mesh is fine enough for 0.1 %, and what would be."""
        worst = int(abs(self.errors).argmax())
        size = abs(float(self.errors[worst]))
        text = (
            f"The mesh of {counted(self.elements, 'element')} changes these speeds by at most "
            f"{percent(size)} % (critical speed {worst + 1})"
        )
        if size > 1e-3:
            times = math.ceil((size / 1e-3) ** 0.25)
            text += f": elements {times} times shorter would bring all errors below 0.1 %"
        return f"{text}."


def mesh_check(rotor: Rotor, n: int = 3) -> MeshCheck:
    """Estimate how much the mesh changes each of the n lowest critical speeds; the rotor stays as it is.

    The frequencies f(h) of the elements of this package converge as h⁴, with and without shear; with
    elements cut in two, f(h) − f(0) ≈ 16/15 (f(h) − f(h/2)) (Richardson).

    Parameters
    ----------
    rotor
        With the mesh to be judged.
    n
        How many critical speeds.

    Raises
    ------
    ValueError
        As `critical_speeds`.
    """
    lists = [critical_speeds(refined(rotor, times), n).frequencies for times in (1, 2)]
    coarse, fine = (frequencies[: min(map(len, lists))] for frequencies in lists)  # tables may end between
    extrapolated = coarse - 16 / 15 * (coarse - fine)
    errors = np.where(extrapolated > 0, coarse / np.where(extrapolated > 0, extrapolated, 1.0) - 1, 0.0)
    return MeshCheck(coarse, extrapolated, errors, rotor.n_elements)


def critical_speeds(rotor: Rotor, n: int | None = None) -> Modes:
    """Compute the n lowest critical speeds and mode shapes of the undamped rotor.

    At a critical speed the rotor, turning at this speed, whirls freely once per turn: the gyroscopic moment
    then acts as the mass −G on forward whirl. Damping plays no part, nor does the antisymmetric part of
    the supports' stiffness, (kxy − kyx) / 2, which acts like damping. Stiffness over speed is
    taken at the critical speed itself. On rotationally symmetric supports the forward critical speeds are
    listed; on others all, with their `direction`. Moments of inertia that the model leaves out are
    named in `warnings`. Reference: [S] task 9.1.

    Parameters
    ----------
    rotor
        The rotor; without enough supports its rigid-body motions come first, with frequency 0.
    n
        How many, from 1, by default 3 or all there are; rigid-body motions, of frequency 0, come besides.

    Returns
    -------
    Modes
        Frequencies in rad/s and shapes; of fewer than n where bearing tables end before, with a warning. Over
        bearing tables a mode may cross the speed more than once: all crossings count, and where there are
        more than n `cut` names them.

    Raises
    ------
    ValueError
        If the model has fewer than n modes, the bearing tables hold no critical speed, nothing
        that moves has mass, or the mesh is too fine for float64.
    """
    if n is None:
        return lowest_critical_speeds(rotor, 3)
    asked = whole(n, "the number of critical speeds")
    return lowest_critical_speeds(rotor, asked, asked)


def lowest_critical_speeds(rotor: Rotor, most: int, least: int = 1) -> Modes:
    """`critical_speeds`: the `most` lowest, or all there are, where there are not fewer than `least`.

    Parameters
    ----------
    rotor
        The rotor.
    most, least
        How many at most, and at least.

    Returns
    -------
    Critical speeds with their mode shapes.
    """
    if most < 1:
        raise ValueError(f"{most} critical speeds cannot be found: ask for 1 or more")
    A, warnings, cut = assemble(rotor), ignored_inertia(rotor), ""
    if rotor.constant:
        pencil = whole_rotor(rotor, A)
        rigid = pencil.rigid.shape[1]
        last = most + rigid
        modes = _positive(pencil, last)
        if (count := modes.squares.size - rigid) < least:
            raise ValueError(
                f"{least} critical speeds cannot be found: the model has 1 to {count}; divide the shaft into "
                "more elements (discs whose polar inertia exceeds the diametral one take some away)"
            )
        squares, rounding, motion = modes.squares[:last], modes.rounding[:last], modes.motion[..., :last]
    else:
        parts, beyond, cut = _over_speed(rotor, A, most)
        warnings = beyond + warnings
        squares, rounding = np.array([(*part.squares, *part.rounding) for part in parts]).T
        motion = np.concatenate([part.motion for part in parts], axis=2)
    major, lateral, direction = motion[0], motion[:, :: A.stride], squares.size * ("forward",)
    if not rotor.symmetric:
        largest, ways = abs(lateral).max(axis=1), whirl_direction(*lateral.swapaxes(1, 2))
        major = np.where(largest[0] >= largest[1] * (1 - 1e-6), *motion)
        direction = tuple(DIRECTION_NAMES[way] for way in ways.tolist())
    size = abs(major[:: A.stride])
    size[0] *= 1e6  # 1 there, unless it is a node of the mode
    scale = 1 / major[A.stride * size.argmax(axis=0), np.arange(squares.size)]
    x, y = lateral * scale
    shapes = (major * scale).real
    warnings += fine_mesh_warning(rotor, rounding)
    shapes, slopes = shapes[:: A.stride], shapes[1 :: A.stride]
    return Modes(np.sqrt(squares), shapes, slopes, rotor, direction, x, y, warnings, cut)


def critical_speeds_below(rotor: Rotor, top: float, most: float = np.inf) -> FloatArray:
    """All critical speeds above 0 up to a speed, rad/s, ascending, shape (c,).

    Parameters
    ----------
    rotor
        The rotor.
    top
        rad/s.
    most
        How many of the lowest are enough.

    Raises
    ------
    ValueError
        As `critical_speeds`, if it finds none at all.
    """
    n = 4 if rotor.constant else 32  # over tables all are computed, however many are asked for
    while True:
        speeds = lowest_critical_speeds(rotor, n).frequencies
        if speeds.size < n or speeds[-1] > top or n >= most:
            return speeds[(speeds > 0) & (speeds <= top)]
        n *= 2


def critical_speeds_near(rotor: Rotor, speeds: FloatArray) -> FloatArray:
    """Critical speeds of a rotor that differs little from one with these, rad/s, each followed by iteration.

    Parameters
    ----------
    rotor
        The other rotor.
    speeds
        rad/s, shape (n,); 0 of a rigid-body motion stays.

    Returns
    -------
    rad/s, shape (n,).

    Raises
    ------
    ValueError
        Where one leaves the bearing tables, or does not come to rest.
    """
    from scipy.optimize import fixed_point

    A = assemble(rotor)

    def nearest(speed: float) -> float:
        """Frequency of the mode nearest to a speed."""
        squares = _positive(whole_rotor(rotor, A, float(speed)), 1, speed**2).squares
        return math.sqrt(squares[np.argmin(abs(squares - speed**2))])

    try:
        moved = [fixed_point(nearest, speed, xtol=1e-11, maxiter=12) if speed else 0.0 for speed in speeds]
    except RuntimeError as problem:
        raise ValueError(f"a critical speed cannot be followed: {problem}") from None
    return np.array(moved, float)


def _over_speed(rotor: Rotor, A: Matrices, n: int) -> tuple[list[Spectrum], tuple[str, ...], str]:
    """The n lowest crossings of natural frequency and speed in the tables, warnings, and what is cut off."""
    from scipy.optimize import brentq

    tables = [support.speeds for support in rotor.supports if support.speeds]
    first, last = max(table[0] for table in tables), min(table[-1] for table in tables)
    if first >= last:
        raise ValueError("the tables of the supports have no speed in common: extend them")
    knots = rotor.knots[(rotor.knots >= first) & (rotor.knots <= last)]
    lowest, brackets = _brackets(rotor, A, knots)
    count = len(brackets)
    band = f"between {first:.6g} and {last:.6g} rad/s, where the bearing tables hold"
    beginning = f"the lowest natural frequency at {first:.6g} rad/s is {lowest:.6g} rad/s"
    if not count:
        raise ValueError(f"no critical speed lies {band}; {beginning}: extend the tables")
    warnings: tuple[str, ...] = ()
    if count < n:
        warnings += (f"there are only {count} of {n} critical speeds {band}; extend them to find more",)
    if lowest < first:
        warnings += (f"{beginning}, where the bearing tables begin: {NOT_COUNTED}",)
    low = [bracket for bracket in brackets if bracket[1] < brackets[min(n, count) - 1][0]]
    crossings = sorted((brentq(_gap, a, b, (rotor, A, k), 1e-11 * b, 1e-14), k) for b, a, k in low)[:n]
    modes = [_positive(whole_rotor(rotor, A, speed), k + 1).only(slice(k, k + 1)) for speed, k in crossings]
    cut = f"the list is cut: {counted(count - n, 'more critical speed')} in this range; -n {count} lists all"
    return modes, warnings, cut if count > n else ""


def _gap(speed: float, rotor: Rotor, A: Matrices, k: int, sign: float = 1.0) -> float:
    """λ − Ω² of mode k, from 0; one that a thin disc takes away lies above the speed."""
    squares = _positive(whole_rotor(rotor, A, speed), k + 1).squares
    return sign * float((squares[k] if k < squares.size else 4 * speed**2) - speed**2)


def _brackets(rotor: Rotor, A: Matrices, knots: FloatArray) -> tuple[float, list[tuple[float, float, int]]]:
    """Lowest natural frequency at the first knot, and every (upper end, lower end, mode) with one crossing.

    |λ − Ω²| of a mode is nearly convex where it is small, between knots: without a change of sign, a part of
    this can hold two crossings only if the lines through the parts beside it fall below 0 in it.
    """
    from scipy.optimize import minimize_scalar

    top = (1.01 * knots[-1]) ** 2
    parts = knots[:-1, None] + np.diff(knots)[:, None] * _PARTS[:-1]
    speeds = np.append(parts, knots[-1])
    lists = [np.zeros(1)]
    for speed in speeds:
        lists.append(_positive(whole_rotor(rotor, A, speed), lists[-1].size, top).squares)
    modes = np.array([*itertools.zip_longest(*lists[1:], fillvalue=top)])
    brackets, steps = [], np.diff(speeds)
    if 0 < modes[0, -1] < 1e-12 * top:
        raise ValueError("masses, moments of inertia or stiffnesses differ by too many orders of size")
    for k, gaps in enumerate(modes - speeds**2):
        slopes, signs, points = np.diff(gaps) / steps, np.sign(gaps), dict(zip(speeds, gaps, strict=True))
        right, left = gaps[1:-2] + slopes[:-2] * steps[1:-1], gaps[2:-1] - slopes[2:] * steps[1:-1]
        inside = np.array([gaps[2:-1], -right, -left]) * signs[1:-2]
        for i in 1 + np.flatnonzero((inside > 0).all(axis=0)):
            ends, args = speeds[i : i + 2], (rotor, A, k, signs[i])
            turn = minimize_scalar(_gap, bounds=ends, args=args, options={"xatol": 1e-7 * ends[1]})
            points[turn.x] = signs[i] * turn.fun
        for (a, one), (b, other) in itertools.pairwise(sorted(points.items())):
            if (one > 0) != (other > 0):
                brackets.append((b, a, k))
    return math.sqrt(modes[0, 0]), sorted(brackets)


def _positive(pencil: Pencil, n: int, top: float = 0.0) -> Spectrum:
    """Modes of positive mass, ascending: n at least, and one above the square `top`, as far as there are."""
    finite, m = finite_modes(pencil), n
    while True:
        spectrum = lowest_modes(pencil, min(m, finite))
        negative = np.count_nonzero(spectrum.squares < 0)
        if m >= finite or (m - negative >= n and spectrum.squares.max() > top):
            if not negative:
                return spectrum
            return spectrum.only(spectrum.squares.argsort(kind="stable")[negative:])
        m = 2 * m + 2


@holding_arrays
class Pencil:
    """Bands of stiffness and mass, and what is kept beyond them.

    Attributes
    ----------
    rotor, matrices
        What it describes.
    stiffness, mass
        Upper bands, shape (width + 1, size); Hermitian, the stiffness not negative.
    shaft
        All unknowns of the shaft, shape (w, size of its matrices): forward and backward.
    springs
        Unknowns that each acts on, and its stiffness matrix of these.
    hold
        Sum of the springs, N/m, tilting springs as such at the end of the rotor.
    rigid
        Motions that strain nothing, shape (size, r).
    """

    rotor: Rotor
    matrices: Matrices
    stiffness: AnyArray
    mass: AnyArray
    shaft: IndexArray
    springs: list[tuple[IndexArray, AnyArray]]
    hold: float
    rigid: AnyArray

    @property
    def waves(self) -> IndexArray:
        """Unknowns of the shaft that are deflections, shape (w, N)."""
        return self.shaft[:, :: self.matrices.stride]

    def energy(self, X: AnyArray) -> AnyArray:
        """Xᴴ K X, shape (m, m), summed from strains: few digits are lost."""
        S = [strains(self.rotor, X[unknowns]).reshape(-1, X.shape[1]) for unknowns in self.shaft]
        parts = [s.conj().T @ s for s in S] + [(v := X[u]).conj().T @ k @ v for u, k in self.springs]
        return np.asarray(sum(parts))


def one_plane(rotor: Rotor, A: Matrices, whirl: int = 0, springs: Iterable[tuple[int, float]] = ()) -> Pencil:
    """Pencil of one plane on springs, in the place of the stiffness of the supports; `whirl` 1 is forward.

    Parameters
    ----------
    rotor, A
        The rotor and its matrices.
    whirl
        1 forward, −1 backward, 0 without gyroscopic moments.
    springs
        Node and N/m of each.

    Returns
    -------
    Stiffness and mass of the plane.
    """
    return _pencil(rotor, A, (whirl,), [(node, k, 0.0, None) for node, k in springs])


def whole_rotor(rotor: Rotor, A: Matrices, speed: float = 0.0) -> Pencil:
    """Pencil of the synchronous conservative rotor with all its supports as they are at a speed.

    The forward wave where the supports are rotationally symmetric, else both.

    Parameters
    ----------
    rotor, A
        The rotor and its matrices.
    speed
        rad/s, at which tables of supports are read.

    Returns
    -------
    Stiffness and mass.
    """
    held = []
    for support in rotor.supports:
        k = support.stiffness
        (xx, xy), (yx, yy) = ((k, 0.0), (0.0, k)) if support.plain else support.at(speed)[0].tolist()
        # Antisymmetric stiffness does work over an orbit, as damping does: no conservative rotor has it.
        cross = xy + yx
        held.append((support.node, (xx + yy) / 2, (xx - yy + (cross and 1j * cross)) / 2, support.pedestal))
    return _pencil(rotor, A, (1,) if rotor.symmetric else (1, -1), held)


def _pencil(
    rotor: Rotor,
    A: Matrices,
    whirls: Sequence[int],
    supports: Iterable[tuple[int, float, complex, Pedestal | None]],
) -> Pencil:
    """Pencil on springs: node, stiffness of each wave, force on the forward of the backward one, pedestal."""
    planes = len(whirls)
    springs: list[tuple[IndexArray, AnyArray]] = []
    held = [support for support in supports if support[1] or support[2]]
    forms = np.array([((k, b), (b.conjugate(), k)) for _, k, b, _ in held]).reshape(-1, 2, 2)
    forms, kind = forms[:, :planes, :planes], forms.dtype
    bands = np.zeros((2, planes * A.size, planes * A.width + 1), kind).transpose(0, 2, 1)
    for wave, whirl in enumerate(whirls):
        bands[:, ::planes, wave::planes] = A.shaft, A.mass - whirl * A.gyroscopic
    # Waves alternate, and a foot stands behind the deflection of its node.
    feet = [A.deflection(node) + 0.5 for node, *_, stand in held if stand]
    places = np.arange(planes * A.size).reshape(-1, planes).T
    if feet:
        ranks = np.append(np.arange(A.size), feet).argsort(kind="stable").argsort()
        places = planes * ranks + np.arange(planes)[:, None]
        moved, reach = places[:, : A.size].T.ravel(), planes * A.width
        width = int((moved[reach:] - moved[:-reach]).max())
        narrow, bands = bands, np.zeros((2, places.size, width + 1), kind).transpose(0, 2, 1)
        for off in range(reach + 1):
            i, j = moved[: moved.size - off], moved[off:]
            bands[:, width + i - j, j] = narrow[:, reach - off, off:]
        bands[1, -1, places[:, A.size :]] = [stand.mass for *_, stand in held if stand]
    K, M = bands
    shaft, stands, hold = places[:, : A.size], iter(places[:, A.size :].T), 0.0
    for (node, *_, pedestal), form in zip(held, forms, strict=True):
        hold += form[0, 0].real
        unknowns = shaft[:, A.deflection(node)]
        if pedestal:
            foot = next(stands)
            springs.append((foot, on_waves(np.diag(pedestal.xy("stiffness")))[:planes, :planes].real))
            unknowns, form = np.append(unknowns, foot), np.kron(((1, -1), (-1, 1)), form)
        springs.append((unknowns, form))
    entries = ((u[a], u[b], k) for u, form in springs for (a, b), k in np.ndenumerate(form))
    for i, j, k in entries:
        if i <= j:
            K[i - j - 1, j] += k
    span = rotor.positions[-1]
    for support in rotor.supports:  # in the shaft's matrices already
        if support.tilting_stiffness:
            tilt = shaft[:, A.deflection(support.node) + 1]
            springs.append((tilt, support.tilting_stiffness * np.eye(planes)))
            hold += support.tilting_stiffness / span**2
    rigid = np.empty((places.size, 0))
    if planes > 1 or free_motions(rotor, {node for node, *_ in held}):
        motions = np.zeros((places.size, 2 * planes))
        for wave, row in enumerate(shaft):
            motions[row[:: A.stride], wave] = 1.0
            motions[row[:: A.stride], planes + wave] = rotor.positions / span
            motions[row[1 :: A.stride], planes + wave] = 1 / span
        # Not their work: what pushes back and what pushes outwards at one node could sum up to none.
        forces = [form @ motions[unknowns] / np.abs(form).max() for unknowns, form in springs]
        _, values, V = np.linalg.svd(np.vstack((np.zeros(2 * planes), *forces)))
        rigid = motions @ V[np.count_nonzero(values > 1e-13 * values[0]) :].conj().T
    return Pencil(rotor, A, K, M, shaft, springs, hold, rigid)


@holding_arrays
class Spectrum:
    """The lowest m modes.

    Attributes
    ----------
    squares
        λ = ω², rad²/s², those nearest to zero (beyond the shift) in ascending order, shape (m,); exactly 0
        for rigid-body modes, negative where a mode has negative mass.
    vectors
        All unknowns, scaled to |φᵀ M φ| = 1 kg, shape (size, m).
    shift
        σ ≥ 0 of the matrix K + σ M that was factored; 0 for a supported rotor.
    factor
        Cholesky factor of K + σ M as an upper band.
    rounding
        Relative error that rounding may cause in quantities linear in a mode, shape (m,). Frequencies
        suffer only by its square.
    pencil
        Whose modes they are.
    """

    squares: FloatArray
    vectors: AnyArray
    shift: float
    factor: AnyArray
    rounding: FloatArray
    pencil: Pencil

    def only(self, which: slice | IndexArray) -> Spectrum:
        """The spectrum of some of the modes."""
        vectors, rounding = self.vectors[:, which], self.rounding[which]
        return replace(self, squares=self.squares[which], vectors=vectors, rounding=rounding)

    @property
    def motion(self) -> ComplexArray:
        """Amplitudes of the unknowns of the shaft in x and y, shape (2, size, m)."""
        X = self.vectors[self.pencil.shaft]
        return (TO_XY[:, : len(X)] @ X.reshape(len(X), -1)).reshape(2, *X.shape[1:])


def finite_modes(pencil: Pencil) -> int:
    """Number of modes with finite frequency, the rank of the mass matrix.

    It is the number of unknowns that move mass, but for tilts where there is shear and no rotary inertia.
    The line w of the shaft depends on the slopes θ + γ alone: a tilt θ, with −θ as the shear angles γ beside
    it, moves no mass, and only gyroscopic moments make it count.

    Parameters
    ----------
    pencil
        Stiffness and mass.

    Returns
    -------
    Their number.
    """
    moved, model = pencil.mass[-1].copy(), pencil.rotor.model
    if model.shear and not model.rotary_inertia:
        moved[pencil.shaft[:, 1::4]] -= pencil.matrices.mass[-1, 1::4]
    return int(np.count_nonzero(moved))


def factor(pencil: Pencil) -> tuple[float, AnyArray, AnyArray]:
    """Shift σ, K + σ M and its Cholesky factor; σ = 0 if the supports hold the rotor firmly.

    Else σ is about the square of the first bending frequency of the free rotor.

    Raises
    ------
    ValueError
        If the matrix is singular, or not positive, all the same.
    """
    from scipy.linalg.lapack import dpbtrf, zpbtrf

    rotor, free = pencil.rotor, pencil.rigid.size
    mass = rotor.total_mass
    if not mass:
        raise ValueError("the rotor has no mass: give the shaft a density, or add discs")
    bending = 500 * (rotor.length @ (rotor.youngs_modulus * rotor.second_moment)) / rotor.positions[-1] ** 4
    scale = bending / mass
    pbtrf = zpbtrf if np.iscomplexobj(pencil.stiffness) else dpbtrf
    for shift in (scale,) if free else (0.0,) if pencil.hold >= 1e-3 * bending else (scale, 0.0):
        K = pencil.stiffness + shift * pencil.mass
        U, info = pbtrf(K)
        if info == 0:
            return shift, K, U
    raise ValueError(NO_MASS if free and (pencil.mass[-1] >= 0).all() else _UNSTABLE)


def lowest_modes(pencil: Pencil, m: int) -> Spectrum:
    """Lowest m modes of a pencil; m must not exceed the finite modes.

    Parameters
    ----------
    pencil
        Stiffness and mass.
    m
        How many modes.

    Returns
    -------
    Squares of frequencies, rad²/s², and shapes.

    Raises
    ------
    ValueError
        If the mesh is so fine that float64 carries fewer than about two digits of a shape.
    """
    shift, K, U = factor(pencil)
    fixed, free = pencil.rigid, pencil.rigid.shape[1]
    loads = fixed
    if free:
        G = fixed.conj().T @ multiply(pencil.mass, fixed)
        if np.linalg.cond(G) > 1e13:
            raise ValueError(NO_MASS)
        # First the translation, then the turn.
        fixed = np.linalg.solve(np.linalg.cholesky(G), fixed.conj().T).conj().T
        loads = multiply(pencil.mass, fixed)
    # Ritz vectors of energies that are exact mend what rounding of K did; rigid motions are exact already.
    elastic = max(m - free, 0)
    moving, pushed = _vectors(pencil, U, elastic, loads)
    mu, Y = _largest(moving.conj().T @ pushed, elastic, pencil.energy(moving))
    X = moving @ (Y / np.sqrt(abs(mu)))
    if free:
        X, mu = np.hstack((fixed, X))[:, :m], np.append(np.full(free, np.inf), mu)[:m]
    squares = 1 / mu
    if shift:  # the softest beside stiff ones
        squares = np.sign(mu) * pencil.energy(X).diagonal().real * (np.arange(m) >= free)
    rounding = rounding_error(K, X, abs(squares + shift))
    if max(rounding, default=0.0) > 1e-2:
        raise ValueError(
            f"the mesh of {pencil.rotor.n_elements} elements is too fine for float64: join neighbouring "
            "elements, 50 to 200 are ample for a rotor"
        )
    return Spectrum(squares, X, shift, U, rounding, pencil)


def fine_mesh_warning(rotor: Rotor, rounding: FloatArray) -> tuple[str, ...]:
    """A sentence where fewer than six digits are sure."""
    worst = max(rounding, default=0.0)
    if worst < 1e-6:
        return ()
    return (
        f"the mesh is fine for float64 ({rotor.n_elements} elements): rounding may change mode shapes and "
        f"responses by {worst:.0e} of their size",
    )


def _largest(T: AnyArray, m: int, energy: AnyArray | None = None) -> tuple[FloatArray, AnyArray]:
    """The m eigenvalues of largest size of a Hermitian matrix, and their vectors of length, or energy, 1."""
    from scipy.linalg.lapack import dormqr, dstev, dsygv, dsytrd, zhegv

    real, info = np.isrealobj(T), 1
    if energy is not None:
        mu, Q, info = (dsygv if real else zhegv)(T, energy)
        if info:
            raise ValueError(_UNSTABLE)
    elif real:  # tridiagonal first, large entries ahead: the largest need but its first rows
        packed, d, e, tau, _ = dsytrd(T, lower=True)
        rows = min(2 * m + 8, d.size)
        mu, V, info = dstev(d[:rows], e[: rows - 1])
        others = math.hypot(*d[rows:].tolist(), *e[rows - 1 :].tolist())
        if others:
            least, mu, V = mu[0], mu[-m:], V[:, -m:]
            info = info or max(-least, 20 * others, 1e13 * others * max(map(abs, V[-1]))) > mu[0]
        Q = np.zeros((d.size, mu.size), order="F")
        Q[:rows] = V
        Q[1:] = dormqr("L", "N", packed[1:, : rows - 1], tau[: rows - 1], Q[1:], T.size)[0]
    if info:
        mu, Q = np.linalg.eigh(T)
    order = (-abs(mu)).argsort(kind="stable")[:m]
    return mu[order], Q[:, order]


def _vectors(pencil: Pencil, U: AnyArray, m: int, rigid: AnyArray) -> tuple[AnyArray, AnyArray]:
    """U⁻¹ times eigenvectors of U⁻ᴴ M U⁻¹ of the largest eigenvalues, and M times these.

    They are m, and one that may be less exact; none of them is a rigid motion: `rigid` is M times these.
    """
    from scipy.linalg import blas, lapack

    tbtrs, trsm = (lapack.dtbtrs, blas.dtrsm) if np.isrealobj(U) else (lapack.ztbtrs, blas.ztrsm)
    size, block = pencil.mass.shape[1], 4  # equal frequencies are not missed
    most = max(min(m + 1, finite_modes(pencil) - rigid.shape[1]), 1)

    def operator(V: AnyArray) -> AnyArray:
        W = tbtrs(U, V)[0]
        loads = multiply(pencil.mass, W) - rigid @ (rigid.conj().T @ W)
        return np.asarray(tbtrs(U, loads, trans="C")[0])

    if size > DENSE:
        # Smooth loads, which differ from one to the other wave.
        s = np.linspace(1, 2, size) * (1 + np.arange(size) % len(pencil.shaft))
        V = np.linalg.qr(operator(operator(np.cos(np.outer(s, np.arange(block))))))[0]
        basis = image = np.empty((size, 0), U.dtype)
        residual = np.inf
        while basis.shape[1] < size // 2:
            Z = operator(V)
            basis, image = np.hstack((basis, V)), np.hstack((image, Z))
            for _ in range(2):
                Z = Z - basis @ (basis.conj().T @ Z)
            V, beta = np.linalg.qr(Z)
            if basis.shape[1] < 2.5 * m + 6:
                continue
            mu, Q = _largest(basis.conj().T @ image, most)
            # What the operator adds outside the basis; on fine meshes rounding stops it before the tolerance.
            outside = np.linalg.norm(beta @ Q[-block:, :m], axis=0) / abs(mu[:m])
            last, residual = residual, outside.max(initial=0.0)
            if residual < 1e-9 or last / 3 < residual < 1e-5:
                X = tbtrs(U, image @ Q)[0]
                return X, multiply(pencil.mass, X)
    M, R = dense(pencil.mass), dense(U)  # the triangle above the diagonal of R counts
    half = trsm(1.0, R, M - rigid @ rigid.conj().T if rigid.size else M, trans_a=2)
    X = tbtrs(U, _largest(trsm(1.0, R, half, side=1, overwrite_b=True), most)[1])[0]
    return X, M @ X
