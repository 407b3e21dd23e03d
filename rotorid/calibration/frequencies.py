"""Critical speeds, natural frequencies at rest and shapes as rows of a calibration.

Computed ones are those of `fem.critical_speeds`: of the undamped rotor, turning at the critical speed or, at
rest, in the plane x without gyroscopic moments. Derivatives are central differences of the solved modes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fem import (
    NOT_COUNTED,
    Pedestal,
    Rotor,
    Support,
    critical_speeds_near,
    is_reading,
    lowest_critical_speeds,
)
from fem.assembly import static_stiffness
from fem.parameters import typical_size, with_changes, with_parameters
from rotorid.base.arrays import FloatArray, IntArray
from rotorid.base.rpm import rpm_text
from rotorid.calibration.unknowns import as_they_stand

STEP = 1e-4
"""Of a number's typical size, for central differences."""
ROUNDING = 1e-12, 1e-7
"""Of frequencies and shapes: a number whose step makes less is not seen."""


@dataclass(frozen=True, eq=False)
class MeasuredFrequencies:
    """Measured modes of one kind.

    Attributes
    ----------
    modes
        Their numbers from 1, ascending frequencies, (m,).
    frequencies, std
        rad/s and one standard deviation, (m,).
    rest
        Natural frequencies at rest, not critical speeds.
    nodes, shapes, shape_std
        Nodes of the shapes (k,), values in any scale (k, m), and their standard deviation relative to the
        largest of a shape; none: frequencies alone.
    """

    modes: IntArray
    frequencies: FloatArray
    std: FloatArray
    rest: bool = False
    nodes: tuple[int, ...] = ()
    shapes: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    shape_std: float = 0.05

    @property
    def words(self) -> str:
        """What they are."""
        return "natural frequencies at rest" if self.rest else "critical speeds"

    @property
    def scales(self) -> int:
        """How many scales of shapes are estimated besides."""
        return len(self.modes) if self.nodes else 0

    def check(self, start: Rotor, values: Mapping[str, float], paths: Sequence[str]) -> None:
        """Refuse numbers that change which critical speeds are listed.

        Raises
        ------
        ValueError
            For supports that are alike in x and y, and would not be with another number.
        """
        rotor = with_parameters(start, values)
        if self.rest or not rotor.symmetric:
            return
        for path in paths:
            if not (is_reading(path) or all(each.symmetric for _, each in _beside(start, rotor, path))):
                raise ValueError(
                    f"{path} alone makes supports differ in x and y: then backward critical speeds count, "
                    "too, and the numbers of modes are others; estimate what keeps them alike (as "
                    "bearing[1].stiffness does), or write the rotor file with supports that differ"
                )

    def residual(self, start: Rotor, values: Mapping[str, float]) -> FloatArray:
        """Computed less measured, in standard deviations: frequencies, then shapes, each in its best scale.

        ValueError for a rotor that has fewer modes.
        """
        rotor = with_parameters(start, values)
        most = int(self.modes.max())
        computed = lowest_critical_speeds(at_rest(rotor) if self.rest else rotor, most)
        if below := next((warning for warning in computed.warnings if NOT_COUNTED in warning), ""):
            raise ValueError(f"{below}: extend the tables")
        moving = np.flatnonzero(computed.frequencies > 0)
        if moving.size < most:
            last = rpm_text(float(computed.frequencies[-1]))
            raise ValueError(f"the model has only {moving.size} {self.words}, up to {last}, not {most}")
        which = moving[self.modes - 1]
        left = [(computed.frequencies[which] - self.frequencies) / self.std]
        if self.nodes:
            shapes = computed.shapes[np.array(self.nodes) - 1][:, which]
            scale = np.einsum("km,km->m", shapes, self.shapes) / np.einsum("km,km->m", shapes, shapes)
            size = self.shape_std * np.abs(self.shapes).max(axis=0)
            left.append(((shapes * scale - self.shapes) / size).ravel())
        return np.concatenate(left)

    def jacobian(self, start: Rotor, values: Mapping[str, float], paths: Sequence[str]) -> FloatArray:
        """Derivatives (rows, n) by the numbers; frequencies over tables are followed, not searched again."""
        rotor, m = with_parameters(start, values), len(self.modes)
        of_rotor = {path: values[path] for path in paths if not is_reading(path)}
        follow = not (self.rest or self.nodes or rotor.constant)
        here = self.residual(rotor, {}) * self.std + self.frequencies if follow else None
        shapes = np.full(m * len(self.nodes), ROUNDING[1] / self.shape_std)
        tiny = np.append(ROUNDING[0] * self.frequencies / self.std, shapes)
        K = np.zeros((tiny.size, len(of_rotor)))
        for k, path in enumerate(of_rotor):
            (up, one), (down, other) = _beside(start, rotor, path)
            if here is None:
                change = self.residual(one, {}) - self.residual(other, {})
            else:
                change = (critical_speeds_near(one, here) - critical_speeds_near(other, here)) / self.std
            if (np.abs(change) > tiny).any():
                K[:, k] = change / (up - down)
        by_all = np.zeros((tiny.size, len(paths)))
        by_all[:, [k for k, path in enumerate(paths) if path in of_rotor]] = K @ as_they_stand(
            start, of_rotor
        )
        return by_all


def _beside(start: Rotor, rotor: Rotor, path: str) -> list[tuple[float, Rotor]]:
    """Changes of a number, and the rotors with a little more and a little less: none where that cannot be."""
    step = STEP * max(typical_size(each, path) for each in (start, rotor))  # a number near 0, too
    pair = []
    for by in (step, -step):
        try:
            pair.append((by, with_changes(rotor, {path: by})))
        except ValueError:
            pair.append((0.0, rotor))
    return pair


def at_rest(rotor: Rotor) -> Rotor:
    """The rotor whose critical speeds are the natural frequencies of this one at rest, in the plane x."""

    def plane_x(support: Support) -> Support:
        speed = support.speeds[0] if support.speeds else 0.0
        stand = support.pedestal
        if stand is not None:
            stand = Pedestal(stand.mass, stand.xy("stiffness")[0])
        stiffness = float(static_stiffness(support, speed)[0, 0])
        return replace(support, stiffness=stiffness, damping=0.0, speeds=(), pedestal=stand)

    model = replace(rotor.model, gyroscopic=False)
    return replace(rotor, model=model, supports=tuple(plane_x(support) for support in rotor.supports))
