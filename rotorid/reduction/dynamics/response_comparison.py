"""Unbalance response of the small model beside the full rotor's: what the reduction costs in running."""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

import fem
from fem import SensorLike, critical_speeds_below, label, polar
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.checks import checked_speeds
from rotorid.base.json import plain
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.tables import Column, Table, frame
from rotorid.base.text import counted, sentence
from rotorid.reduction.dynamics.instability_threshold import stability_threshold
from rotorid.reduction.dynamics.small_rotor import SmallRotor, readings

if TYPE_CHECKING:
    import pandas as pd


CLOSE = 0.08
"""Largest difference, relative to the largest entry, up to which the small model follows the rotor well."""

POINTS = 400
"""Speeds that are compared where none are given."""


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
    relative_difference
        |small − full| by the largest |full| at the same speed, shape (S, C, P); NaN at standstill.
    largest, median
        Of `worst`, the largest entry of `relative_difference` at each speed, over the speeds that are not
        left out.
    largest_to_highest, median_to_highest
        The same of differences relative to the largest |full| of all these speeds.
    where
        Speed (rad/s), sensor and plane of `largest`.
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
    relative_difference: FloatArray
    largest: float
    median: float
    largest_to_highest: float
    median_to_highest: float
    where: tuple[float, SensorLike, int]
    warnings: tuple[str, ...] = ()

    @property
    def worst(self) -> FloatArray:
        """Largest relative difference of all sensors and planes at each speed, shape (S,)."""
        return np.asarray(self.relative_difference.max(axis=(1, 2)))

    @property
    def left_out(self) -> list[tuple[float, float]]:
        """Bands around the critical speeds, rad/s."""
        return [(w * (1 - self.bands), w * (1 + self.bands)) for w in self.criticals.tolist()]

    @property
    def answer(self) -> Answer:
        """What the reduction costs, in words."""
        used = self.speeds[~self.excluded]
        speed, sensor, plane = self.where
        if self.criticals.size:
            bands = ", ".join(f"{a * RPM:.6g} to {b * RPM:.6g}" for a, b in self.left_out)
            left_out = (
                f"left out: {np.count_nonzero(self.excluded)} of {self.speeds.size} speeds, within "
                f"±{100 * self.bands:.3g} % of the full rotor's critical speeds ({bands} rpm)"
            )
        else:
            left_out = "no critical speed of the full rotor lies near the range; no band is left out"
        details = (
            "the difference is in percent of the largest influence coefficient at the same speed; of the "
            f"largest in the range it is within {_percent(self.largest_to_highest)}, median "
            f"{_percent(self.median_to_highest)}",
            f"worst at {rpm_text(speed)}: reading at node {label(sensor)}, unbalance at node {plane}",
            left_out,
        )
        return Answer(
            f"From {used[0] * RPM:.6g} to {rpm_text(used[-1])} the small model's response at its "
            f"{counted(len(self.nodes), 'mass', 'masses')} is within {_percent(self.largest)} of the full "
            f"rotor's, median {_percent(self.median)}.",
            warnings=self.warnings,
            tables=("\n".join(fill(sentence(text), COLUMNS, subsequent_indent="  ") for text in details),),
            more="where the response differs most",
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per speed, sensor and plane."""
        S, C, P = self.full.shape
        columns = (
            Column("speed_rad_s", np.repeat(self.speeds, C * P)),
            Column("sensor", [label(sensor) for sensor in self.sensors for _ in self.nodes] * S),
            Column("plane", list(self.nodes) * (S * C)),
            *polar("full_m_per_kg_m", "full_phase_deg", self.full),
            *polar("small_m_per_kg_m", "small_phase_deg", self.small),
            Column("relative_difference", self.relative_difference.ravel()),
            Column("excluded", np.repeat(self.excluded, C * P)),
        )
        return frame(Table("responses", columns))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON: what is said of all speeds, and `worst` of each as relative difference."""
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
                "largest": self.largest,
                "median": self.median,
                "largest_to_highest": self.largest_to_highest,
                "median_to_highest": self.median_to_highest,
                "where": {"speed_rad_s": speed, "sensor": str(label(sensor)), "plane": plane},
                "warnings": self.warnings,
            }
        )


