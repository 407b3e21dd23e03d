"""First trial weight: how large, where, and what it should do to the readings.

**Amount from the force.** A weight m at the radius r turns into the force m r ω²; a first trial weight
makes a fraction f (10 %) of the load that the plane carries, m r ω² = f · load, with load = m_rotor g /
planes or the stated bearing load. More than 25 % is a risk. **Amount from coefficients**: the weight that
changes a reading by a stated share (40 %) of the largest one, and every other reading by less.

**Angle**: opposite to the heavy spot, from phase and lag (`balancing.trial_angle`). With coefficients
(stored, or of a model) no lag has to be guessed: angle = arg(−Wᴴ Y₀) makes Σ |Y₀ + W T|² over all readings
as small as a weight of that amount can.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from balancing.coefficients.trial_effects import ENGINEERS_AMPLITUDE, ENGINEERS_PHASE
from balancing.data.conventions import Labels
from balancing.data.reading_errors import reading_covariance
from balancing.trial_angle import Lag, Quantity, opposing_angle, positive
from balancing.trial_weight_result import TrialWeight
from rotorid.base.arrays import ComplexArray
from rotorid.base.suggestions import did_you_mean

if TYPE_CHECKING:
    from balancing.coefficients.influence import Influence
    from balancing.coefficients.run_errors import RunErrors
    from balancing.data.trials import ReadingErrors


GRAVITY = 9.80665
FRACTION = 0.10
"""Of the load that the force of a first trial weight makes."""
RISKY = 0.25
SHARE = 0.40
"""Change of a reading, relative to the largest one, that a trial weight is chosen for."""

_SEEN = 2.448 * math.sqrt(2)
"""Standard deviations of a reading that the difference of two must exceed to be no chance (95 %)."""


def plane_load(rotor_mass: float | None, bearing_load: float | None, planes: int = 1) -> float | None:
    """What a plane carries, N: its share of the rotor's mass, kg, or the load of its bearing, N.

    None where nothing is known.

    Raises
    ------
    ValueError
        For both of them, and for a number that is not positive.
    """
    if rotor_mass is not None and bearing_load is not None:
        raise ValueError(
            "the mass of the rotor and the load of the bearing are two ways to the same load: "
            "choose one of them"
        )
    positive("number of planes", planes)
    if rotor_mass is not None:
        positive("mass of the rotor", rotor_mass)
        return rotor_mass * GRAVITY / planes
    if bearing_load is not None:
        positive("load of the bearing", bearing_load)
    return bearing_load


def trial_from_force(  # noqa: PLR0913
    plane: str,
    speed: float,
    radius: float,
    load: float,
    *,
    fraction: float = FRACTION,
    limit: float = math.inf,
    phase: float | None = None,
    lag: Lag | None = None,
    sensor_angle: float = 0.0,
    key_phasor: float = 0.0,
    quantity: Quantity = "displacement",
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
    limit
        Largest weight of the plane, kg.
    phase, lag
        Of the initial reading, rad, positive = lead, and its expected lag; without both no angle is proposed.
    sensor_angle, key_phasor, quantity
        As of `opposing_angle`.
    labels
        Units and conventions to print in.

    Raises
    ------
    ValueError
        For impossible numbers, and a weight larger than the plane's limit.

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
    made = labels or Labels()
    _check_limit(
        plane, amount, limit, made, f"take at most {100 * fraction * limit / amount:.3g} % of the load"
    )
    words = f"{100 * fraction:.3g} % of the load of {load:.4g} N"
    angle = reach = None
    warnings = _force_warning(fraction)
    if phase is not None and lag is not None:
        angle = opposing_angle(
            phase, lag.expected, sensor_angle=sensor_angle, key_phasor=key_phasor, quantity=quantity
        )
        reach = max(lag.high - lag.expected, lag.expected - lag.low)
        degrees = math.degrees(lag.expected)
        words += f"; angle opposite to the heavy spot with a lag of {degrees:.3g}° ({lag.words})"
    elif phase is not None or lag is not None:
        raise ValueError(
            "an angle needs both the phase of the initial reading and the lag: give the other one, too"
        )
    return TrialWeight(
        plane, amount, angle, reach, words, radius, speed, load, labels=made, warnings=warnings
    )


def trial_from_coefficients(  # noqa: PLR0913, PLR0915
    influence: Influence,
    readings: ComplexArray,
    plane: str,
    *,
    share: float = SHARE,
    amount: float | None = None,
    limit: float = math.inf,
    radius: float | None = None,
    trial_radius: float | None = None,
    load: float | None = None,
    errors: ReadingErrors | None = None,
    labels: Labels | None = None,
) -> TrialWeight:
    """Trial weight of one plane from stored or computed coefficients.

    Parameters
    ----------
    influence
        Coefficients, W (S, C, P).
    readings
        Initial vibration, (S, C).
    plane
        Name.
    share
        Of the largest reading, by which the weight changes the reading on which it acts most: the largest one
        itself, or another, which would change by more than that if the largest one decided.
    amount
        Weight to use in place of that, kg or kg·m.
    limit
        Largest weight of the plane: a larger `amount` is refused; what follows from `share` is cut, with a
        warning.
    radius
        m, of the coefficients' masses; None: unknown, or weights are unbalances.
    trial_radius
        m, where the trial weight will be mounted: `amount` and the result are masses there. None: `radius`.
    load
        N, that the plane carries, to compare the force with.
    errors
        Of a reading; None: those of the coefficients.
    labels
        Units and conventions to print in; None: those of the coefficients.

    Raises
    ------
    ValueError
        For a plane that is not known or acts on no reading, for readings that are all zero, and an amount
        larger than the limit.
    """
    if plane not in influence.planes:
        hint = did_you_mean(str(plane), influence.planes)
        raise ValueError(
            f"there is no plane {plane!r}{hint}; the planes are {', '.join(map(repr, influence.planes))}"
        )
    Y = np.asarray(readings, dtype=complex)
    w = influence.W[..., influence.planes.index(plane)]
    if Y.shape != w.shape:
        raise ValueError(f"the initial readings must have shape {w.shape} (speeds, sensors); got {Y.shape}")
    made = labels or influence.labels
    # masses at the trial radius per mass at the radius of the coefficients
    scale = 1.0
    if trial_radius is not None:
        positive("trial radius", trial_radius)
        if radius is None:
            raise ValueError("a trial radius needs the radius of the coefficients' masses, too")
        scale = radius / trial_radius
    size = float(np.abs(Y).max())
    if not size:
        raise ValueError("all initial readings are zero: there is nothing to choose a trial weight by")
    warnings: list[str] = []
    if amount is None:
        positive("share of the largest reading", share)
        most = np.unravel_index(int(np.argmax(np.abs(w))), w.shape)
        if not abs(w[most]):
            raise ValueError(f"plane {plane!r} acts on no reading: choose another plane")
        amount = share * size / abs(w[most])
        speed = influence.labels.speed_words(influence.speeds[most[0]])
        reading = f"sensor {influence.sensors[most[1]]!r} at {speed}"
        basis = f"changes {reading} by {100 * share:.3g} % of the largest reading, the others by less"
        if amount > limit:
            amount, basis = limit, "the largest weight of the plane"
            warnings.append(
                f"a change by {100 * share:.3g} % of the largest reading would need more than the largest "
                f"weight of plane {plane!r}: that is proposed"
            )
    else:
        positive("trial weight", amount)
        _check_limit(plane, amount, limit * scale, made, "choose a smaller one")
        amount = amount / scale
        basis = "amount as stated"
    positive("largest weight of the plane", limit if math.isfinite(limit) else 1.0)
    direction = -np.vdot(w, Y)
    angle = float(np.angle(direction)) % (2 * math.pi)
    expected = Y + w * amount * np.exp(1j * angle)
    warnings += _seen(Y, expected, errors or influence.errors, influence.run_errors, plane)
    if np.abs(expected).max() > size:
        worst = int(np.argmax(np.abs(expected).max(axis=0)))
        warnings.append(
            f"with the trial weight sensor {influence.sensors[worst]!r} would read more than the largest "
            "reading now: take less, or begin with another plane"
        )
    found = TrialWeight(
        plane=plane,
        amount=float(amount) * scale,
        angle=angle,
        angle_reach=0.0,
        basis=f"{basis}; angle from the coefficients",
        radius=trial_radius if trial_radius is not None else radius,
        speed=float(influence.speeds.max()),
        load=load,
        speeds=influence.speeds,
        sensors=influence.sensors,
        before=Y,
        expected=expected,
        labels=made,
    )
    if load is not None and found.force is not None:
        warnings += _force_warning(found.force / load)
    return replace(found, warnings=tuple(warnings))


def _seen(
    before: ComplexArray, expected: ComplexArray, errors: ReadingErrors | None, run: RunErrors, plane: str
) -> tuple[str, ...]:
    """Warn of a weight that changes too little: within the errors, or below the engineers' 30 % or 30°."""
    change = np.abs(expected - before)
    if errors is not None:
        single = np.trace(reading_covariance(before, errors), axis1=-2, axis2=-1) / 2
        if (change**2 <= _SEEN**2 * (single + run.variance(before, 0 * before))).all():
            return (
                f"the trial weight in plane {plane!r} changes no reading by more than the errors of two "
                "readings (95 %): its effect would not be determined",
            )
    seen = np.abs(before) > 1e-9 * np.abs(before).max()
    ratio = expected[seen] / before[seen]
    amplitude, phase = np.abs(np.abs(ratio) - 1).max(), np.abs(np.angle(ratio)).max()
    if amplitude < ENGINEERS_AMPLITUDE and phase < ENGINEERS_PHASE:
        return (
            f"the trial weight in plane {plane!r} changes no reading by 30 % or 30° (at most "
            f"{100 * amplitude:.2g} % and {np.degrees(phase):.2g}°): a larger one would be more certain",
        )
    return ()


def _force_warning(fraction: float) -> tuple[str, ...]:
    if fraction <= RISKY:
        return ()
    return (
        f"the force of the trial weight is {100 * fraction:.3g} % of the load, more than {100 * RISKY:g} %: "
        "take less for a first run",
    )


def _check_limit(plane: str, amount: float, limit: float, labels: Labels, remedy: str) -> None:
    positive("largest weight of the plane", limit if math.isfinite(limit) else 1.0)
    if amount > limit * (1 + 1e-12):
        shown = (f"{x * labels.weight_scale:.4g} {labels.weight_in}" for x in (amount, limit))
        first, second = shown
        raise ValueError(
            f"the trial weight of {first} is larger than the largest weight of plane {plane!r}, "
            f"{second}: {remedy}"
        )
