"""Conventions of a job in words, for its sheet."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from rotorid.files import units

if TYPE_CHECKING:
    from balancing import Labels

_ASSUMED = " Assumed: neither the job nor the command line says so."
_PHASES = {
    "lag": "lag: the angle by which the rotor turns from the pulse to the next positive peak of the sensor.",
    "lead": "lead: the angle by which the rotor turns from a positive peak of the sensor to the next pulse.",
}
_AMPLITUDES = {"pp": "from peak to peak", "rms": "rms"}


def seen_from(labels: Labels) -> str:
    """Say from which end discs are drawn and how the rotor turns there."""
    if labels.view is not None:
        return f"seen from the {labels.view}, where the rotor turns {labels.rotation}"
    way = "counter-clockwise" if labels.drawn_sign > 0 else "clockwise"
    return f"seen from the end from which the rotor turns {way}"


def words(labels: Labels, places: Mapping[str, float], key_phasor: float | None) -> dict[str, str]:
    """Say every convention of a job, by what it is about.

    Parameters
    ----------
    labels
        Units and conventions.
    places
        Direction of each sensor that has one, degrees with the rotation from x.
    key_phasor
        Direction of the key phasor, degrees with the rotation from x; None where nobody states it.
    """

    def stated(angle: float) -> str:
        return f"{np.mod(labels.with_rotation(angle), 360.0):g}°"

    end = "" if labels.view is None else f", seen from the {labels.view}"
    turns = f"{labels.rotation}{end}."
    if labels.rotation is None:
        turns = "not stated: with it is the way in which the surface of the rotor moves; look at the machine."
    pointer = " A fixed pointer sees the numbers rise." if labels.side == "against" else ""
    angles = f"degrees from the mark, {labels.side} the rotation.{pointer}"
    if labels.clock:
        angles = f"degrees from the mark, {labels.angle_words}{end}, {labels.side} the rotation."
    key = "its place is not stated" if key_phasor is None else f"it stands at {stated(key_phasor)} from x"
    sensors = "; ".join(f"{name} at {stated(angle)}" for name, angle in places.items())
    unit = labels.vibration_unit
    kind = _AMPLITUDES.get(unit.rpartition("_")[2], "peak amplitude")
    kind = f" ({kind})" if unit in units.VIBRATION else ""
    at = "mass times radius: divide by the radius to get the mass" if labels.unbalances else "at its radius"
    return {
        "Rotation": turns,
        "Angles of weights": angles + _ASSUMED * ("angles" in labels.assumed),
        "Phase": _PHASES[labels.phase] + _ASSUMED * ("phase" in labels.assumed),
        "Key phasor": f"gives a pulse when the mark on the rotor passes it; {key}.",
        "Sensors": f"{sensors}, from x." if sensors else "as during the runs: directions are not stated.",
        "Vibration": f"in {labels.vibration_in or 'the unit of the runs'}{kind}, the part at 1×.",
        "Weights": f"in {labels.weight_in}, {at}.",
    }
