"""Campbell diagram: whirl frequencies and decrements over speed, and the damped critical speeds.

Modes of neighbouring speeds are the same where their states (u, λ u / |λ|) are alike: MAC in the energy of
the basis, in which vectors have length 1, and the best assignment of all (`linear_sum_assignment`).
Velocities tell apart forward and backward whirl of one shape. A step in which a mode is hardly like itself is
halved; so is one beside which a frequency comes so near to the speed that it may cross the 1× line twice.
Crossings are roots on the mode itself, which inverse iteration follows from the nearer end of the step; where
it slips to another mode the step is halved, too.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fem.assembly import both_planes
from fem.orbits import DIRECTION_NAMES
from fem.parameters import nearest_modes
from fem.result import Result, holding_arrays
from fem.rotor import Rotor, refined
from fem.stability import (
    Window,
    grid_of,
    near_level,
    roots,
    unstable_windows,
    within,
)
from fem.whirl import (
    NONE,
    Whirl,
    available_modes,
    checked_number,
    decrements_of,
    missing_modes,
    polish,
    solve_whirl,
    whirling,
)
from rotorid.base.arrays import (
    AnyArray,
    BoolArray,
    ComplexArray,
    FloatArray,
    IndexArray,
    checked_speeds,
    whole,
)
from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, listing, range_text

HEAVY = 1.28
"""Logarithmic decrement at an amplification factor of 2.5: critically damped after API 684, no peak."""
_ALIKE = 0.8  # MAC of a mode with itself a step further
_NEARER = 3.0  # times as far as from itself, in 1 − MAC, a mode is from every other one
_HARDLY = 0.3  # MAC below which two modes are not one
_ITSELF = 0.999  # product of shapes above which two searches ended at one mode
_NARROW = 1e-4  # of the highest speed: steps that are not halved
_DENSE = 8  # times the speeds asked for: so many are computed at most
_SWINGS = 14.0  # log decrement above which a critical speed has no meaning
_VANISHES = 1e-8  # |f| at a root, of the speed
_PAIR = 1e-6  # relative distance of forward and backward whirl that start together, as at rest


@holding_arrays
class Campbell(Result):
    """Whirl over speed; each column is one mode, followed through crossings.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    frequencies
        |Im λ|, rad/s, shape (S, n); NaN where a mode does not oscillate.
    log_decrements
        −2π Re λ / |Im λ|, shape (S, n); negative: unstable.
    direction
        1 forward, −1 backward, 0 neither (a line, or different along the rotor), shape (S, n).
    critical_speeds
        Damped critical speeds, where a frequency equals the speed, rad/s, ascending, shape (c,); not those of
        motions that hardly oscillate (log decrement above 14).
    critical_modes
        Which column (from 1) each belongs to, shape (c,).
    critical_log_decrements, critical_direction
        There, shape (c,).
    error
        Estimated relative error of the eigenvalues.
    rotor
        The rotor.
    warnings
        What the reader must know.
    unstable
        Those of `windows` in which a mode that is listed grows first, with its number in the list.
    windows
        Ranges of speed in which any mode grows, listed or not.
    cut
        What the list of critical speeds leaves out because only n modes were asked for; else empty.
    std
        Standard deviations of `frequencies`, from the calibration of the rotor; None without.
    heavy
        Logarithmic decrement above which a mode is heavily damped: such modes are listed only where there are
        fewer others, and drawn pale.
    """

    speeds: FloatArray
    frequencies: FloatArray
    log_decrements: FloatArray
    direction: FloatArray
    critical_speeds: FloatArray
    critical_modes: IndexArray
    critical_log_decrements: FloatArray
    critical_direction: FloatArray
    error: float
    rotor: Rotor
    warnings: tuple[str, ...] = ()
    unstable: tuple[Window, ...] = ()
    windows: tuple[Window, ...] = ()
    cut: str = ""
    std: FloatArray | None = None
    heavy: float = 6.0

    @property
    def eigenvalues(self) -> ComplexArray:
        """λ with Im λ > 0, rad/s, shape (S, n)."""
        return self.frequencies * (1j - self.log_decrements / (2 * np.pi))

    @property
    def criticals(self) -> list[tuple[float, float]]:
        """Damped critical speed, rad/s, and logarithmic decrement there, of each."""
        return list(zip(self.critical_speeds.tolist(), self.critical_log_decrements.tolist(), strict=True))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid campbell`; one list per mode."""
        errors = {} if self.std is None else {"frequencies_std_rad_s": self.std.T}
        criticals = self.tables()[0]
        keys = [column.key.rpartition(".")[2] for column in criticals.columns]
        return plain(
            {
                "speeds_rad_s": self.speeds,
                "frequencies_rad_s": self.frequencies.T,
                **errors,
                "log_decrements": self.log_decrements.T,
                "direction": _words(self.direction, self.frequencies).T,
                "damped_critical_speeds_rad_s": self.critical_speeds,
                "damped_critical_speeds": [dict(zip(keys, row, strict=True)) for row in criticals.rows],
                "damped_critical_speeds_cut": self.cut or None,
                "unstable": [self._growing(window) for window in self.unstable],
                "unstable_speeds": [window.to_dict() for window in self.windows],
                "warnings": self.warnings,
            }
        )

    def _growing(self, window: Window) -> dict[str, Any]:
        inside = within((window,), self.speeds)
        return {
            "mode": window.mode,
            "speed_rad_s": window.first,
            "speed_rpm": window.first * RPM,
            "from_start": not window.begins,
            "last_speed_rad_s": self.speeds[inside][-1],
            "end_rad_s": window.last if window.ends else None,
            "frequency_rad_s": window.frequency,
            "direction": window.way,
            "lowest_log_decrement": np.nanmin(self.log_decrements[inside]),
        }

    def tables(self) -> tuple[Table, ...]:
        """The damped critical speeds; and the modes at each speed."""
        at, decrements = "damped_critical_speeds.*.", self.critical_log_decrements
        criticals = (
            Column("mode", self.critical_modes, key=at + "mode"),
            Column("whirl", _words(self.critical_direction, self.critical_speeds), key=at + "direction"),
            Column("rpm", self.critical_speeds * RPM, "{:.2f}".format, at + "speed_rpm"),
            Column("rad/s", self.critical_speeds, "{:.4f}".format, at + "speed_rad_s"),
            Column("log dec", decrements, "{:z.4f}".format, at + "log_decrement"),
            Column("", decrements > HEAVY, f"no peak: above {HEAVY}".__mul__, at + "heavily_damped"),
        )
        S, n = self.frequencies.shape
        modes = (
            Column("speed_rad_s", np.repeat(self.speeds, n), "{:.4f}".format),
            Column("mode", np.tile(np.arange(1, n + 1), S)),
            Column("frequency_rad_s", self.frequencies.ravel(), "{:.4f}".format),
            *(Column("frequency_std_rad_s", std.ravel()) for std in (self.std,) if std is not None),
            Column("log_decrement", self.log_decrements.ravel(), "{:z.4f}".format),
            Column("direction", _words(self.direction, self.frequencies).ravel()),
        )
        return (Table("damped critical speeds", criticals), Table("modes", modes))

    def sentence(self) -> str:
        """Whether it is stable, and how many damped critical speeds there are."""
        unstable = listing([window.where() for window in self.windows], "and")
        text = f"UNSTABLE {unstable}: a motion grows there" if unstable else "Stable: no motion grows"
        heavy = int((self.critical_log_decrements > HEAVY).sum())
        light = self.critical_speeds.size - heavy
        count = counted(light, "damped critical speed") if light else "No damped critical speed"
        more = f", {heavy} more without a peak" if heavy else ""
        return f"{text}. {count}{more} from {range_text(self.speeds[0], self.speeds[-1])}."

    def mesh_change(self) -> tuple[float, float]:
        """Largest relative change of frequencies and of damped critical speeds on elements cut in two.

        Of frequencies with decrements up to `heavy`. Elements converge as h⁴: 16/15 of it is the error of the
        mesh.
        """
        fine = campbell(refined(self.rotor, 2), self.speeds, self.frequencies.shape[1], heavy=self.heavy)
        frequencies = nearest_modes(self.frequencies, fine.frequencies)
        change = np.where(self.log_decrements <= self.heavy, abs(frequencies / self.frequencies - 1), 0.0)
        apart = abs(fine.critical_speeds / self.critical_speeds[:, None] - 1).min(axis=1, initial=np.inf)
        return float(np.nanmax(change)), float(apart.max(initial=0.0))


