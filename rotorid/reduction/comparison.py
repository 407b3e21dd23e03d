"""A small model beside the full rotor in running: unbalance response and stability."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import fem
from fem import (
    SensorLike,
    Whirl,
    available_modes,
    checked_number,
    critical_speeds_below,
    decrements_of,
    label,
    runs_away,
    solve_whirl,
)
from fem.assembly import both_planes
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray, checked_speeds
from rotorid.base.json import plain
from rotorid.base.text import RPM, percent, rpm_text
from rotorid.reduction.small_model import SmallModel

CLOSE = 0.08
"""Largest difference, relative to the largest entry, up to which the small model follows the rotor well."""
POINTS, STEPS = 400, 40
"""Speeds of a response that are compared where none are given, and steps of a range for stability."""
APART = 0.2
"""Relative difference of whirl frequencies at the thresholds that is named."""


@dataclass(frozen=True, eq=False)
class ResponseCost(Answered):
    """Influence coefficients of both models: unbalance at the masses, readings at the masses.

    Attributes
    ----------
    speeds
        rad/s, ascending, shape (S,).
    full, small
        m per kg·m, shape (S, C, P); positive phase = lead.
    nodes
        Where the masses stand: the P planes.
    sensors
        What the C readings are: at each mass in x, of a rotor that is not symmetric in y, too (90°).
    criticals
        Critical speeds of the full rotor (undamped) whose bands reach into the range, rad/s.
    bands
        Half-width of the band around each critical speed that is left out, relative to it.
    excluded
        Speeds that are left out, shape (S,): in the bands, and standstill.
    warnings
        What the reader must know.
    """

    speeds: FloatArray
    full: ComplexArray
    small: ComplexArray
    nodes: tuple[int, ...]
    sensors: tuple[SensorLike, ...]
    criticals: FloatArray
    bands: float
    excluded: BoolArray
    warnings: tuple[str, ...] = ()

    @property
    def relative_difference(self) -> FloatArray:
        """|small − full| by the largest |full| at the same speed, shape (S, C, P); NaN at standstill."""
        with np.errstate(invalid="ignore", divide="ignore"):
            size = np.abs(self.full).max(axis=(1, 2), keepdims=True)
            return np.asarray(np.abs(self.small - self.full) / size)

    @property
    def worst(self) -> FloatArray:
        """Largest relative difference of all sensors and planes at each speed, shape (S,)."""
        return np.asarray(self.relative_difference.max(axis=(1, 2)))

    @property
    def where(self) -> tuple[float, SensorLike, int]:
        """Speed (rad/s), sensor and plane of the largest relative difference that is not left out."""
        difference = np.where(self.excluded[:, None, None], -1.0, self.relative_difference)
        s, c, p = np.unravel_index(int(np.argmax(difference)), difference.shape)
        return float(self.speeds[s]), self.sensors[int(c)], self.nodes[int(p)]

    @property
    def sizes(self) -> dict[str, float]:
        """Largest and median difference of the speeds that are not left out: `largest`, `median`."""
        used = self.worst[~self.excluded]
        return {"largest": float(used.max()), "median": float(np.median(used))}

    @property
    def answer(self) -> Answer:
        """What the reduction costs, in words."""
        used, size = self.speeds[~self.excluded], self.sizes
        speed, sensor, plane = self.where
        details = (
            f"in percent of the largest influence coefficient at the same speed; worst at {rpm_text(speed)}, "
            f"reading at node {label(sensor)}, unbalance at node {plane}; left out: "
            f"{np.count_nonzero(self.excluded)} of {self.speeds.size} speeds, within ±{100 * self.bands:.3g} "
            "% of the full rotor's critical speeds"
        )
        return Answer(
            f"From {used[0] * RPM:.6g} to {rpm_text(used[-1])} the small model's response at its "
            f"masses is within {percent(size['largest'])} % of the full rotor's, median "
            f"{percent(size['median'])} %.",
            warnings=self.warnings,
            notes=(details,),
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON: sizes over all speeds, and the worst of each as relative difference."""
        speed, sensor, plane = self.where
        return plain(
            {
                "nodes": self.nodes,
                "sensors": [str(label(each)) for each in self.sensors],
                "speeds_rad_s": self.speeds,
                "criticals_rad_s": self.criticals,
                "bands": self.bands,
                "excluded": self.excluded,
                "relative_difference": self.worst,
                **self.sizes,
                "where": {"speed_rad_s": speed, "sensor": str(label(sensor)), "plane": plane},
                "warnings": self.warnings,
            }
        )


