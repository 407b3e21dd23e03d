"""Phase and angle conventions of a job, with its units: signs of lead and lag, in and out.

Inside, every vibration is a complex amplitude with positive phase = lead, every weight is complex with
its angle counted with the rotation. Only a `Labels` object, made where files are read, knows how the
people of the job write them. The signs are derived in docs/conventions.md.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import ComplexArray, FloatArray, polar
from rotorid.base.text import SPEEDS, Angles, Phase, Rotation, View, vibration_unit_words, weight_unit_words

PHASES = ("lead", "lag")
ANGLES = ("with rotation", "against rotation")
Angle = TypeVar("Angle", float, FloatArray)


@dataclass(frozen=True)
class Labels:
    """Units and conventions of a job.

    Attributes
    ----------
    vibration_unit, vibration_scale
        Name of the unit ("um_pp"; "" if the readings had none) and shown = inside × scale.
    weight_unit, weight_scale
        Name ("g", "g_mm") and shown = inside × scale.
    phase
        Whether a positive phase leads or lags.
    angles
        Whether angles on the rotor count with or against the rotation.
    speed_unit
        In which the readings give the speed: "rpm", "rad_s" or "Hz".
    rotation
        How the rotor turns, seen from the end of `view`; None where the job does not say.
    view
        The end from which `rotation` is seen and discs are drawn; None where the job does not say.
    clock
        Whether the job calls its angles clockwise or counter-clockwise instead of with or against the
        rotation.
    assumed
        Which of "phase" and "angles" nobody states, although they matter.

    Raises
    ------
    ValueError
        If `phase` or `angles` is none of its words, and where `clock` is set or `view` is
        given without `rotation`.
    """

    vibration_unit: str = "m"
    vibration_scale: float = 1.0
    weight_unit: str = "kg"
    weight_scale: float = 1.0
    phase: Phase = "lead"
    angles: Angles = "with rotation"
    speed_unit: str = "rpm"
    rotation: Rotation | None = None
    view: View | None = None
    clock: bool = False
    assumed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        turns = "clockwise", "counter-clockwise"
        for name, word, words in (
            ("phase", self.phase, PHASES),
            ("angles", self.angles, ANGLES),
            ("rotation", self.rotation or turns[0], turns),
        ):
            if word not in words:
                raise ValueError(f"{name} must be {' or '.join(map(repr, words))}, not {word!r}")
        if self.rotation is None and (self.clock or self.view is not None):
            what = f"a view from the {self.view}"
            if self.clock:
                what = "angles that count clockwise or counter-clockwise"
            raise ValueError(
                f"{what} cannot be understood without the direction of rotation seen from the same end: "
                "state rotation as clockwise or counter-clockwise"
            )

    def vibration_from(self, amplitude: ArrayLike, phase: ArrayLike) -> ComplexArray:
        """Vibrations from amplitudes (SI) and phases (rad) as the job counts them; turns back `vibration`.

        A reading s(t) = A cos(ω t + φ) has the lead φ and is A e^{iφ}. A job that writes the lag −φ writes
        its conjugate.
        """
        return polar(amplitude, self.phase_sign * np.asarray(phase))

    def weight_from(self, size: ArrayLike, angle: ArrayLike) -> ComplexArray:
        """Weights from sizes (SI) and angles (rad) as the job counts them; turns back `weight`.

        A weight m at α with the rotation is m e^{iα}. A job that counts against the rotation writes −α.
        """
        return polar(size, self.angle_sign * np.asarray(angle))

    def vibration(self, amplitude: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Amplitude in the job's unit and phase in degrees, 0 ≤ phase < 360, as the job counts it."""
        return _polar(amplitude, self.vibration_scale, self.phase_sign)

    def weight(self, weight: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Weight in the job's unit and angle in degrees, 0 ≤ angle < 360, as the job counts it."""
        return _polar(weight, self.weight_scale, self.angle_sign)

    def with_rotation(self, angle: Angle) -> Angle:
        """Angles counted as the job does, counted with the rotation; the same turns them back. Any unit."""
        return self.angle_sign * angle + 0.0

    def arc(self, start: float, width: float, *, opposite: bool = False) -> list[float]:
        """From and to, degrees as the job writes them, of an arc's first angle and width, rad."""
        ends = np.degrees([start, start + width])[:: self.angle_sign] * self.angle_sign
        return [float(round(end, 9)) for end in np.mod(ends + (180.0 if opposite else 0.0), 360.0)]

    @property
    def vibration_in(self) -> str:
        """The unit of the readings as people write it: "µm pp"; "" if they have none."""
        return vibration_unit_words(self.vibration_unit)

    @property
    def weight_in(self) -> str:
        """The unit of the weights as people write it: "g·mm"."""
        return weight_unit_words(self.weight_unit)

    @property
    def speed_in(self) -> str:
        """The unit of the speeds as people write it: "rad/s"."""
        return SPEEDS[self.speed_unit][0]

    def speed_words(self, speed: float) -> str:
        """A speed, given in rad/s, in the unit of the readings: "1220 rpm"."""
        return f"{self.speed_number(speed)} {self.speed_in}"

    def speed_number(self, speed: float) -> str:
        """A speed in the job's unit, without the name of the unit."""
        return f"{speed * SPEEDS[self.speed_unit][1]:.6g}"

    def amplitude_words(self, size: float) -> str:
        """An amplitude, given in SI."""
        return f"{size * self.vibration_scale:.4g} {self.vibration_in}".rstrip()

    def weight_words(self, size: float) -> str:
        """The size of a weight, given in SI."""
        return f"{size * self.weight_scale:.4g} {self.weight_in}".rstrip()

    def weight_entry(self, weight: complex) -> dict[str, float]:
        """A weight as JSON has it: `mass` in the job's unit and `angle_deg`, without the last digits."""
        size, angle = self.weight(weight)
        return {"mass": float(f"{size:.12g}"), "angle_deg": float(f"{angle:.12g}")}

    def weight_at(self, weight: complex) -> str:
        """A weight as text, such as "35 g at 120.0°"."""
        size, angle = self.weight(weight)
        return f"{size:.4g} {self.weight_in} at {angle:.1f}°"

    def directions(self, angles: FloatArray) -> list[float]:
        """Angles in rad with the rotation in degrees as the job counts them, without the last digits."""
        return [float(f"{angle:.12g}") for angle in self.weight(np.exp(1j * angles))[1]]

    def vibration_covariance(self, covariance: FloatArray) -> FloatArray:
        """Covariance (…, 2, 2) of amplitude·cos(phase) and amplitude·sin(phase) as the job writes them."""
        return _mirror(covariance, self.vibration_scale, self.phase_sign)

    def weight_covariance(self, covariance: FloatArray) -> FloatArray:
        """Covariance (…, 2, 2) of mass·cos(angle) and mass·sin(angle) as the job writes them."""
        return _mirror(covariance, self.weight_scale, self.angle_sign)

    @property
    def phase_sign(self) -> int:
        """+1 for lead, −1 for lag."""
        return 1 if self.phase == "lead" else -1

    @property
    def angle_sign(self) -> int:
        """+1 with the rotation, −1 against it."""
        return 1 if self.angles == "with rotation" else -1

    @property
    def unbalances(self) -> bool:
        """Whether weights are unbalances, mass × radius, and not masses."""
        return "_" in self.weight_unit

    @property
    def angle_words(self) -> str:
        """How angles count, in the word of the job: "with rotation", or "clockwise" seen from `view`."""
        if not self.clock or self.rotation is None:
            return self.angles
        if self.angle_sign > 0:
            return self.rotation
        return "counter-clockwise" if self.rotation == "clockwise" else "clockwise"

    @property
    def side(self) -> str:
        """How angles count: "with" or "against" the rotation."""
        return self.angles.partition(" ")[0]

    @property
    def angles_on_paper(self) -> int:
        """+1 where angles as the job counts them grow counter-clockwise in a picture, −1 clockwise."""
        return self.angle_sign * self.drawn_sign

    @property
    def drawn_sign(self) -> int:
        """+1 where the rotor drawn from the stated end turns counter-clockwise (or nothing is stated)."""
        return -1 if self.rotation == "clockwise" else 1

    def otherwise(self, names: Collection[str]) -> Labels:
        """The labels with "phase", "angles" or both turned round."""
        turned: dict[str, Any] = {
            "phase": "lag" if self.phase == "lead" else "lead",
            "angles": "against rotation" if self.angle_sign > 0 else "with rotation",
        }
        return replace(self, **{name: turned[name] for name in names})

    def assumed_in_words(self) -> str:
        """One sentence about what is assumed; empty where nothing is."""
        if not self.assumed:
            return ""
        asked = {"phase": "whether phases lead or lag", "angles": "how angles count"}
        words = {"phase": self.phase, "angles": self.angle_words}
        missing, taken = (" and ".join(each[name] for name in self.assumed) for each in (asked, words))
        are = "is" if len(self.assumed) == 1 else "are"
        return f"Neither the job nor the command line says {missing}; {taken} {are} assumed."

    def turning_in_words(self) -> str:
        """One clause for captions: how angles count and how the rotor turns."""
        end = "" if self.view is None else f" seen from the {self.view}"
        if self.clock:
            return f"angles from the mark {self.angle_words}{end}, the rotor turns {self.rotation}"
        turns = "" if self.rotation is None else f", which is {self.rotation}{end}"
        return f"angles from the mark {self.side} the rotation{turns}"

    def conventions(self) -> dict[str, Any]:
        """The conventions in the words of the job file; rotation and view only where they are stated."""
        words = {
            "phase": self.phase,
            "angles": self.angle_words,
            "vibration_unit": self.vibration_unit,
            "weight_unit": self.weight_unit,
            "assumed": list(self.assumed),
            "rotation": self.rotation,
            "view": self.view,
        }
        return {name: each for name, each in words.items() if each is not None}


def _polar(value: ArrayLike, scale: float, sign: int) -> tuple[FloatArray, FloatArray]:
    z = np.asarray(value, dtype=complex)
    angle = np.mod(sign * np.degrees(np.angle(z)), 360.0)
    return np.abs(z) * scale, np.mod(angle, 360.0)  # what is hardly below 0 is rounded to 360


def _mirror(covariance: FloatArray, scale: float, sign: int) -> FloatArray:
    return np.asarray(covariance * scale**2 * np.array([[1, sign], [sign, 1]]))
