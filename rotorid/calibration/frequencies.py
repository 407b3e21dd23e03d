"""Critical speeds, natural frequencies at rest and shapes as rows of a calibration.

Computed ones are those of `fem.critical_speeds`: of the undamped rotor, turning at the critical speed or, at
rest, in the plane x without gyroscopic moments. Derivatives are central differences of the solved modes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fem.critical import lowest_critical_speeds
from fem.matrices.undamped_matrices import static_stiffness
from fem.model.rotor import Rotor
from fem.model.rotor_parameters import typical_size, with_parameters
from fem.model.supports import Pedestal, Support
from rotorid.base.arrays import FloatArray, IntArray
from rotorid.base.rpm import rpm_text

STEP = 1e-4
"""Of a number's typical size, for central differences."""


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

    def residual(self, start: Rotor, values: Mapping[str, float]) -> FloatArray:
        """Computed less measured, in standard deviations: frequencies, then shapes, each in its best scale.

        ValueError for a rotor that has fewer modes.
        """
        rotor = with_parameters(start, values)
        most = int(self.modes.max())
        found = lowest_critical_speeds(at_rest(rotor) if self.rest else rotor, most)
        moving = np.flatnonzero(found.frequencies > 0)
        if moving.size < most:
            last = rpm_text(float(found.frequencies[-1]))
            raise ValueError(f"the model has only {moving.size} {self.words}, up to {last}, not {most}")
        which = moving[self.modes - 1]
        left = [(found.frequencies[which] - self.frequencies) / self.std]
        if self.nodes:
            computed = found.shapes[np.array(self.nodes) - 1][:, which]
            scale = np.einsum("km,km->m", computed, self.shapes) / np.einsum("km,km->m", computed, computed)
            size = self.shape_std * np.abs(self.shapes).max(axis=0)
            left.append(((computed * scale - self.shapes) / size).ravel())
        return np.concatenate(left)

    def jacobian(self, start: Rotor, values: Mapping[str, float], paths: Sequence[str]) -> FloatArray:
        """Derivatives (rows, n) by the numbers; on one side only, where the other is no rotor.

        ValueError where neither is.
        """
        rotor, here = with_parameters(start, values), self.residual(start, values)
        columns = []
        for path in paths:
            step = STEP * max(typical_size(each, path) for each in (start, rotor))  # a number near 0, too
            ends = []
            for side in (step, -step):
                try:
                    ends.append((side, self.residual(start, {**values, path: values[path] + side})))
                except ValueError:
                    ends.append((0.0, here))
            (above, up), (below, down) = ends
            if above == below:
                raise ValueError(f"the rotor can have no other {path}, neither larger nor smaller")
            columns.append((up - down) / (above - below))
        return np.stack(columns, axis=1)


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
