"""Peaks of a response: critical speed, amplification factor and separation margin after API 684.

Definitions of API Recommended Practice 684 (2nd edition, 2005, standard paragraphs SP6.8.2) and API 617: the
critical speed N_c is that of the peak; the amplification factor is AF = N_c / (N₂ − N₁), N₁ and N₂ the speeds
at 0.707 of the peak's amplitude; AF < 2.5 counts as critically damped, and needs no margin. Otherwise the
separation margin, in percent of the nearest operating speed, must be at least

    below the lowest operating speed    17 (1 − 1 / (AF − 1.5)), at most 16,
    above the highest                   10 + 17 (1 − 1 / (AF − 1.5)), at most 26.

The first edition (1996) and standards that follow it have for AF > 3.55

    below                               100 − (84 + 6 / (AF − 3)), at most 16,
    above                               (126 − 6 / (AF − 3)) − 100, at most 26,

and 5 and 15 for 2.5 ≤ AF ≤ 3.55.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.base.units import RPM

if TYPE_CHECKING:
    import pandas as pd

Edition = Literal["2005", "1996"]
HALF_POWER = float(np.sqrt(0.5))
_UNDAMPED = 1e5  # an AF beyond which damping is none
_POINTS = 6  # of the local polynomial
UNLIMITED = 1e300  # amplitude of what nothing limits; infinities have no differences
_NO_LIMIT = "practically undamped: AF exceeds 100000, damping does not limit the amplitude"


@dataclass(frozen=True)
class Peak:
    """One peak of a response curve.

    Attributes
    ----------
    speed
        Critical speed N_c, rad/s.
    amplitude
        There, in the unit of the curve.
    below, above
        Speeds N₁ and N₂ at 0.707 of it, rad/s; None where the curve does not show them.
    amplification
        AF; None where N₁ or N₂ is not known, too few speeds show them, or damping is practically none.
    margin
        Distance to the operating range in percent of its nearest end, 0 inside; None without a range.
    required
        What is required; None where AF is not known or there is no range.
    note
        What is missing, and why; else empty.
    undamped
        Whether AF exceeds 1e5: practically nothing limits the amplitude, which then says nothing.
    """

    speed: float
    amplitude: float
    below: float | None
    above: float | None
    amplification: float | None
    margin: float | None
    required: float | None
    note: str = ""
    undamped: bool = False

    @property
    def enough(self) -> bool | None:
        """Whether the margin is as required; None where this is not known."""
        if self.margin is None or self.required is None:
            return None
        return self.required == 0 or self.margin >= self.required


@dataclass(frozen=True)
class Peaks:
    """All peaks of a response curve, by rising speed.

    Attributes
    ----------
    peaks
        The peaks.
    operating
        Operating range, rad/s, or None.
    edition
        Of API 684 that the required margins follow.
    """

    peaks: tuple[Peak, ...]
    operating: tuple[float, float] | None
    edition: Edition

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "operating_rad_s": None if self.operating is None else list(self.operating),
            "edition": self.edition,
            "peaks": [
                {
                    "speed_rad_s": p.speed,
                    "speed_rpm": p.speed * RPM,
                    "amplitude": None if p.undamped else p.amplitude,
                    "half_power_rad_s": [p.below, p.above],
                    "amplification_factor": p.amplification,
                    "separation_margin_percent": p.margin,
                    "required_margin_percent": p.required,
                    "enough": p.enough,
                    "note": p.note,
                }
                for p in self.peaks
            ],
        }

    def to_frame(self) -> pd.DataFrame:
        """One row per peak."""
        import pandas as pd

        rows = [
            {**row, "half_power_rad_s": tuple(row["half_power_rad_s"])} for row in self.to_dict()["peaks"]
        ]
        return pd.DataFrame(rows)

    def summary(self, unit: str = "", scale: float = 1.0) -> str:
        """The peaks as text, amplitudes times `scale` with the name of their unit."""
        if not self.peaks:
            return "no peak in this range of speeds"
        named = f"amplitude, {unit}" if unit else "amplitude"
        lines = [f"{'rad/s':>12} {'rpm':>13} {named:>14} {'AF':>9} {'margin, %':>11} {'required, %':>12}"]
        for p in self.peaks:
            values = [
                "-" if v is None else f"{v:.{d}f}"
                for v, d in ((p.amplification, 2), (p.margin, 1), (p.required, 1))
            ]
            size = "-" if p.undamped else f"{scale * p.amplitude:.5g}"
            verdict = {True: "  enough", False: "  NOT ENOUGH", None: ""}[p.enough]
            lines.append(
                f"{p.speed:12.4f} {p.speed * RPM:13.2f} {size:>14} {values[0]:>9} {values[1]:>11} "
                f"{values[2]:>12}{verdict}"
            )
            if p.note:
                lines.append(f"    {p.note}")
        return "\n".join(lines)


def find_peaks(
    speeds: ArrayLike,
    amplitudes: ArrayLike,
    *,
    operating: tuple[float, float] | None = None,
    edition: Edition = "2005",
    evaluate: Callable[[float], float] | None = None,
) -> Peaks:
    """Find the peaks of a response to unbalance, their amplification factors and separation margins.

    Between the given speeds (Ω²/A)² is interpolated by local polynomials: of a single resonance it is one of
    second degree in Ω², so that results do not depend on the step where three speeds or more lie
    inside a peak's half-power band.

    Parameters
    ----------
    speeds, amplitudes
        rad/s, ascending, and the response (absolute values are taken), shape (S,).
    operating
        Lowest and highest operating speed, rad/s.
    edition
        Of API 684: "2005" (and API 617 since) or "1996".
    evaluate
        The amplitude at any speed; replaces interpolation where it is given.

    Raises
    ------
    ValueError
        For fewer than three speeds, speeds that do not ascend, or an impossible range.
    """
    if edition not in ("2005", "1996"):
        raise ValueError(f'edition must be "2005" or "1996", not {edition!r}')
    omega, A = _checked(speeds, amplitudes)
    if operating is not None:
        low, high = (float(v) for v in operating)
        if not 0 < low <= high:
            raise ValueError(f"operating must be a lowest and a highest speed above 0, not {operating!r}")
        operating = low, high
    inside = (A[1:-1] > A[:-2]) & (A[1:-1] >= A[2:]) & (A[1:-1] > 0)
    curve = evaluate or _interpolation(omega, A)
    found = [
        _peak(omega, A, int(k) + 1, curve, operating, edition, exact=evaluate is not None)
        for k in np.flatnonzero(inside)
    ]
    return Peaks(tuple(found), operating, edition)


def required_margin(amplification: float, *, above: bool, edition: Edition = "2005") -> float:
    """Separation margin required by API 684, percent.

    Parameters
    ----------
    amplification
        AF of the critical speed.
    above
        Whether the critical speed lies above the operating range, else below.
    edition
        "2005" or "1996".

    Returns
    -------
    Percent of the operating speed next to it; 0 below an amplification of 2.5.

    Examples
    --------
    >>> required_margin(5.0, above=False), required_margin(50.0, above=True)
    (12.142857142857142, 26.0)
    """
    AF = float(amplification)
    if AF < 2.5:
        return 0.0
    if edition == "2005":
        margin = 17 * (1 - 1 / (AF - 1.5))
        return float(min(26.0, 10 + margin) if above else min(16.0, margin))
    if AF <= 3.55:
        return 15.0 if above else 5.0
    return float(min(26.0, 26 - 6 / (AF - 3)) if above else min(16.0, 16 - 6 / (AF - 3)))


def _checked(speeds: ArrayLike, amplitudes: ArrayLike) -> tuple[FloatArray, FloatArray]:
    try:
        omega, A = np.array(speeds, dtype=float), np.abs(np.asarray(amplitudes, dtype=complex))
    except (TypeError, ValueError):
        raise ValueError("speeds and amplitudes must be numbers") from None
    if omega.ndim != 1 or omega.shape != A.shape or omega.size < 3:
        raise ValueError("give at least three speeds, and one amplitude for each")
    if (
        not np.isfinite(A).all()
        or not (np.isfinite(omega) & (omega >= 0)).all()
        or (np.diff(omega) <= 0).any()
    ):
        raise ValueError("speeds must be finite, not negative and ascending, amplitudes finite")
    return omega, A


def _interpolation(omega: FloatArray, A: FloatArray) -> Callable[[float], float]:
    """Amplitude between the speeds, from polynomials in Ω² for (Ω²/A)²."""
    good = (omega > 0) & (A > 0)
    s, q = omega[good] ** 2, omega[good] ** 4 / A[good] ** 2
    points = min(_POINTS, s.size)

    def amplitude(speed: float) -> float:
        t = speed * speed
        k = int(np.clip(np.searchsorted(s, t) - points // 2, 0, s.size - points))
        x, y = s[k : k + points], q[k : k + points]
        near = np.abs(x - t) <= 1e-14 * t
        if near.any():
            value = float(y[near][0])
        else:
            scale = x[-1] - x[0]
            difference = (x[:, None] - x[None, :]) / scale
            np.fill_diagonal(difference, 1.0)
            w = 1 / np.prod(difference, axis=1) / (t - x)
            value = float(w @ y / w.sum())
        # A polynomial through a very coarse curve may dip below zero.
        return t / float(np.sqrt(max(value, 1e-3 * float(y.min()))))

    return amplitude


def _peak(
    omega: FloatArray,
    A: FloatArray,
    k: int,
    curve: Callable[[float], float],
    operating: tuple[float, float] | None,
    edition: Edition,
    *,
    exact: bool,
) -> Peak:
    speed = _maximum(curve, float(omega[k - 1]), float(omega[k]), float(omega[k + 1]))
    amplitude = curve(speed)
    if amplitude >= UNLIMITED:
        return _without_limit(speed, operating, edition)
    level = HALF_POWER * amplitude
    below, why_below = _half_power(omega, A, k, -1, curve, level, speed)
    above, why_above = _half_power(omega, A, k, 1, curve, level, speed)
    notes = [text for text in (why_below, why_above) if text]
    AF = None
    undamped = False
    if below is not None and above is not None:
        AF = speed / max(above - below, 1e-300)
        unresolved = not exact and np.count_nonzero((omega >= below) & (omega <= above)) < 3
        if unresolved:
            # The band lies between the neighbours: how narrow it may be is not known, how wide is.
            AF = speed / (omega[k + 1] - omega[k - 1])
        undamped = bool(_UNDAMPED < AF)
        if undamped:
            notes.append(_NO_LIMIT)
        elif unresolved:
            AF = None
            notes.append("fewer than three speeds lie in the half-power band: take smaller steps here")
    margin, required = _margins(speed, AF, operating, edition)
    shown = None if undamped else AF
    return Peak(speed, amplitude, below, above, shown, margin, required, "; ".join(notes), undamped)


def _without_limit(speed: float, operating: tuple[float, float] | None, edition: Edition) -> Peak:
    """A peak that nothing limits."""
    margin, required = _margins(speed, np.inf, operating, edition)
    return Peak(speed, np.inf, None, None, None, margin, required, _NO_LIMIT, undamped=True)


def _margins(
    speed: float, AF: float | None, operating: tuple[float, float] | None, edition: Edition
) -> tuple[float | None, float | None]:
    """Separation margin, and what is required, percent."""
    if operating is None:
        return None, None
    low, high = operating
    over = speed > high
    margin = 100 * (speed - high) / high if over else max(0.0, 100 * (low - speed) / low)
    # Inside the range any margin is missing; the smaller requirement is then said.
    return margin, None if AF is None else required_margin(AF, above=over, edition=edition)


def _maximum(curve: Callable[[float], float], a: float, b: float, c: float) -> float:
    """Maximum between a and c, b inside: where the curve's symmetric difference changes sign."""
    from scipy.optimize import brentq, minimize_scalar

    step = 1e-4 * (c - a)

    def slope(speed: float) -> float:
        return curve(speed + step) - curve(speed - step)

    left, right = a + step, c - step
    if slope(left) > 0 > slope(right):
        return float(brentq(slope, left, right, xtol=1e-12 * c, rtol=1e-14))
    found = minimize_scalar(
        lambda speed: -curve(speed), bounds=(a, c), method="bounded", options={"xatol": 1e-10 * c}
    )
    return float(found.x) if curve(float(found.x)) >= curve(b) else b


def _half_power(
    omega: FloatArray,
    A: FloatArray,
    k: int,
    way: int,
    curve: Callable[[float], float],
    level: float,
    speed: float,
) -> tuple[float | None, str]:
    """Speed where the curve has fallen to `level` on one side of peak k, or why there is none."""
    from scipy.optimize import brentq

    side = "below" if way < 0 else "above"
    near, i = speed, k
    while 0 <= i < omega.size:
        beyond = (omega[i] - speed) * way > 0
        if beyond and A[i] <= level:
            return float(
                brentq(lambda w: curve(w) - level, near, omega[i], xtol=1e-13 * speed, rtol=1e-14)
            ), ""
        if beyond and A[i] > level / HALF_POWER * (1 + 1e-9):
            return None, f"the curve rises to another peak before it falls to 0.707 {side}"
        if beyond:
            near = float(omega[i])
        i += way
    end = omega[0] if way < 0 else omega[-1]
    return None, f"the half-power point {side} lies outside the speeds, which end at {end:.6g} rad/s"