def compare_response(
    rotor: fem.Rotor, small: SmallModel, speeds: ArrayLike | None = None, *, bands: float = 0.10
) -> ResponseCost:
    """Compare the synchronous response of a small model with the full rotor's.

    Parameters
    ----------
    rotor
        The full rotor.
    small
        Its small model; damping of the surroundings, which the full rotor does not have, is left out.
    speeds
        rad/s, ascending; by default 400 and the ends of the bands, up to 1.1 times the second critical speed
        of the full rotor (the fourth, where x and y differ), within the tables of its supports.
    bands
        Half-width of the band around each critical speed of the full rotor that is left out, relative to it:
        there the response of a lightly damped rotor is a matter of its damping, and of frequencies that
        differ a little.

    Raises
    ------
    ValueError
        For impossible speeds or bands, if the bands leave no speed, at a speed outside the table of a
        support, or exactly at a critical speed of an undamped model.

    Notes
    -----
    An unbalance U e^{iωt} pushes with U Ω² in z = x + i y: with Ω² in x and −i Ω² in y as phasors. So
    `fem.influence` has it, too. The critical speeds are those of the undamped rotor, as
    `fem.critical_speeds` gives them: bands are left out around them also where damping is large.
    """
    if not (np.isfinite(bands) and 0 <= bands < 1):
        raise ValueError(f"the bands are a part of the critical speed, 0 to below 1, not {bands!r}")
    nodes, (small, remarks) = small.massive, _undamped(small)
    omega = _default_speeds(rotor, bands) if speeds is None else checked_speeds(speeds, ascending=True)
    sensors: tuple[SensorLike, ...] = nodes
    if not rotor.symmetric:
        sensors = tuple((node, angle) for angle in (0.0, 90.0) for node in nodes)
    full = fem.influence(rotor, nodes, sensors, omega)
    each = [small.deflections(omega, {node: 1.0}) for node in nodes]
    at = np.concatenate([np.flatnonzero(small.masses) + k for k in (0, len(small.nodes))])[: len(sensors)]
    response = np.stack(each, axis=2)[:, at]
    try:
        criticals = critical_speeds_below(rotor, omega[-1] / (1 - bands) * (1 - 1e-9))
    except ValueError as problem:
        criticals = np.empty(0)
        remarks.append(f"no band is left out: {problem}")
    criticals = criticals[criticals * (1 + bands) > omega[0]]
    near = np.abs(omega[:, None] - criticals) < bands * criticals * (1 - 1e-9)  # its ends are compared
    excluded = near.any(axis=1) | (omega == 0)
    if excluded.all():
        raise ValueError(
            f"all {omega.size} speeds are standstill or lie within ±{100 * bands:.3g} % of a critical speed "
            "of the full rotor: give other speeds, or narrower bands"
        )
    remarks += [f"full rotor: {warning}" for warning in full.warnings]
    cost = ResponseCost(omega, full.W, response, nodes, sensors, criticals, float(bands), excluded)
    if not (largest := cost.sizes["largest"]) <= CLOSE:
        remarks.append(
            f"at {cost.where[0]:.6g} rad/s the small model is {percent(largest)} % off: take more masses, "
            "other nodes or more modes, or use it below this speed"
        )
    return replace(cost, warnings=tuple(remarks))


def _undamped(small: SmallModel) -> tuple[SmallModel, list[str]]:
    """The model without damping of the surroundings, and what to say of it."""
    remark = "the modal damping of the small model is left out of this comparison: the full rotor has none"
    return replace(small, damping=0 * small.damping), [remark] * bool(small.damping.any())


def _default_speeds(rotor: fem.Rotor, bands: float) -> FloatArray:
    """Up to 1.1 times the second critical speed of each plane, within the tables; with the bands' ends."""
    criticals = np.sort(fem.critical_speeds(rotor, 2 if rotor.symmetric else 4).frequencies)
    tables = [support.speeds for support in rotor.supports if support.speeds]
    top = min([1.1 * float(criticals[-1]), *(table[-1] for table in tables)])
    even = np.linspace(max([top / POINTS, *(table[0] for table in tables)]), top, POINTS)
    ends = np.outer((1 - bands, 1 + bands), criticals)
    return np.union1d(even, ends[(ends > even[0]) & (ends < top)])


