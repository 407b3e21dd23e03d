"""Stability of the small model beside the full rotor's: speeds at which both lose it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import fem
from fem import DIRECTION_NAMES, Whirl, available_modes, checked_number, runs_away, solve_whirl
from fem.assembly import both_planes
from rotorid.base.answer import Answer, Answered
from rotorid.base.json import plain
from rotorid.base.rpm import RPM, range_text, rpm_text
from rotorid.base.text import counted, sentence
from rotorid.reduction.dynamics.instability_threshold import STEPS, stability_threshold
from rotorid.reduction.dynamics.response_comparison import without_modal_damping
from rotorid.reduction.dynamics.small_rotor_whirl import whirl_of

if TYPE_CHECKING:
    import pandas as pd

from rotorid.base.arrays import FloatArray
from rotorid.reduction.dynamics.small_rotor import SmallRotor

__all__ = ["StabilityCost", "compare_stability", "stability_threshold"]


CONFIRMED = 1e-5
"""Largest |Re λ| / |λ| at a threshold of the full rotor, where it should be 0."""

APART = 0.2
"""Whirl frequencies at the thresholds that differ by more belong to different modes, or nearly so."""


FAR = 0.3
"""Smallest decrements that differ by more than this share of the full rotor's largest are said."""

UNDAMPED = 1e-8
"""A logarithmic decrement below this is rounding."""


