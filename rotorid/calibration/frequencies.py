"""Critical speeds, natural frequencies at rest and shapes as rows of a calibration.

Computed ones are those of `fem.critical_speeds`: of the undamped rotor, turning at the critical speed or, at
rest, in the plane x without gyroscopic moments. Derivatives are central differences of the solved modes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fem.critical import NOT_COUNTED, lowest_critical_speeds
from fem.matrices.undamped_matrices import static_stiffness
from fem.model.rotor import Rotor
from fem.model.rotor_parameters import (
    as_they_stand,
    is_reading,
    typical_size,
    with_changes,
    with_parameters,
)
from fem.model.supports import Pedestal, Support
from rotorid.base.arrays import FloatArray, IntArray
from rotorid.base.rpm import rpm_text

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
        """How many scales of shapes are found besides."""
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
            if not (is_reading(path) or all(each.symmetric for _, each in _beside(rotor, path))):
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
        found = lowest_critical_speeds(at_rest(rotor) if self.rest else rotor, most)
        if below := next((said for said in found.warnings if NOT_COUNTED in said), ""):
            raise ValueError(f"{below}: extend the tables")
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
        """Derivatives (rows, n) by the numbers.

        Over bearing tables a search at every step would take long: there Ω = f(Ω, θ) with the frequency f on
        supports as they are at Ω, so that dΩ = ∂f/∂θ dθ / (1 − ∂f/∂Ω).
        """
        rotor, m = with_parameters(start, values), len(self.modes)
        own = {path: values[path] for path in paths if not is_reading(path)}
        shapes = np.full(m * len(self.nodes), ROUNDING[1] / self.shape_std)
        tiny = np.append(ROUNDING[0] * self.frequencies / self.std, shapes)
        rows = self._over_tables(rotor) if not (self.rest or rotor.constant) else self.residual
        K = np.zeros((tiny.size, len(own)))
        for k, path in enumerate(own):
            (up, one), (down, other) = _beside(rotor, path)
            change = rows(one, {}) - rows(other, {})
            if (np.abs(change) > tiny).any():
                K[:, k] = change / (up - down)
        by_own = K @ as_they_stand(start, own)
        found = np.zeros((tiny.size, len(paths)))
        found[:, [k for k, path in enumerate(paths) if path in own]] = by_own
        return found

    def _over_tables(self, rotor: Rotor) -> Callable[[Rotor, Mapping[str, float]], FloatArray]:
        """Frequencies of rotors near this one, at the supports and modes of its critical speeds, as rows."""
        most = int(self.modes.max())
        speeds = self.frequencies + self.std * self.residual(rotor, {})

        def listed(other: Rotor, speed: float) -> FloatArray:
            return lowest_critical_speeds(as_at(other, speed), most).frequencies

        which = [int(np.abs(listed(rotor, speed) - speed).argmin()) for speed in speeds]
        step = STEP * speeds
        ends = [
            [listed(rotor, v)[k] for v in (w + h, w - h)] for w, h, k in zip(speeds, step, which, strict=True)
        ]
        steeper = 1.0 - (np.array(ends) @ (1.0, -1.0)) / (2 * step)

        def rows(other: Rotor, _: Mapping[str, float]) -> FloatArray:
            found = [listed(other, speed)[k] for speed, k in zip(speeds, which, strict=True)]
            return np.asarray((found - self.frequencies) / self.std / steeper)

        return rows


def as_at(rotor: Rotor, speed: float) -> Rotor:
    """The undamped rotor on supports as they are at a speed."""
    return replace(
        rotor,
        supports=[
            replace(s, stiffness=tuple(map(tuple, s.at(speed)[0].tolist())), damping=0.0, speeds=())
            for s in rotor.supports
        ],
    )


def _beside(rotor: Rotor, path: str) -> list[tuple[float, Rotor]]:
    """Changes of a number, and the rotors with a little more and a little less: none where that cannot be."""
    step = STEP * typical_size(rotor, path)
    found = []
    for by in (step, -step):
        try:
            found.append((by, with_changes(rotor, {path: by})))
        except ValueError:
            found.append((0.0, rotor))
    return found


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