@dataclass(frozen=True, eq=False)
class StabilityCost(Answered):
    """Stability of a small model over speed beside the full rotor's.

    Attributes
    ----------
    speeds
        rad/s, shape (S,).
    full_decrement, small_decrement
        Smallest logarithmic decrement of all modes that oscillate, shape (S,): negative where one grows,
        −inf where the rotor runs away without oscillating, NaN where nothing oscillates.
    full, small
        Where each loses stability.
    nodes
        Where the masses stand.
    warnings
        What the reader must know.
    """

    speeds: FloatArray
    full_decrement: FloatArray
    small_decrement: FloatArray
    full: fem.Stability
    small: fem.Stability
    nodes: tuple[int, ...]
    warnings: tuple[str, ...] = ()

    @property
    def relative_difference(self) -> float | None:
        """Of the small model's threshold from the full rotor's; None unless both have one."""
        if self.full.threshold is None or self.small.threshold is None:
            return None
        return self.small.threshold / self.full.threshold - 1.0

    @property
    def answer(self) -> Answer:
        """Both stabilities, and how far apart the thresholds are."""
        model = f"{len(self.nodes)}-mass model"
        if self.full.threshold is not None and self.small.threshold is not None:
            ends = rpm_text(self.full.threshold), rpm_text(self.small.threshold)
            apart = f"{100 * (self.small.threshold / self.full.threshold - 1.0):+.3g} %"
            words = f"Stable up to {ends[0]}, the {model} up to {ends[1]} ({apart})."
        else:
            disagree = "" if self.full.status == self.small.status else "The models DISAGREE. "
            words = f"{disagree}Full rotor: {self.full.sentence()}.\n{model}: {self.small.sentence()}."
        return Answer(words, warnings=self.warnings)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON; what is not known is None."""
        return plain(
            {
                "nodes": self.nodes,
                "speeds_rad_s": self.speeds,
                "full_log_decrement": self.full_decrement,
                "small_log_decrement": self.small_decrement,
                "full": self.full.to_dict(),
                "small": self.small.to_dict(),
                "relative_difference_of_threshold": self.relative_difference,
                "warnings": self.warnings,
            }
        )


def compare_stability(
    rotor: fem.Rotor,
    small: SmallModel,
    highest: float,
    *,
    lowest: float = 0.0,
    steps: int = STEPS,
) -> StabilityCost:
    """Compare where a small model and the full rotor lose stability.

    Decrements are those of all modes of the small model, and of as many of the rotor's of lowest frequency,
    forward and backward whirl apart, 8 at least.

    Parameters
    ----------
    rotor, small
        The full rotor and its small model; damping of the surroundings is left out.
    highest, lowest
        Range of speeds, rad/s: within the tables of all supports.
    steps
        Into how many steps the range is divided; a mode that is unstable only between two neighbouring
        speeds is not seen, in neither model. The thresholds themselves are found by iteration.

    Raises
    ------
    ValueError
        For an impossible range, a number of modes out of range, or a speed outside the table of a support.
    """
    speeds = fem.range_of_speeds(lowest, highest, steps)
    small, remarks = _undamped(small)
    whirl = small.whirl(speeds)
    many = max(8, int(np.isfinite(whirl.values).sum(axis=1).max()))
    n = checked_number(rotor, min(many, available_modes(rotor)))
    full = fem.stability_threshold(rotor, highest, lowest=lowest, n=n, steps=steps)
    of_small = fem.threshold_of(whirl)
    a, b = full.frequency, of_small.frequency
    if a and b and abs(b / a - 1) > APART:
        remarks.append(
            f"the full rotor loses stability with whirl at {a:.6g} rad/s, the small model with {b:.6g} "
            "rad/s: not the same mode; use other nodes or more masses"
        )
    return StabilityCost(
        speeds=speeds,
        full_decrement=_least_damped(solve_whirl(both_planes(rotor), speeds, n)),
        small_decrement=_least_damped(whirl),
        full=full,
        small=of_small,
        nodes=small.massive,
        warnings=tuple(remarks),
    )


def _least_damped(whirl: Whirl) -> FloatArray:
    """Smallest logarithmic decrement at each speed, shape (S,); −inf where the rotor runs away."""
    return np.where(runs_away(whirl), -np.inf, np.fmin.reduce(decrements_of(whirl.values), axis=1))
