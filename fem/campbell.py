"""Campbell diagram: whirl frequencies and decrements over speed, and the damped critical speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem.crossing import synchronous
from fem.orbits import whirl_direction
from fem.planes import ComplexArray, both_planes
from fem.rotor import RPM, FloatArray, Rotor
from fem.tracking import Followed, follow
from fem.whirl import DIRECTION_NAMES, checked_number, checked_speeds, in_both_planes
from fem.whirlsolve import Whirl, solve_whirl

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_SPARE = 1  # modes above those asked for, which may come down; more are taken where a mode is lost


@dataclass(frozen=True, eq=False)
class Campbell:
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
        Damped critical speeds, where a frequency equals the speed, rad/s, ascending, shape (c,).
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
    """

    speeds: FloatArray
    frequencies: FloatArray
    log_decrements: FloatArray
    direction: FloatArray
    critical_speeds: FloatArray
    critical_modes: NDArray[np.intp]
    critical_log_decrements: FloatArray
    critical_direction: FloatArray
    error: float
    rotor: Rotor
    warnings: tuple[str, ...] = ()

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
        return {
            "speeds_rad_s": self.speeds.tolist(),
            "frequencies_rad_s": _plain(self.frequencies),
            "log_decrements": _plain(self.log_decrements),
            "direction": [
                [
                    DIRECTION_NAMES[float(d)] if np.isfinite(w) else None
                    for d, w in zip(way, omega, strict=True)
                ]
                for way, omega in zip(self.direction.T, self.frequencies.T, strict=True)
            ],
            "damped_critical_speeds_rad_s": self.critical_speeds.tolist(),
            "damped_critical_speeds": [
                {
                    "speed_rad_s": float(speed),
                    "speed_rpm": float(speed * RPM),
                    "mode": int(mode),
                    "log_decrement": float(delta),
                    "direction": DIRECTION_NAMES[float(way)],
                }
                for speed, mode, delta, way in self._criticals()
            ],
            "warnings": list(self.warnings),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per speed and mode."""
        import pandas as pd

        S, n = self.frequencies.shape
        there = np.isfinite(self.frequencies.ravel())
        names = [
            DIRECTION_NAMES[float(d)] if found else None
            for d, found in zip(self.direction.ravel(), there, strict=True)
        ]
        return pd.DataFrame(
            {
                "speed_rad_s": np.repeat(self.speeds, n),
                "mode": np.tile(np.arange(1, n + 1), S),
                "frequency_rad_s": self.frequencies.ravel(),
                "log_decrement": self.log_decrements.ravel(),
                "direction": names,
            }
        )

    def summary(self) -> str:
        """Frequencies at both ends of the range and the damped critical speeds as text."""
        first, last = self.speeds[0], self.speeds[-1]
        lines = [
            f"Whirl from {first:.6g} to {last:.6g} rad/s ({first * RPM:.6g} to {last * RPM:.6g} rpm)",
            "mode    at first, rad/s   log dec    at last, rad/s   log dec",
        ]
        for k in range(self.frequencies.shape[1]):
            parts = [f"{k + 1:4d}"]
            for s in (0, -1):
                omega, delta = self.frequencies[s, k], self.log_decrements[s, k]
                text = f"{omega:16.4f} {_LETTERS[float(self.direction[s, k])]}{delta:10.4f}"
                parts.append(text if np.isfinite(omega) else f"{'overdamped':>18}{'':10}")
            lines.append("".join(parts))
        if self.critical_speeds.size:
            lines.append("damped critical speeds")
            lines.append("mode     rad/s         rpm   log dec  direction")
        for speed, mode, delta, way in self._criticals():
            lines.append(
                f"{mode:4d}{speed:12.4f}{speed * RPM:12.2f}{delta:10.4f}  {DIRECTION_NAMES[float(way)]}"
            )
        if not self.critical_speeds.size:
            lines.append("no damped critical speed in this range")
        return "\n".join([*lines, *(f"Warning: {text}" for text in self.warnings)])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the frequencies over speed with the 1× line and the critical speeds; return the axes."""
        from fem.plots_campbell import draw_campbell

        return draw_campbell(self, ax, criticals=self.criticals)

    def _criticals(self) -> list[tuple[float, int, float, float]]:
        return list(
            zip(
                self.critical_speeds.tolist(),
                self.critical_modes.tolist(),
                self.critical_log_decrements.tolist(),
                self.critical_direction.tolist(),
                strict=True,
            )
        )


_LETTERS = {1.0: "F", -1.0: "B", 0.0: "-"}


def campbell(rotor: Rotor, speeds: ArrayLike, n: int = 6) -> Campbell:
    """Compute whirl frequencies, logarithmic decrements and directions over speed.

    Modes are followed from speed to speed by the likeness of their complex shapes (MAC), with smaller steps
    between the given speeds where it leaves a doubt. The n modes are those that are most often among the n of
    lowest frequency, numbered by frequency at the first speed. Where a curve crosses the 1× line between two
    speeds, the crossing is found by iteration on the model.

    Parameters
    ----------
    rotor
        The rotor with all its supports.
    speeds
        rad/s, ascending, shape (S,).
    n
        How many modes; forward and backward whirl count apart.

    Raises
    ------
    ValueError
        If speeds are impossible or outside the table of a support, the model has fewer modes, or the mesh is
        too fine for float64.
    """
    speeds = checked_speeds(speeds)
    checked_number(rotor, n)
    whirl, paths, columns = followed(rotor, speeds, n)
    if not columns.size:
        raise ValueError("the rotor has no oscillating mode at these speeds: all motions are overdamped")
    values, X = paths.values[:, columns], paths.vectors[:, columns]
    lam, x, y = in_both_planes(values, whirl.Q.nodes(X))
    gone = ~np.isfinite(lam)
    direction = np.where(gone, 0.0, whirl_direction(np.nan_to_num(x), np.nan_to_num(y)))
    frequencies = np.where(gone, np.nan, lam.imag)
    log_decrements = -2 * np.pi * lam.real / frequencies
    crossings = synchronous(whirl, values, X)
    at, cx, cy = in_both_planes(crossings.values, crossings.shapes)
    for array in (frequencies, log_decrements, direction, crossings.speeds):
        array.flags.writeable = False
    return Campbell(
        speeds=speeds,
        frequencies=frequencies,
        log_decrements=log_decrements,
        direction=direction,
        critical_speeds=crossings.speeds,
        critical_modes=crossings.modes + 1,
        critical_log_decrements=-2 * np.pi * at.real / at.imag,
        critical_direction=whirl_direction(cx, cy),
        error=whirl.error,
        rotor=rotor,
        warnings=_warnings(whirl, paths, columns, n),
    )


def followed(rotor: Rotor, speeds: FloatArray, n: int) -> tuple[Whirl, Followed, NDArray[np.intp]]:
    """Modes over speed, and which n (or fewer) of them were asked for."""
    P = both_planes(rotor)
    spare = _SPARE
    while True:
        whirl = solve_whirl(P, speeds, n + spare)
        paths = follow(whirl)
        columns = _asked_for(paths, n)
        # One that went on above those computed needs more of them.
        if not paths.lost[columns].any() or spare > 4 * n + 8:
            return whirl, paths, columns
        spare *= 2


def _asked_for(paths: Followed, n: int) -> NDArray[np.intp]:
    size = np.abs(paths.values.imag)
    ranked = np.where(np.isfinite(size), size, np.inf)
    order = np.argsort(ranked, axis=1, kind="stable")[:, :n]
    low = np.zeros(size.shape, dtype=bool)
    np.put_along_axis(low, order, True, axis=1)
    low &= np.isfinite(size)
    often = low.sum(axis=0)
    begins = np.argmax(np.isfinite(size), axis=0)
    start = ranked[begins, np.arange(size.shape[1])]
    best = [c for c in np.lexsort((start, begins, -often)) if often[c]][:n]
    return np.array(sorted(best, key=lambda c: (begins[c], start[c])), dtype=np.intp)


def _warnings(whirl: Whirl, paths: Followed, columns: NDArray[np.intp], n: int) -> tuple[str, ...]:
    texts = []
    values = paths.values[:, columns]
    gone = ~np.isfinite(values)
    for k in np.flatnonzero(gone.any(axis=0)):
        where = whirl.speeds[gone[:, k]]
        texts.append(
            f"mode {k + 1} does not oscillate (overdamped) or was not found at {where.size} of "
            f"{whirl.speeds.size} speeds, from {where[0]:.6g} to {where[-1]:.6g} rad/s"
        )
    if columns.size < n:
        texts.append(f"only {columns.size} of {n} modes oscillate, the others are overdamped")
    rigid = whirl.found.still // 2
    if rigid.any():
        texts.append("rigid-body motions that nothing holds (eigenvalue 0) are left out")
    growing = [k for k, real in enumerate(whirl.found.real) if real.size and real.max() > 1e-6 * whirl.scale]
    if growing:
        texts.append(
            f"the rotor runs away without oscillating from {whirl.speeds[growing[0]]:.6g} rad/s on: "
            "a support pushes it aside; check negative stiffness"
        )
    if paths.doubtful:
        places = ", ".join(f"{whirl.speeds[k]:.6g}" for k in paths.doubtful[:5])
        texts.append(
            f"modes could not be told apart by shape just above {places} rad/s: from there on two curves "
            "may be exchanged"
        )
    return tuple(texts)


def _plain(array: FloatArray) -> list[list[float | None]]:
    return [[float(v) if np.isfinite(v) else None for v in row] for row in array.T]
