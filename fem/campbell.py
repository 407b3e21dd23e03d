"""Campbell diagram: whirl frequencies and decrements over speed, and the damped critical speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from fem.campbell_modes import followed_closely, runs_away, swings, went_above
from fem.growth import Growing, growing, joined
from fem.growth_check import growth_bound, judge
from fem.mesh import refined
from fem.model.rotor import Rotor, whole
from fem.orbits import DIRECTION_NAMES, whirl_direction
from fem.parameter_bands import nearest_modes
from fem.solvers.crossing import crossings, off_synchronous
from fem.solvers.mode_tracking import Followed
from fem.solvers.reduced_whirl import Whirl
from fem.solvers.stable_speeds import GROWTH
from fem.whirl import available_modes, checked_number, in_both_planes
from fem.windows import Window, within
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import AnyArray, ComplexArray, FloatArray, IndexArray
from rotorid.base.checks import checked_speeds
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import RPM, range_text, rpm_text
from rotorid.base.tables import Column as Told
from rotorid.base.tables import Table
from rotorid.base.text import counted, listing

if TYPE_CHECKING:
    import pandas as pd

HEAVY = 1.28  # log decrement at an amplification factor of 2.5: critically damped after API 684
_EQUAL = 1e-10  # relative difference of speeds below which rounding alone would sort two modes
_NAMED = 5  # critical speeds that a warning names


@dataclass(frozen=True, eq=False)
class Campbell(Answered):
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
        Modes that grow at some of the speeds, and from which speed on, by that speed.
    windows
        Ranges of speed in which any mode grows, listed or not.
    cut
        What the list of critical speeds leaves out because only n modes were asked for; else empty.
    std
        Standard deviations of `frequencies`, from the calibration of the rotor; None without.
    heavy
        Logarithmic decrement above which a mode is heavily damped.
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
    unstable: tuple[Growing, ...] = ()
    windows: tuple[Window, ...] = ()
    cut: str = ""
    std: FloatArray | None = None
    heavy: float = 6.0

    @property
    def eigenvalues(self) -> ComplexArray:
        """λ with Im λ > 0, rad/s, shape (S, n)."""
        return np.asarray(self.frequencies * (1j - self.log_decrements / (2 * np.pi)))

    @property
    def criticals(self) -> list[tuple[float, float]]:
        """Damped critical speed, rad/s, and logarithmic decrement there, of each."""
        return list(zip(self.critical_speeds.tolist(), self.critical_log_decrements.tolist(), strict=True))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid campbell`; one list per mode."""
        own = {} if self.std is None else {"frequencies_std_rad_s": self.std.T}
        return plain(
            {
                "speeds_rad_s": self.speeds,
                "frequencies_rad_s": self.frequencies.T,
                **own,
                "log_decrements": self.log_decrements.T,
                "direction": self._ways().T,
                "damped_critical_speeds_rad_s": self.critical_speeds,
                "damped_critical_speeds": rows(self._criticals()),
                "damped_critical_speeds_cut": self.cut or None,
                "unstable": [mode.to_dict() for mode in self.unstable],
                "unstable_speeds": [window.to_dict() for window in self.windows],
                "warnings": self.warnings,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per speed and mode."""
        S, n = self.frequencies.shape
        return frame(
            (
                Column("speed_rad_s", np.repeat(self.speeds, n)),
                Column("mode", np.tile(np.arange(1, n + 1), S)),
                Column("frequency_rad_s", self.frequencies.ravel()),
                *(Column("frequency_std_rad_s", std.ravel()) for std in (self.std,) if std is not None),
                Column("log_decrement", self.log_decrements.ravel()),
                Column("direction", self._ways().ravel()),
            )
        )

    def tables(self) -> tuple[Table, ...]:
        """The damped critical speeds; and the modes at each speed."""
        at, decrements = "damped_critical_speeds.*.", self.critical_log_decrements
        ways = [DIRECTION_NAMES[way] for way in self.critical_direction.tolist()]
        criticals = (
            Told("mode", self.critical_modes, key=at + "mode"),
            Told("whirl", ways, key=at + "direction"),
            Told("rpm", self.critical_speeds * RPM, "{:.2f}".format, at + "speed_rpm"),
            Told("rad/s", self.critical_speeds, "{:.4f}".format, at + "speed_rad_s"),
            Told("log dec", decrements, "{:z.4f}".format, at + "log_decrement"),
            Told("", decrements > HEAVY, _no_peak),
        )
        S, n = self.frequencies.shape
        modes = (
            Told("speed_rad_s", np.repeat(self.speeds, n)),
            Told("mode", np.tile(np.arange(1, n + 1), S)),
            Told("frequency_rad_s", self.frequencies.ravel()),
            *(Told("frequency_std_rad_s", std.ravel()) for std in (self.std,) if std is not None),
            Told("log_decrement", self.log_decrements.ravel()),
            Told("direction", self._ways().ravel()),
        )
        return (Table("damped critical speeds", criticals), Table("modes", modes))

    def mesh_change(self) -> tuple[float, float]:
        """Largest relative change of frequencies and of damped critical speeds on elements cut in two."""
        halved = campbell(refined(self.rotor, 2), self.speeds, self.frequencies.shape[1])
        other = nearest_modes(self.frequencies, halved.frequencies)
        light = self.log_decrements <= self.heavy
        change = np.abs(other / self.frequencies - 1)[light]
        apart = np.abs(halved.critical_speeds / self.critical_speeds[:, None] - 1).min(axis=1, initial=np.inf)
        return float(np.nanmax(change, initial=0.0)), float(apart.max(initial=0.0))

    def sentence(self) -> str:
        """Whether it is stable, and how many damped critical speeds there are."""
        return self.answer.judgement

    @property
    def answer(self) -> Answer:
        """Whether it is stable, and the damped critical speeds that show a peak."""
        unstable = listing([window.where() for window in self.windows], "and")
        said = f"UNSTABLE {unstable}: a motion grows there." if unstable else "Stable: no motion grows."
        speed, rpm, mode, decrement, whirl, mark = self._criticals()
        heavy = int((self.critical_log_decrements > HEAVY).sum())
        light = self.critical_speeds.size - heavy
        count = counted(light, "damped critical speed") if light else "no damped critical speed"
        if heavy:
            count += f", {heavy} more without a peak"
        return Answer(
            f"{said}\nFrom {range_text(self.speeds[0], self.speeds[-1])}: {count}.",
            text((mode, whirl, rpm, speed, decrement, mark), left=2) if self.critical_speeds.size else "",
            self.warnings,
            (self.cut,) if self.cut else (),
            (self._at(0), self._at(-1)),
            "whirl at both ends of the range",
        )

    def _at(self, s: int) -> str:
        """Whirl at one of the speeds."""
        columns = (
            Column("mode", range(1, self.frequencies.shape[1] + 1), str),
            Column("whirl", [word or "none" for word in self._ways()[s]], str),
            Column("rpm", self.frequencies[s] * RPM, "{:.2f}".format),
            Column("rad/s", self.frequencies[s], "{:.4f}".format),
            Column("log dec", self.log_decrements[s], _rounded),
        )
        return f"Whirl at {rpm_text(self.speeds[s])}:\n{text(columns, left=2)}"

    def _criticals(self) -> tuple[Column, ...]:
        ways = [DIRECTION_NAMES[way] for way in self.critical_direction.tolist()]
        return (
            Column("speed_rad_s", self.critical_speeds, "{:.4f}".format, "rad/s"),
            Column("speed_rpm", self.critical_speeds * RPM, "{:.2f}".format, "rpm"),
            Column("mode", self.critical_modes, str),
            Column("log_decrement", self.critical_log_decrements, _rounded, "log dec"),
            Column("direction", ways, str, "whirl"),
            Column("heavily_damped", self.critical_log_decrements > HEAVY, _no_peak, ""),
        )

    def _ways(self) -> AnyArray:
        """Directions in words, None where a mode does not oscillate, shape (S, n)."""
        words = np.full(self.direction.shape, None, dtype=object)
        for number, word in DIRECTION_NAMES.items():
            words[np.isfinite(self.frequencies) & (self.direction == number)] = word
        return words


def campbell(rotor: Rotor, speeds: ArrayLike, n: int | None = None, *, heavy: float = 6.0) -> Campbell:
    """Compute whirl frequencies, logarithmic decrements and directions over speed.

    Modes are followed from speed to speed by the likeness of their complex shapes (MAC), with smaller steps
    between the given speeds where it leaves a doubt; on rotationally symmetric supports forward and backward
    whirl are kept apart exactly. The n modes are those that meet the 1× line first, then those that are most
    often among the n of lowest frequency; they are numbered by frequency at the first speed, backward before
    forward where a pair coincides. Where a curve crosses the 1× line between two speeds, the crossing is
    found by iteration on the model.

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
    available = available_modes(rotor)
    said_of_number: tuple[str, ...] = ()
    if n is not None and whole(n, "the number of modes") > available:
        said_of_number, n = (f"the model has only {available} of {n} modes",), available
    n = checked_number(rotor, n)
    whirl, paths, columns = followed_closely(rotor, speeds, n)
    asked = np.searchsorted(whirl.speeds, speeds)
    if not columns.size:
        raise ValueError("the rotor has no oscillating mode at these speeds: all motions are overdamped")
    values, X = paths.values[:, columns], paths.vectors[:, columns]
    if all(runs_away(whirl)):
        raise ValueError(
            "the rotor on its supports is statically unstable at these speeds: a support has negative "
            "stiffness; check its sign and size"
        )
    lam, x, y = in_both_planes(values[asked], whirl.Q.nodes(X[asked]))
    gone = ~np.isfinite(lam)
    direction = np.where(gone, 0.0, whirl_direction(np.nan_to_num(x), np.nan_to_num(y)))
    frequencies = np.where(gone, np.nan, lam.imag)
    log_decrements = -2 * np.pi * lam.real / frequencies
    met = crossings(whirl, values, X, off_synchronous)
    met = met.only(swings(met.values))
    apart = np.diff(met.speeds, prepend=0.0) > _EQUAL * met.speeds
    met = met.only(np.lexsort((met.modes, np.cumsum(apart))))
    at, cx, cy = in_both_planes(met.values, met.shapes)
    unstable = growing(whirl, values, X)
    windows, said = _windows(whirl, asked, values, unstable) or judge(rotor, speeds)
    shown = np.zeros(speeds.size, dtype=bool)
    for mode in unstable:
        shown |= (speeds >= mode.speed) & (speeds <= mode.last)
    hidden = [
        text if window.mode is None else f"{text} (a mode that is not listed: ask for more)"
        for window, text in zip(windows, said, strict=False)
        if window.mode is None or (within((window,), speeds) & ~shown).any()
    ]
    hidden += said[len(windows) :]
    for array in (frequencies, log_decrements, direction, met.speeds):
        array.flags.writeable = False
    return Campbell(
        speeds=speeds,
        frequencies=frequencies,
        log_decrements=log_decrements,
        direction=direction,
        critical_speeds=met.speeds,
        critical_modes=met.modes + 1,
        critical_log_decrements=-2 * np.pi * at.real / at.imag,
        critical_direction=whirl_direction(cx, cy),
        error=whirl.error,
        rotor=rotor,
        warnings=(
            *(mode.said() for mode in unstable),
            *hidden,
            *_warnings(whirl, paths, columns, n, asked),
            *said_of_number,
        ),
        unstable=unstable,
        windows=windows,
        cut=_cut(whirl, paths, columns),
        heavy=heavy,
    )


def _windows(
    whirl: Whirl, asked: IndexArray, values: ComplexArray, listed: tuple[Growing, ...]
) -> tuple[tuple[Window, ...], tuple[str, ...]] | None:
    """As `judge`, where every mode that may grow is known and those that do are listed; else None."""
    found = whirl.found.values[asked]
    numbers = [
        np.count_nonzero(np.nan_to_num(lam.real / np.abs(lam), nan=-1.0) > GROWTH, axis=1)
        for lam in (found, values[asked])
    ]
    known = np.nanmax(np.abs(found.imag), axis=1, initial=0.0)
    bound = growth_bound(whirl.Q.P.rotor, whirl.speeds[asked])
    if (bound > known).any() or (numbers[0] > numbers[1]).any() or any(runs_away(whirl)):
        return None
    windows = joined(listed, whirl.speeds[asked])
    return windows, tuple(window.said() for window in windows)


def _cut(whirl: Whirl, paths: Followed, columns: IndexArray) -> str:
    """What to say where modes that are not listed have critical speeds in the range."""
    others = np.delete(paths.values, columns, axis=1)
    f, light = off_synchronous(others, whirl.speeds[:, None]), swings(others)
    k, _ = np.nonzero((f[:-1] * f[1:] < 0) & (light[:-1] | light[1:]))
    if k.size:
        near = ", ".join(f"{speed:.6g}" for speed in np.unique(whirl.speeds[k])[:_NAMED])
        return (
            f"the list of critical speeds is cut: modes that are not listed have {k.size} more in this "
            f"range, just above {near} rad/s; ask for more modes (-n)"
        )
    sizes = np.abs(whirl.found.values[-1].imag)
    top, last = float(np.nan_to_num(sizes).max(initial=0.0)), float(whirl.speeds[-1])
    if np.isfinite(sizes).all() and top < last and sizes.size < available_modes(whirl.Q.P.rotor):
        return (
            f"the list of critical speeds may be cut: the modes followed reach {top:.6g} rad/s only at "
            f"{last:.6g} rad/s; ask for more modes (-n)"
        )
    return ""


def _warnings(
    whirl: Whirl, paths: Followed, columns: IndexArray, n: int, asked: IndexArray
) -> tuple[str, ...]:
    texts = []
    values, speeds = paths.values[asked][:, columns], whirl.speeds[asked]
    gone = ~np.isfinite(values)
    above = went_above(whirl, paths, columns)[asked]
    for said, cells in (
        ("does not oscillate (overdamped)", gone & ~above),
        ("was not found (overdamped, or above the frequencies computed)", above),
    ):
        for k in np.flatnonzero(cells.any(axis=0)):
            where = speeds[cells[:, k]]
            texts.append(
                f"mode {k + 1} {said} at {where.size} of {counted(speeds.size, 'speed')}, "
                f"from {where[0]:.6g} to {where[-1]:.6g} rad/s"
            )
    if columns.size < n:
        texts.append(f"only {columns.size} of {n} modes oscillate, the others are overdamped")
    rigid = whirl.found.still // 2
    if rigid.any():
        texts.append("rigid-body motions that nothing holds (eigenvalue 0) are left out")
    doubtful = sorted({k for k, mode in paths.doubtful if mode in columns})
    if doubtful:
        places = ", ".join(f"{whirl.speeds[k]:.6g}" for k in doubtful[:5])
        texts.append(
            f"modes could not be told apart by shape just above {places} rad/s: from there on two curves "
            "may be exchanged"
        )
    return tuple(texts)


def _rounded(delta: float) -> str:
    """Four digits, without a negative zero."""
    return f"{round(float(delta), 4) + 0.0:.4f}"


def _no_peak(heavy: bool) -> str:
    return f"no peak: above {HEAVY}" if heavy else ""