def campbell(rotor: Rotor, speeds: ArrayLike, n: int | None = None, *, heavy: float = 6.0) -> Campbell:
    """Compute whirl frequencies, logarithmic decrements and directions over speed.

    Modes are followed from speed to speed by the likeness of their complex shapes (MAC), with smaller steps
    between the given speeds where it leaves a doubt. The n modes are those that meet the 1× line first, then
    those of the lowest frequency on the whole; they are numbered by frequency at the first speed, backward
    before forward where a pair coincides. Modes that are heavily damped at more than half of the speeds come
    last. Where a curve crosses the 1× line between two speeds, the crossing is found by iteration on the
    model.

    Parameters
    ----------
    rotor
        The rotor with all its supports.
    speeds
        rad/s, ascending, shape (S,).
    n
        How many modes, by default 6; forward and backward whirl count apart. Where the model has fewer, all.
    heavy
        Logarithmic decrement above which a mode is heavily damped.

    Raises
    ------
    ValueError
        If speeds are impossible or outside the table of a support, the mesh is too fine for float64, or the
        rotor is pushed aside by negative stiffness at every speed.
    """
    speeds = checked_speeds(speeds, ascending=True)
    asked_for = checked_number(rotor, None) if n is None else whole(n, "the number of modes")
    n = checked_number(rotor, min(asked_for, available_modes(rotor)))
    paths, (there, modes, values, vectors) = _followed(rotor, grid_of(rotor, speeds), n, heavy)
    whirl, asked = paths.whirl, np.searchsorted(paths.speeds, speeds)
    if not paths.values.size:
        raise ValueError("the rotor has no oscillating mode at these speeds: all motions are overdamped")
    windows = unstable_windows(whirl, speeds)
    lam, direction = whirling(whirl.Q, paths.values[asked], paths.vectors[asked])
    values, ways = whirling(whirl.Q, values, vectors)
    listed, decrements = {}, decrements_of(lam)
    for window in windows:
        k = int(np.searchsorted(speeds, window.first))
        apart = np.where(decrements[k] < 0, abs(lam[k].imag - (window.frequency or np.nan)), np.nan)
        if not np.isnan(apart).all():
            listed[window] = replace(window, mode=int(np.nanargmin(apart)) + 1)
    texts = [listed.get(window, window).sentence() for window in windows]
    return Campbell(
        speeds=speeds,
        frequencies=lam.imag,
        log_decrements=decrements,
        direction=direction,
        critical_speeds=there,
        critical_modes=modes + 1,
        critical_log_decrements=decrements_of(values),
        critical_direction=ways,
        error=whirl.error,
        rotor=rotor,
        warnings=(*texts, *_warnings(paths, asked_for, np.isnan(lam))),
        unstable=tuple(listed.values()),
        windows=windows,
        cut=_cut(paths),
        heavy=heavy,
    )


