"""First trial weight: how large, where, and what it should do to the readings.

**Amount from the force.** A weight m at the radius r turns into the force m r ω²; a first trial weight
makes a fraction f (10 %) of the load that the plane carries, m r ω² = f · load, with load = m_rotor g /
planes or the stated bearing load. More than 25 % is a risk. **Amount from coefficients**: the weight that
changes a reading by a stated share (40 %) of the largest one, and every other reading by less. With
coefficients no lag has to be guessed: angle = arg(−Wᴴ Y₀) makes Σ |Y₀ + W T|² as small as a weight of that
amount can.

**Angle without coefficients**: opposite to the heavy spot, from phase and lag. A reading with phase φ
(positive = lead) at a sensor at the angle α is A cos(ωt + φ), with t = 0 when the mark passes the key
phasor, at the angle κ; angles count with the rotation. At time t the mark stands at κ + ωt, the high spot,
at the angle h from the mark, at κ + ωt + h. The sensor reads its largest value when the high spot passes
it: κ + ωt + h = α at ωt = −φ, hence

    h = φ + α − κ.

The vibration lags the unbalance that causes it by ψ (0 far below the critical speed, 90° at it, towards
180° above), so the heavy spot is ahead of the high spot, at h + ψ, and the trial weight opposite,

    angle = φ + α − κ + ψ + 180°.

A velocity leads its displacement by 90°,
an acceleration by 180°: these are taken off φ first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.conventions import Labels
from balancing.influence import Influence, plane_indices
from balancing.printed_readings import (
    largest_readings,
    reading_columns,
    reading_names,
    three_figures,
    vector_columns,
)
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records
from rotorid.base.text import rpm

if TYPE_CHECKING:
    import pandas as pd
GRAVITY = 9.80665
RISKY = 0.25
"""Of the load, for the force of a first trial weight."""

_LAGS = {"below": (45.0, 45.0), "at": (90.0, 0.0), "above": (135.0, 45.0)}


@dataclass(frozen=True)
class Lag:
    """How far a vibration lags the unbalance behind it.

    Attributes
    ----------
    expected, reach
        rad, and how far it may be from that, either side.
    words
        Why.
    """

    expected: float
    reach: float
    words: str


@dataclass(frozen=True, eq=False)
class TrialWeight(Answered):
    """A proposed trial weight for one plane.

    Attributes
    ----------
    plane
        Name.
    amount
        kg (with `radius`) or kg·m.
    angle
        rad with the rotation; None where nothing is known to choose it by.
    angle_reach
        How far the best angle may be from it, rad, either side; 0 from coefficients; None as before.
    basis
        Where amount and angle come from, in words.
    radius
        m; None where the amount is an unbalance.
    speed
        rad/s, the highest at which it will turn.
    load
        N, that the plane carries; None: unknown.
    influence, expected
        Coefficients with the readings without it as baseline, and readings (S, C) with it; None where there
        are no coefficients.
    labels
        Units and conventions to print in.
    warnings
        What the user should know.
    """

    plane: str
    amount: float
    angle: float | None
    angle_reach: float | None
    basis: str
    radius: float | None
    speed: float
    load: float | None = None
    influence: Influence | None = None
    expected: ComplexArray | None = None
    labels: Labels = field(default_factory=Labels)
    warnings: tuple[str, ...] = ()

    @property
    def force(self) -> float | None:
        """Centrifugal force at the highest speed, N; None for masses without a radius."""
        if self.radius is None and not self.labels.unbalances:
            return None
        return self.amount * (self.radius or 1.0) * self.speed**2

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        size, angle = self._size_and_angle()
        document = {
            "plane": self.plane,
            "mass": size,
            "unit": self.labels.weight_unit,
            "angle_deg": angle,
            "angle_reach_deg": None if self.angle_reach is None else math.degrees(self.angle_reach),
            "basis": self.basis,
            "radius_m": self.radius,
            "speed_rpm": rpm(self.speed),
            "force_N": self.force,
            "load_N": self.load,
            "force_percent": self._share(),
            "expected": records(self._columns()) or None,
            "conventions": self.labels.conventions(),
            "warnings": self.warnings,
        }
        return plain(document)

    def to_frame(self) -> pd.DataFrame:
        """One row per speed and sensor with the expected readings; one row without coefficients."""
        document, expected = self.to_dict(), self._columns()
        n = len(expected[0].values) if expected else 1
        named = (Column(name, [document[name]] * n) for name in ("plane", "mass", "unit", "angle_deg"))
        return frame((*named, *expected))

    @property
    def answer(self) -> Answer:
        """Amount and place, what for, and the readings expected with it."""
        labels, share = self.labels, self._share()
        size, turned = self._size_and_angle()
        at = "" if self.radius is None else f" at the radius {self.radius * 1e3:.6g} mm"
        angle = "at any angle (no phase, or no lag, is known)"
        if turned is not None:
            angle = f"at {turned:.0f}° {labels.angle_words}"
            angle += f" (± {math.degrees(self.angle_reach):.0f}°)" if self.angle_reach else ""
        lines = [f"Plane {self.plane}: {self.basis}"]
        if self.force is not None:
            lines[0] += f"; force at {labels.speed_words(self.speed)} {self.force:.4g} N"
            lines[0] += "" if share is None else f", {share:.3g} % of the load"
        if self.influence is not None and self.expected is not None:
            where = self.influence.speeds, self.influence.sensors
            largest = largest_readings(labels, *where, self.influence.baseline, self.expected)
            lines.append(f"  largest with it{largest}")
        return Answer(
            f"Trial weight in plane {self.plane}: {size:.4g} {labels.weight_in}{at}, {angle}.",
            "\n".join(lines),
            ((labels.assumed_in_words(),) if labels.assumed else ()) + self.warnings,
            to_mount=True,
        )

    def _size_and_angle(self) -> tuple[float, float | None]:
        """As the job has them."""
        size, angle = self.labels.weight(self.amount * np.exp(1j * (self.angle or 0.0)))
        return float(size), None if self.angle is None else float(angle)

    def _share(self) -> float | None:
        """Force in percent of the load; None where one of both is unknown."""
        return None if self.force is None or self.load is None else 100 * self.force / self.load

    def _columns(self) -> tuple[Column, ...]:
        """Readings without and with it, one row per speed and sensor; none without coefficients."""
        if self.influence is None or self.expected is None:
            return ()
        before = self.influence.baseline
        change = np.abs(self.expected - before) * self.labels.vibration_scale
        return (
            *reading_columns(self.labels, self.influence.speeds, self.influence.sensors),
            *vector_columns(self.labels, "before", before),
            *vector_columns(self.labels, "after", self.expected),
            Column("change", change.ravel(), three_figures),
        )


def trial_from_force(  # noqa: PLR0913
    plane: str,
    speed: float,
    radius: float,
    load: float,
    *,
    fraction: float = 0.1,
    phase: float | None = None,
    lag: Lag | None = None,
    sensor_angle: float = 0.0,
    labels: Labels | None = None,
) -> TrialWeight:
    """First trial weight without any coefficients: its force is a fraction of the load, m r ω² = f · load.

    Parameters
    ----------
    plane
        Name.
    speed, radius, load
        rad/s, m, and N, that the plane carries: its share of the rotor's weight, or that of its bearing.
    fraction
        f.
    phase, lag
        Of the initial reading, rad, positive = lead, and its expected lag; without both no angle is proposed.
    sensor_angle
        Of the sensor from the key phasor, rad with the rotation.
    labels
        Units and conventions to print in.

    Raises
    ------
    ValueError
        For impossible numbers, and an angle without phase or lag.

    Examples
    --------
    >>> trial = trial_from_force("left", 314.159265, 0.2, 500 * GRAVITY)
    >>> f"{1e3 * trial.amount:.2f} g"
    '24.84 g'
    """
    given = {"speed": speed, "radius": radius, "load of the plane": load, "fraction of the load": fraction}
    for what, value in given.items():
        positive(what, value)
    amount = fraction * load / (radius * speed**2)
    words = f"{100 * fraction:.3g} % of the load of {load:.4g} N"
    angle = reach = None
    if (phase is None) != (lag is None):
        raise ValueError(
            "an angle needs both the phase of the initial reading and the lag: give the other one, too"
        )
    if phase is not None and lag is not None:
        angle = opposing_angle(phase, lag.expected, sensor_angle)
        reach, degrees = lag.reach, math.degrees(lag.expected)
        words += f"; angle opposite to the heavy spot with a lag of {degrees:.3g}° ({lag.words})"
    warnings = _force_warning(fraction)
    return TrialWeight(
        plane, amount, angle, reach, words, radius, speed, load, labels=labels or Labels(), warnings=warnings
    )


def trial_from_coefficients(
    influence: Influence,
    plane: str,
    *,
    share: float = 0.4,
    limit: float = math.inf,
    radius: float | None = None,
    trial_radius: float | None = None,
    load: float | None = None,
) -> TrialWeight:
    """Trial weight of one plane from stored or computed coefficients.

    Parameters
    ----------
    influence
        With the initial vibration as baseline.
    plane
        Name.
    share
        Of the largest reading, by which the weight changes the reading on which it acts most: the largest one
        itself, or another, which would change by more than that if the largest one decided.
    limit
        Largest weight of the plane: what follows from `share` is cut, with a warning.
    radius
        m, of the coefficients' masses; None: unknown, or weights are unbalances.
    trial_radius
        m, where the trial weight will be mounted: the result is a mass there. None: `radius`.
    load
        N, that the plane carries, to compare the force with.

    Raises
    ------
    ValueError
        For a plane that is not known or acts on no reading, and readings that are lacking or
        zero.
    """
    [p] = plane_indices(influence, [plane])
    Y, w, labels = influence.baseline, influence.W[..., p], influence.labels
    # masses at the trial radius per mass at the radius of the coefficients
    at = trial_radius or radius
    scale = 1.0 if radius is None or at is None else radius / at
    size = float(np.abs(Y).max())
    if not size > 0:
        raise ValueError(
            "initial readings are lacking or all zero: there is nothing to choose a trial weight by"
        )
    if not w.any():
        raise ValueError(f"plane {plane!r} acts on no reading: choose another plane")
    warnings = []
    positive("share of the largest reading", share)
    amount = share * size / float(np.abs(w).max())
    reading = reading_names(labels, influence.sensors, influence.speeds)[int(np.argmax(np.abs(w)))]
    basis = f"changes {reading} by {100 * share:.3g} % of the largest reading, the others by less"
    if amount > limit:
        amount, basis = limit, "the largest weight of the plane"
        warnings.append(
            f"a change by {100 * share:.3g} % of the largest reading would need more than the largest "
            f"weight of plane {plane!r}: that is proposed"
        )
    angle = float(np.angle(-np.vdot(w, Y))) % (2 * math.pi)
    expected = Y + w * (amount * np.exp(1j * angle))
    if np.abs(expected).max() > size:
        worst = int(np.argmax(np.abs(expected).max(axis=0)))
        warnings.append(
            f"with the trial weight sensor {influence.sensors[worst]!r} would read more than the largest "
            "reading now: take less, or begin with another plane"
        )
    weight = TrialWeight(
        plane=plane,
        amount=amount * scale,
        angle=angle,
        angle_reach=0.0,
        basis=f"{basis}; angle from the coefficients",
        radius=at,
        speed=float(influence.speeds.max()),
        load=load,
        influence=influence,
        expected=expected,
        labels=labels,
    )
    force = () if load is None or weight.force is None else _force_warning(weight.force / load)
    return replace(weight, warnings=(*warnings, *force))


def _force_warning(fraction: float) -> tuple[str, ...]:
    words = "more than 25 %: take less for a first run"
    high = f"the force of the trial weight is {100 * fraction:.3g} % of the load, {words}"
    return (high,) if fraction > RISKY else ()


def expected_lag(
    where: str | None = None,
    *,
    degrees: float | None = None,
) -> Lag:
    """How far the vibration lags, from either of these.

    Parameters
    ----------
    where
        "below", "at" or "above" the critical speed.
    degrees
        The lag.

    Raises
    ------
    ValueError
        If neither is given, and for what is no lag.
    """
    if where is not None:
        if where not in _LAGS:
            raise ValueError(f"the speed is below, at or above the critical speed, not {where!r}")
        lag, reach = map(math.radians, _LAGS[where])
        return Lag(lag, reach, f"{where} the critical speed")
    if degrees is None or not 0 <= degrees <= 360:
        raise ValueError("give below, at or above the critical speed, or a lag from 0 to 360 degrees")
    return Lag(math.radians(degrees), 0.0, f"{degrees:g}°, as stated")


def opposing_angle(phase: float, lag: float, sensor_angle: float = 0.0) -> float:
    """Angle opposite to the heavy spot, rad with the rotation, 0 ≤ angle < 2π (derived in the module).

    Parameters
    ----------
    phase
        Of the reading as a displacement, rad, positive = lead.
    lag
        ψ, rad.
    sensor_angle
        α − κ, of the sensor from the key phasor, rad with the rotation.
    """
    return (phase + sensor_angle + lag + math.pi) % (2 * math.pi)


def positive(what: str, value: float) -> None:
    """Refuse a number that is not positive and finite.

    Raises
    ------
    ValueError
        Naming it.
    """
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"the {what} must be a finite number above 0, not {value:g}")