@dataclass(frozen=True, eq=False)
class StabilityCost(Answered):
    """Stability of the small model over speed beside the full rotor's.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    full_decrement, small_decrement
        Smallest logarithmic decrement of all modes that oscillate, shape (S,): negative where one grows,
        −inf where the rotor runs away without oscillating, NaN where nothing oscillates.
    full_frequency, small_frequency
        Whirl frequency of the mode that has it, rad/s, shape (S,); NaN where there is none.
    full, small
        Where each loses stability; `small.rotor` is the full rotor, too.
    nodes
        Where the masses stand.
    n_full, n_small
        How many modes were watched.
    warnings
        What the reader must know.
    """

    speeds: FloatArray
    full_decrement: FloatArray
    small_decrement: FloatArray
    full_frequency: FloatArray
    small_frequency: FloatArray
    full: fem.Stability
    small: fem.Stability
    nodes: tuple[int, ...]
    n_full: int
    n_small: int
    warnings: tuple[str, ...] = ()

    @property
    def full_threshold(self) -> float | None:
        """Speed at which the full rotor loses stability, rad/s, or None."""
        return self.full.threshold

    @property
    def small_threshold(self) -> float | None:
        """Speed at which the small model loses stability, rad/s, or None."""
        return self.small.threshold

    @property
    def relative_difference(self) -> float | None:
        """Of the small model's threshold from the full rotor's; None unless both have one."""
        if self.full.threshold is None or self.small.threshold is None:
            return None
        return self.small.threshold / self.full.threshold - 1.0

    @property
    def answer(self) -> Answer:
        """What the reduction costs, in words and a table."""
        lines = [f"{'':28}{'full rotor':>14}{counted(len(self.nodes), 'mass', 'masses'):>14}"]
        both = (self.full, self.small)
        rows = (
            ("status", [each.status for each in both]),
            ("threshold, rpm", [_text(each.threshold and each.threshold * RPM, 7) for each in both]),
            ("threshold, rad/s", [_text(each.threshold, 7) for each in both]),
            ("whirl frequency, rpm", [_text(each.frequency and each.frequency * RPM, 7) for each in both]),
            ("whirl frequency, rad/s", [_text(each.frequency, 7) for each in both]),
            ("whirl by running speed", [_text(each.whirl_ratio, 5) for each in both]),
            ("direction", [_way(each.direction) for each in both]),
            ("smallest log decrement", [_text(each.margin, 4) for each in both]),
            ("modes watched", [str(self.n_full), str(self.n_small)]),
        )
        lines += [f"{label:28}{a:>14}{b:>14}" for label, (a, b) in rows]
        said, table = sentence(self._verdict()), "\n".join(lines)
        return Answer(said, warnings=self.warnings, tables=(table,), more="both thresholds of stability")

    def _verdict(self) -> str:
        where = f"from {range_text(self.speeds[0], self.speeds[-1])}"
        begin = rpm_text(self.speeds[0])
        difference = self.relative_difference
        if difference is not None:
            small, full = (rpm_text(each.threshold or 0.0) for each in (self.small, self.full))
            return (
                f"the small model loses stability at {small}, the full rotor at {full}: "
                f"{100 * difference:+.3g} %"
            )
        if self.full.status == self.small.status == "stable":
            known = [a for a in (self.full_decrement, self.small_decrement) if np.isfinite(a).any()]
            if all(np.abs(a[np.isfinite(a)]).max() < UNDAMPED for a in known):
                return f"no damping acts on either model {where}: no motion grows, and none decays"
            return f"both models are stable {where}"
        if self.full.status == self.small.status:
            return f"both models are unstable already at {begin}"
        words = {"stable": f"is stable {where}", "unstable": f"is unstable already at {begin}"}
        full, small = (
            words.get(each.status, f"loses stability at {rpm_text(each.threshold or 0.0)}")
            for each in (self.full, self.small)
        )
        return f"the models disagree: the full rotor {full}, the small model {small}"

    def to_frame(self) -> pd.DataFrame:
        """One row per speed: smallest logarithmic decrement and its whirl frequency in both models."""
        import pandas as pd

        return pd.DataFrame(
            {
                "speed_rad_s": self.speeds,
                "full_log_decrement": self.full_decrement,
                "small_log_decrement": self.small_decrement,
                "full_frequency_rad_s": self.full_frequency,
                "small_frequency_rad_s": self.small_frequency,
            }
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; what is not known is None."""
        return plain(
            {
                "nodes": self.nodes,
                "speeds_rad_s": self.speeds,
                "full_log_decrement": self.full_decrement,
                "small_log_decrement": self.small_decrement,
                "full_frequency_rad_s": self.full_frequency,
                "small_frequency_rad_s": self.small_frequency,
                "full": self.full.to_dict(),
                "small": self.small.to_dict(),
                "relative_difference_of_threshold": self.relative_difference,
                "modes_watched": {"full": self.n_full, "small": self.n_small},
                "warnings": self.warnings,
            }
        )


def compare_stability(
    small: SmallRotor, highest: float, *, lowest: float = 0.0, steps: int = STEPS, n: int | None = None
) -> StabilityCost:
    """Compare where the small model and the full rotor lose stability.

    Parameters
    ----------
    small
        The small model; the full rotor is its `rotor`.
    highest, lowest
        Range of speeds, rad/s: within the tables of all supports.
    steps
        Into how many steps the range is divided; a mode that is unstable only between two neighbouring
        speeds is not seen, in neither model. The thresholds themselves are found by iteration.
    n
        Of how many modes of lowest frequency of the full rotor the decrements are taken, forward and backward
        whirl apart; by default 8, or as many as the small model has. Of the small model all are.

    Raises
    ------
    ValueError
        For an impossible range, a number of modes out of range, or a speed outside the table of a support.
    """
    speeds = fem.range_of_speeds(lowest, highest, steps)
    rotor = small.rotor
    left = without_modal_damping(small)
    if left:
        small = small.undamped_modes
    whirl = whirl_of(small, speeds)
    n_small = int(np.isfinite(whirl.values).sum(axis=1).max())
    available = available_modes(rotor)
    n_full = checked_number(rotor, min(max(8, n_small), available) if n is None else n)
    full = fem.stability_threshold(rotor, highest, lowest=lowest, n=n_full, steps=steps)
    own = fem.threshold_of(whirl)
    full_decrement, full_frequency = _least_damped(solve_whirl(both_planes(rotor), speeds, n_full))
    small_decrement, small_frequency = _least_damped(whirl)
    for array in (full_decrement, full_frequency, small_decrement, small_frequency):
        array.flags.writeable = False
    return StabilityCost(
        speeds=speeds,
        full_decrement=full_decrement,
        small_decrement=small_decrement,
        full_frequency=full_frequency,
        small_frequency=small_frequency,
        full=full,
        small=own,
        nodes=tuple(int(node) for node in small.nodes),
        n_full=n_full,
        n_small=n_small,
        warnings=(
            *left,
            *_unconfirmed(full, n_full),
            *_doubts(full, own),
            *_damping_differs(speeds, full_decrement, small_decrement),
        ),
    )


def _least_damped(whirl: Whirl) -> tuple[FloatArray, FloatArray]:
    """Smallest logarithmic decrement at each speed and the frequency of its mode, rad/s, shape (S,) each.

    −inf and NaN where the rotor runs away.
    """
    decrements = -2 * np.pi * whirl.values.real / np.abs(whirl.values.imag)
    rows, k = np.arange(len(decrements)), np.nan_to_num(decrements, nan=np.inf).argmin(axis=1)
    away = np.array(runs_away(whirl))
    frequency = np.abs(whirl.values.imag)[rows, k]
    return np.where(away, -np.inf, decrements[rows, k]), np.where(away, np.nan, frequency)


def _unconfirmed(full: fem.Stability, n: int) -> tuple[str, ...]:
    """Whether the full rotor's threshold is one, by another basis."""
    if full.threshold is None or full.frequency is None:
        return ()
    whirl = solve_whirl(both_planes(full.rotor), np.array([full.threshold]), max(n, full.mode or 1))
    values = whirl.values[np.isfinite(whirl.values)]
    fastest = float((values.real / np.abs(values)).max(initial=-np.inf))
    if abs(fastest) <= CONFIRMED:
        return ()
    doing = "a mode grows already" if fastest > 0 else "all modes still decay"
    return (
        f"the full rotor's threshold is not confirmed: at {full.threshold:.6g} rad/s {doing}; search with a "
        "smaller step",
    )


def _doubts(full: fem.Stability, small: fem.Stability) -> tuple[str, ...]:
    """What makes a comparison of the two thresholds doubtful."""
    if full.frequency is None or small.frequency is None:
        return ()
    texts = []
    if abs(small.frequency / full.frequency - 1) > APART:
        texts.append(
            f"the full rotor loses stability with whirl at {full.frequency:.6g} rad/s, the small model with "
            f"{small.frequency:.6g} rad/s: not the same mode; use other nodes or more masses"
        )
    if small.direction != full.direction:
        texts.append(
            f"where stability is lost the full rotor whirls {_way(full.direction)}, the small model "
            f"{_way(small.direction)}"
        )
    return tuple(texts)


def _damping_differs(speeds: FloatArray, full: FloatArray, small: FloatArray) -> tuple[str, ...]:
    """Where the two smallest decrements are furthest apart, if that is far."""
    known = np.isfinite(full) & np.isfinite(small)
    if not known.any():
        return ()
    apart = np.full(full.shape, -1.0)
    apart[known] = np.abs(full[known] - small[known])
    k = int(np.argmax(apart))
    if apart[k] <= max(FAR * float(np.abs(full[known]).max()), UNDAMPED):
        return ()
    return (
        f"the damping differs: at {speeds[k]:.6g} rad/s the smallest logarithmic decrement is {full[k]:.3g} "
        f"of the full rotor, {small[k]:.3g} of the small model; take more masses or other nodes",
    )


def _way(direction: float | None) -> str:
    return "-" if direction is None else DIRECTION_NAMES[direction]


def _text(value: float | None, digits: int) -> str:
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}g}"