def compare_response(
    small: SmallRotor, speeds: ArrayLike | None = None, *, bands: float = 0.10
) -> ResponseCost:
    """Compare the synchronous response of the small model with the full rotor's.

    Parameters
    ----------
    small
        The small model; the full rotor is its `rotor`.
    speeds
        rad/s, ascending; by default 400 and the ends of the bands, up to 1.1 times the second critical speed
        of the full rotor (the fourth, where x and y have their own), within the tables of its supports.
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
    rotor, nodes = small.rotor, tuple(int(node) for node in small.nodes)
    if not (np.isfinite(bands) and 0 <= bands < 1):
        raise ValueError(f"the bands are a part of the critical speed, 0 to below 1, not {bands!r}")
    omega = _default_speeds(rotor, bands) if speeds is None else checked_speeds(speeds, ascending=True)
    sensors: tuple[SensorLike, ...] = nodes
    if not rotor.symmetric:
        sensors = (*((node, 0.0) for node in nodes), *((node, 90.0) for node in nodes))
    full = fem.influence(rotor, nodes, sensors, omega)
    left = without_modal_damping(small)
    if left:
        small = small.undamped_modes
    own = readings(small, omega)[:, : len(sensors)]
    said: tuple[str, ...] = ()
    try:
        criticals = critical_speeds_below(rotor, omega[-1] / (1 - bands) * (1 - 1e-9))
    except ValueError as problem:
        criticals, said = np.empty(0), (f"no band is left out: {problem}",)
    criticals = criticals[criticals * (1 + bands) > omega[0]]
    near = np.abs(omega[:, None] - criticals) < bands * criticals * (1 - 1e-9)  # its ends are compared
    excluded = near.any(axis=1) | (omega == 0)
    if excluded.all():
        raise ValueError(
            f"all {omega.size} speeds are standstill or lie within ±{100 * bands:.3g} % of a critical speed "
            "of the full rotor: give other speeds, or narrower bands"
        )
    difference, size = np.abs(own - full.W), np.abs(full.W).max(axis=(1, 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        relative = difference / size[:, None, None]
    worst, used = relative.max(axis=(1, 2)), np.flatnonzero(~excluded)
    to_highest = difference[used].max(axis=(1, 2)) / size[used].max()
    k = int(used[np.argmax(worst[used])])
    c, p = np.unravel_index(int(np.argmax(relative[k])), relative.shape[1:])
    largest = float(worst[k])
    warnings = [*left, *(f"full rotor: {text}" for text in full.warnings), *said, *_growing(small, omega)]
    if not largest <= CLOSE:
        warnings.append(
            f"at {omega[k]:.6g} rad/s the small model is {_percent(largest)} off: take more masses, other "
            "nodes or more modes, or use it below this speed"
        )
    for array in (own, relative, excluded, criticals):
        array.flags.writeable = False
    return ResponseCost(
        speeds=omega,
        full=full.W,
        small=own,
        nodes=nodes,
        sensors=sensors,
        criticals=criticals,
        bands=float(bands),
        excluded=excluded,
        relative_difference=relative,
        largest=largest,
        median=float(np.median(worst[used])),
        largest_to_highest=float(to_highest.max()),
        median_to_highest=float(np.median(to_highest)),
        where=(float(omega[k]), sensors[int(c)], nodes[int(p)]),
        warnings=tuple(warnings),
    )


def without_modal_damping(small: SmallRotor) -> tuple[str, ...]:
    """What to say where the small model has modal damping, which a comparison must leave out."""
    if not any(small.modal_damping):
        return ()
    return ("the modal damping of the small model is left out of this comparison: the full rotor has none",)


def _default_speeds(rotor: fem.Rotor, bands: float) -> FloatArray:
    """Up to 1.1 times the second critical speed of each plane, within the tables; with the bands' ends."""
    found = np.sort(fem.critical_speeds(rotor, 2 if rotor.symmetric else 4).frequencies)
    tables = [support.speeds for support in rotor.supports if support.speeds]
    first = max((table[0] for table in tables), default=0.0)
    last = min((table[-1] for table in tables), default=np.inf)
    top = min(1.1 * float(found[-1]), last)
    even = np.linspace(max(first, top / POINTS), top, POINTS)
    ends = np.concatenate((found * (1 - bands), found * (1 + bands)))
    return np.unique(np.concatenate((even, ends[(ends > even[0]) & (ends < top)])))


def _growing(small: SmallRotor, omega: FloatArray) -> list[str]:
    """What to say where the small model has no steady response."""
    if omega.size < 2:
        return []
    found = stability_threshold(small, float(omega[-1]), lowest=float(omega[0]), steps=12)
    if found.status == "stable":
        return []
    at = found.threshold if found.threshold is not None else found.lowest
    return [
        f"the small model has no steady response from {at:.6g} rad/s on: a motion grows there; amplitudes "
        "computed there are never reached"
    ]


def _percent(part: float) -> str:
    return f"{100 * part:.2g} %" if part < 0.1 else f"{100 * part:.0f} %"