@holding_arrays
class _Paths:
    """The modes listed, over speeds (S,) in the basis of `whirl`.

    λ, shape (S, n), NONE where a mode is missing, and vectors (S, n, R); `doubtful`, shape (S − 1, n): in
    which steps shapes do not tell a mode apart from others; λ of the `others` that were followed, (S, c − n).
    """

    whirl: Whirl
    speeds: FloatArray
    values: ComplexArray
    vectors: ComplexArray
    doubtful: BoolArray
    others: ComplexArray


_Crossings = tuple[FloatArray, IndexArray, ComplexArray, ComplexArray]


def _crossings(paths: _Paths) -> _Crossings:
    """Speeds where modes cross the 1× line, which modes, λ and vectors; where one was lost it is in doubt."""
    f = off_synchronous(paths.values, paths.speeds)
    k, mode = np.nonzero(((f[:-1] < 0) != (f[1:] < 0)) & np.isfinite(f[:-1] * f[1:]))
    steps = np.array((k, k + 1))
    near = k + abs(f[steps, mode]).argmin(axis=0)
    value, vector = paths.values[near, mode], paths.vectors[near, mode]

    def excess(speeds: FloatArray) -> FloatArray:
        nonlocal value, vector
        value, vector = polish(paths.whirl.Q, speeds, np.arange(k.size), value, vector)
        return abs(value.imag) - speeds

    speed, rest = roots(excess, paths.speeds[steps], f[steps, mode])
    same = np.isclose(value[:, None], value, _VANISHES) & (abs(vector.conj() @ vector.T) > _ITSELF)
    lost = ~(abs(rest) <= _VANISHES * speed) | np.triu(same, 1).any(axis=0)
    paths.doubtful[k[lost], mode[lost]] = True
    order = np.lexsort((mode, np.round(speed / paths.speeds[-1], 9)))  # equal but for rounding: by mode
    order = order[~lost[order] & (decrements_of(value[order]) <= _SWINGS)]
    return speed[order], mode[order], value[order], vector[order]


