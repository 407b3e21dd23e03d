"""Critical speeds of the undamped rotor."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fem.matrices.banded_matrices import Matrices, assemble, ignored_inertia
from fem.matrices.undamped_matrices import TO_XY, whole_rotor
from fem.model.rotor import Rotor, whole
from fem.modes_result import Modes
from fem.solvers.eigen import fine_mesh_warning, finite_modes
from fem.solvers.table_crossings import Found, TableSearch, positive_modes
from rotorid.base.arrays import AnyArray, FloatArray

_LINE = 1e-6  # relative difference of forward and backward amplitude below which an orbit is a line
_USUAL = 3  # critical speeds, where nothing else is asked for
_FEW, _MANY = 4, 32  # looked for at first; over tables all are found at once, however many are asked for
_NAMED = 5  # critical speeds beyond the end of a list that are named
_SECANTS, _SAME = 12, 1e-12  # steps that follow a critical speed, and a step that is none
NOT_COUNTED = "critical speeds below the tables are not known, nor counted"
_SLOW = 1e-6  # of the last speed of the tables: no motion of a rotor is slower, but as a rigid body


def critical_speeds(rotor: Rotor, n: int | None = None) -> Modes:
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
        return lowest_critical_speeds(rotor, _USUAL)
    asked = whole(n, "the number of critical speeds")
    return lowest_critical_speeds(rotor, asked, asked)


def lowest_critical_speeds(rotor: Rotor, most: int, least: int = 1) -> Modes:
    """`critical_speeds`: the `most` lowest, or all there are, where there are not fewer than `least`."""
    A = assemble(rotor)
    said: tuple[str, ...] = ()
    cut = ""
    if rotor.constant:
        pencil = whole_rotor(rotor, A)
        rigid = pencil.rigid.shape[1]
        available = finite_modes(pencil)
        available = max(available - rigid, min(available, 1))
        _check_number(least, available)
        found = positive_modes(pencil, min(most, available) + rigid)
        thin = " (discs whose polar inertia exceeds the diametral one take some away)"
        _check_number(least, found.squares.size - rigid, thin)
        parts = [found.only(slice(0, most + rigid))]
    else:
        _check_number(most, most)
        parts, said, cut = _over_speed(rotor, A, most)
    return replace(_modes(rotor, parts, said), cut=cut)


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
    n = _FEW if rotor.constant else _MANY
    while True:
        found = np.sort(lowest_critical_speeds(rotor, n).frequencies)
        if found.size < n or found[-1] > top or n >= most:
            return np.asarray(found[(found > 0) & (found <= top)])
        n *= 2


def critical_speeds_near(rotor: Rotor, speeds: FloatArray) -> FloatArray:
    """Critical speeds of a rotor that differs little from one with these, rad/s, each followed by secants.

    Parameters
    ----------
    rotor
        The other rotor.
    speeds
        rad/s, shape (n,); 0 of a rigid-body motion stays.

    Raises
    ------
    ValueError
        Where one leaves the bearing tables, or does not come to rest.
    """
    A = assemble(rotor)

    def gap(speed: float) -> float:
        """λ − Ω² of the mode nearest to the speed."""
        squares = positive_modes(whole_rotor(rotor, A, speed), 1, speed * speed).squares
        return float(squares[np.argmin(np.abs(squares - speed * speed))]) - speed * speed

    def followed(speed: float) -> float:
        before, now = gap(speed), speed
        speed = float(np.sqrt(now * now + before))
        for _ in range(_SECANTS):
            if abs(speed - now) <= _SAME * speed:
                return speed
            here = gap(speed)
            step = here * (speed - now) / (here - before) if here != before else 0.0
            before, now, speed = here, speed, speed - step
        raise ValueError(f"the critical speed near {speed:.6g} rad/s cannot be followed")

    return np.array([followed(speed) if speed > 0 else 0.0 for speed in speeds.tolist()])


def _check_number(n: int, available: int, reason: str = "") -> None:
    if not 1 <= n <= available:
        raise ValueError(
            f"{n} critical speeds cannot be found: the model has 1 to {available}{reason}; "
            "choose n in this range, or divide the shaft into more elements"
        )


def _over_speed(rotor: Rotor, A: Matrices, n: int) -> tuple[list[Found], tuple[str, ...], str]:
    """The n lowest intersections of natural frequency and speed, over the range of all bearing tables.

    There may be fewer, which warnings say, or more, which comes last.
    """
    tables = [support.speeds for support in rotor.supports if support.speeds]
    first, last = max(table[0] for table in tables), min(table[-1] for table in tables)
    if first >= last:
        raise ValueError("the tables of the supports have no speed in common: extend them")
    knots = [knot for knot in rotor.knots.tolist() if first <= knot <= last]
    search = TableSearch(rotor, A)
    slow = [value for value in np.sqrt(search.at(last).squares).tolist() if 0 < value < _SLOW * last]
    if slow:
        raise ValueError(
            f"a natural frequency of {slow[0]:.3g} rad/s beside speeds up to {last:.6g} rad/s: masses or "
            "moments of inertia, or stiffnesses of supports, differ by too many orders of size"
        )
    found = [root for a, b in itertools.pairwise(knots) for root in search.between(a, b)]
    below = search.below(first)
    if not found:
        at = first if below else last
        raise ValueError(
            f"no critical speed lies between {first:.6g} and {last:.6g} rad/s, where the bearing tables "
            f"hold; the first natural frequency at {at:.6g} rad/s is "
            f"{np.sqrt(search.at(at).squares[0]):.6g} rad/s: extend the tables"
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
            f"{np.sqrt(search.at(first).squares[0]):.6g} rad/s: {NOT_COUNTED}",
        )
    result = []
    for speed, k in found[:n]:
        mode = search.at(speed).only(slice(k, k + 1))
        result.append(replace(mode, squares=np.array([speed * speed])))
    return result, warnings, _cut([speed for speed, _ in found], n)


def _cut(speeds: Sequence[float], n: int) -> str:
    """A sentence if a list of critical speeds, rad/s, was cut after n."""
    if len(speeds) <= n:
        return ""
    more = ", ".join(f"{speed:.6g}" for speed in speeds[n : n + _NAMED])
    rest = len(speeds) - n
    return (
        f"the list is cut: {rest} more critical {'speed lies' if rest == 1 else 'speeds lie'} in this range, "
        f"at {more}{' …' if rest > _NAMED else ''} rad/s; -n {len(speeds)} lists all"
    )


def _modes(rotor: Rotor, found: list[Found], said: tuple[str, ...]) -> Modes:
    squares = np.concatenate([part.squares for part in found])
    rounding = np.concatenate([part.rounding for part in found])
    warnings = said + ignored_inertia(rotor) + fine_mesh_warning(rotor, rounding)
    rigid = int(np.count_nonzero(squares == 0))
    if rigid:
        motions = "motion" if rigid == 1 else "motions"
        warnings += (
            f"the supports leave {rigid} rigid-body {motions} of the rotor free; "
            f"{'it comes' if rigid == 1 else 'they come'} first, with speed 0, beside the critical speeds "
            "asked for",
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


def _shapes(part: Found) -> tuple[FloatArray, FloatArray, AnyArray, AnyArray, list[str]]:
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
