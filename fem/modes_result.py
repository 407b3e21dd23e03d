"""Critical speeds and mode shapes: the result; they are found in `fem.critical`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fem.model.rotor import Rotor
from fem.parameter_bands import NORMAL_95
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.rpm import RPM
from rotorid.base.tables import Column, Table, frame, terminal
from rotorid.base.text import counted, error_figures, listing

if TYPE_CHECKING:
    import pandas as pd

_NAMED = 6  # critical speeds in the first sentence


@dataclass(frozen=True, eq=False)
class Modes(Answered):
    """The lowest critical speeds of a rotor, and its shapes there.

    Attributes
    ----------
    frequencies
        Critical speeds: where the frequency of free whirl equals the speed of rotation, rad/s, ascending,
        shape (n,); 0 for a rigid-body motion.
    shapes
        Lateral deflection of each node in each mode, shape (N, n), scaled to 1 at the first node, or to
        the largest value 1 where the first node is a node of the mode. On supports that differ in x and y
        this is the deflection in the direction (x or y) in which the rotor moves more.
    slopes
        Slopes of these shapes at the nodes, 1/m per unit of deflection in m, shape (N, n); with shear, the
        tilt of the cross-section.
    rotor
        The rotor.
    direction
        Of each mode: "forward" (with the rotation), "backward", or "mixed" where the orbits of different
        nodes turn in different directions or are straight lines. On rotationally symmetric supports
        only forward critical speeds are listed: unbalance does not excite the others.
    x, y
        Complex amplitudes of both lateral directions, shape (N, n), in the scale of `shapes`.
    warnings
        What the reader must know.
    cut
        Which critical speeds the bearing tables hold beyond the n asked for; else empty.
    std
        Standard deviations of `frequencies`, from the calibration of the rotor; None without.
    """

    frequencies: FloatArray
    shapes: FloatArray
    slopes: FloatArray
    rotor: Rotor
    direction: tuple[str, ...]
    x: ComplexArray
    y: ComplexArray
    warnings: tuple[str, ...] = ()
    cut: str = ""
    std: FloatArray | None = None

    @property
    def positions(self) -> FloatArray:
        """Axial position of each node, m, shape (N,)."""
        return self.rotor.positions

    @property
    def rpm(self) -> FloatArray:
        """Critical speeds in revolutions per minute, shape (n,)."""
        return self.frequencies * RPM

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON, keys as in INTERFACE.md, `rotorid critical`."""
        own = {} if self.std is None else {"critical_speeds_std_rad_s": self.std}
        return plain(
            {
                "critical_speeds_rad_s": self.frequencies,
                **own,
                "critical_speeds_rpm": self.rpm,
                "positions_m": self.positions,
                "mode_shapes": self.shapes.T,
                "direction": self.direction,
                "critical_speeds_cut": self.cut or None,
                "warnings": self.warnings,
            }
        )

    def tables(self) -> tuple[Table, ...]:
        """The critical speeds; and the shapes, a row for each node."""
        ways = zip(self.frequencies, self.direction, strict=True)
        rpm, speed = "critical_speeds_rpm.*", "critical_speeds_rad_s.*"
        errors = () if self.std is None else (NORMAL_95 * RPM * self.std,)
        speeds = (
            Column("mode", range(1, self.frequencies.size + 1)),
            Column("whirl", ["rigid body" if speed == 0 else way for speed, way in ways]),
            Column("rpm", self.rpm, "{:.2f}".format, rpm),
            *(Column("± (95 %)", values, error_figures) for values in errors),
            Column("Hz", self.frequencies / math.tau, "{:.4f}".format, speed, 1 / math.tau),
            Column("rad/s", self.frequencies, "{:.4f}".format, speed),
        )
        shapes = (
            Column("node", range(1, self.rotor.n_nodes + 1)),
            Column("position_m", self.positions, "{:.6g}".format, "positions_m.*"),
            *(
                Column(f"mode_{k + 1}", shape, "{:.4f}".format, f"mode_shapes.{k}.*")
                for k, shape in enumerate(self.shapes.T)
            ),
        )
        return (Table("critical speeds", speeds), Table("mode shapes", shapes))

    def to_frame(self) -> pd.DataFrame:
        """One row per node: number, position and the deflection in each mode."""
        return frame(self.tables()[1])

    def sentence(self) -> str:
        """How many there are, and the first."""
        return self.answer.judgement

    @property
    def answer(self) -> Answer:
        """The critical speeds, in rpm, Hz and rad/s."""
        own = [f"{speed:.6g}" for speed in self.rpm if speed > 0]
        shown = listing(own, "and") if len(own) < _NAMED else f"{', '.join(own[:_NAMED])} …"
        judgement = f"{counted(len(own), 'critical speed')} without damping{f': {shown} rpm' if own else ''}."
        cut = (self.cut,) if self.cut else ()
        return Answer(judgement, terminal(self.tables()[0]), self.warnings, cut)