def off_synchronous(lam: ComplexArray, speeds: FloatArray) -> FloatArray:
    """Whirl frequencies less the speed, of modes (S, …)."""
    return abs(lam.imag) - speeds[:, None]


def _words(direction: FloatArray, there: FloatArray) -> AnyArray:
    """Directions in words, None where there is no motion."""
    words: AnyArray = np.vectorize(DIRECTION_NAMES.get, otypes=[object])(direction)
    words[np.isnan(there)] = None
    return words


def _followed(rotor: Rotor, speeds: FloatArray, n: int, heavy: float) -> tuple[_Paths, _Crossings]:
    """Modes over speed, n (or fewer) of them listed, and their crossings."""
    P, most = both_planes(rotor), min(2 * n + 8, available_modes(rotor))
    m = min(n + n % 2 + 2, most)  # even: modes come in pairs, a forward and a backward one
    while True:
        paths, crossings = _closely(solve_whirl(P, speeds, m), n, heavy)
        light = (decrements_of(paths.values) <= heavy).mean(axis=0) >= 0.5
        if light.sum() == n or m == most:
            return paths, crossings
        m = most


def _closely(whirl: Whirl, n: int, heavy: float) -> tuple[_Paths, _Crossings]:
    """The modes of a whirl followed, with so many speeds between that nothing is in doubt."""
    speeds, values, X = whirl.speeds, whirl.values, whirl.vectors
    while True:
        paths = _chained(whirl, speeds, values, X, n, heavy)
        crossings = _crossings(paths)
        near = [near_level(np.nan_to_num(gap), 0.0) for gap in off_synchronous(paths.values, speeds).T]
        k = np.unique(np.concatenate((np.flatnonzero(paths.doubtful.any(axis=1)), *near)))
        k = k[np.diff(speeds)[k] > _NARROW * speeds[-1]]
        if not k.size or speeds.size > _DENSE * whirl.speeds.size:
            return paths, crossings
        more = whirl.at((speeds[k] + speeds[k + 1]) / 2)
        speeds = np.insert(speeds, k + 1, more.speeds)
        values, X = np.insert(values, k + 1, more.values, 0), np.insert(X, k + 1, more.vectors, 0)


def _chained(
    whirl: Whirl, speeds: FloatArray, values: ComplexArray, X: ComplexArray, n: int, heavy: float
) -> _Paths:
    """Modes of neighbouring speeds, (S, m) and (S, m, R), chained."""
    from scipy.optimize import linear_sum_assignment

    S, m = values.shape
    lam = np.nan_to_num(values, nan=1.0)[..., None]
    states = np.concatenate((X, X * lam / abs(lam)), axis=2) / np.sqrt(2)
    mac = np.nan_to_num(abs(states[:-1].conj() @ states[1:].swapaxes(1, 2))) ** 2
    partner = np.array([linear_sum_assignment(one, maximize=True)[1] for one in mac], np.intp).reshape(-1, m)
    mac = np.take_along_axis(mac, partner[:, None], axis=2)
    best, rivals = mac.diagonal(axis1=1, axis2=2), mac * (1 - np.eye(m))
    apart = 1 - np.maximum(rivals.max(axis=1), rivals.max(axis=2))
    clear = (
        (best >= _ALIKE) & (apart >= _NEARER * (1 - best))
        | (best == 0)
        | ~(decrements_of(values[:-1]) <= heavy)
    )
    labels, count = np.tile(np.arange(m), (S, 1)), m
    for k, mine in enumerate(partner):
        # What is hardly alike is another mode that came while this one went.
        new = best[k] < _HARDLY
        labels[k + 1, mine] = np.where(new, count + np.cumsum(new) - 1, labels[k])
        count += int(new.sum())
    rows = np.arange(S)[:, None]
    paths, vectors = np.full((S, count), NONE), np.full((S, count, X.shape[2]), NONE)
    doubtful: BoolArray = np.zeros((S - 1, count), dtype=bool)
    paths[rows, labels], vectors[rows, labels], doubtful[rows[:-1], labels[:-1]] = values, X, ~clear
    listed = _choice(speeds, paths, n, heavy)
    others = np.delete(paths, listed, axis=1)
    return _Paths(whirl, speeds, paths[:, listed], vectors[:, listed], doubtful[:, listed], others)


def _choice(speeds: FloatArray, values: ComplexArray, n: int, heavy: float) -> IndexArray:
    """The n lowest modes, by frequency at the first speed, backward first where a pair starts as one.

    Lowest are those that meet the 1× line first (or are below it from the start), so that no damped critical
    speed is left out below that of another; then those of the lowest frequency on the whole. Those
    that are heavily damped at half of the speeds, and where they cross the line, come last.
    """
    light, there = decrements_of(values) <= heavy, np.isfinite(values)
    size = np.where(there, abs(values.imag), 1e9 * speeds[-1])
    gap = size - speeds[:, None]
    below = light & (gap <= 0)
    below[1:] |= light[:-1] & (gap[1:] <= 0)  # lightly damped before, or after
    steps = [slice(max(k - 1, 0), k + 1) for k in below.argmax(axis=0)]
    first = [np.interp(0.0, -one[step], speeds[step]) for one, step in zip(gap.T, steps, strict=True)]
    meets = np.where(below.any(axis=0), first, np.inf)
    last = (light.mean(axis=0) < 0.5) & np.isinf(meets)
    begins = there.argmax(axis=0)
    start = values[begins, np.arange(begins.size)].imag  # in a complex coordinate negative of backward whirl
    start = abs(start) * (1 + _PAIR * (start > 0))
    best = np.lexsort((start, size.mean(axis=0), meets, last))[:n]
    best = best[there[:, best].any(axis=0)]
    return best[np.lexsort((start[best], begins[best]))]


def _cut(paths: _Paths) -> str:
    """A warning where modes that are not listed have critical speeds in the range, or may have."""
    speeds, lam = paths.speeds, paths.others
    f = np.where(decrements_of(lam) <= _SWINGS, off_synchronous(lam, speeds), np.nan)
    computed = np.fmax.reduce(abs(np.hstack((paths.values, lam)).imag), axis=1)
    more = (f[:-1] * f[1:] < 0).any(axis=1) | (computed < speeds)[1:]
    if not (lam.size and more.any()):
        return ""
    return (
        f"the list of critical speeds is cut: from {speeds[more.argmax()]:.6g} rad/s on modes that are not "
        "listed have more, or may have; ask for more modes (-n)"
    )


def _warnings(paths: _Paths, n: int, gone: BoolArray) -> tuple[str, ...]:
    """Warnings of the modes listed; `gone`, shape (S, n): where they do not oscillate."""
    texts = [
        f"mode {mode + 1} does not oscillate (or above the frequencies computed) at {column.sum()} of "
        f"{column.size} speeds"
        for mode, column in enumerate(gone.T)
        if column.any()
    ]
    texts += missing_modes(np.zeros(0), int(paths.whirl.still.max()), gone.shape[1], n)
    if paths.doubtful.any():
        first = paths.speeds[paths.doubtful.any(axis=1).argmax()]
        texts.append(f"modes could not be told apart by shape above {first:.6g} rad/s: two may be exchanged")
    return tuple(texts)
