"""Correction weights and the vibration they should leave, with their errors: numbers alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from typing import Any, Self

import numpy as np

from balancing.conditioning import Conditioning
from balancing.conventions import Labels
from balancing.groups import Unknowns, mapped, static_and_couple
from balancing.influence import Influence, Mounted, in_order
from balancing.methods import Solution, method_words
from balancing.printed_readings import (
    INVISIBLE,
    degrees,
    reading_columns,
    reading_names,
    rms,
    small,
    three_figures,
    vector_columns,
    weight_columns,
)
from balancing.regions import Region, half_width, reach
from balancing.trials import Limits
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, records
from rotorid.base.text import figures

HELD = 1e-5
"""Relative scatter of a weight below which a limit holds it."""
HARDLY_APART = 10.0
"""Above this condition number two planes do the same but for a fifth of their effect."""
STATIC = 0.2
"""Difference of the effects of two planes, relative, below which their sum is called the static part."""


def shown(labels: Labels, size: float, digits: int = 3) -> str:
    """An amplitude, given in SI, with its unit."""
    return f"{figures(size * labels.vibration_scale, digits)} {labels.vibration_in}".rstrip()


def rms_change(labels: Labels, before: ComplexArray, after: ComplexArray) -> str:
    """Root mean squares of readings before and after, in words; rounding is zero to a reader."""
    old, new = (rms(readings) * labels.vibration_scale for readings in (before, after))
    return f"rms {three_figures(old)} → {small(new, old)} {labels.vibration_in}".rstrip()


@dataclass(frozen=True, eq=False)
class Outlook:
    """Weights, and the vibration they should leave. Its fields: `balancing.Correction`."""

    influence: Influence
    weights: ComplexArray
    after_covariance: FloatArray
    check_rms: float
    remove: tuple[str, ...] = field(default=(), kw_only=True)

    @property
    def speeds(self) -> FloatArray:
        """Speeds in rad/s, (S,)."""
        return self.influence.speeds

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the C sensors."""
        return self.influence.sensors

    @property
    def planes(self) -> tuple[str, ...]:
        """Names of the P planes."""
        return self.influence.planes

    @property
    def labels(self) -> Labels:
        """Units and conventions to print in."""
        return self.influence.labels

    @property
    def before(self) -> ComplexArray:
        """Vibration of the bare rotor, (S, C)."""
        return self.influence.baseline

    @property
    def after(self) -> ComplexArray:
        """Its prediction with the corrections mounted, (S, C)."""
        return self.before + self.influence.W @ self.weights

    @property
    def errors_known(self) -> bool:
        """Whether it is known how far a check run may be from its prediction."""
        return bool(np.isfinite(self.check_rms))

    def places(self, planes: Sequence[str], weights: ComplexArray) -> FloatArray:
        """Where to work, degrees as the job counts them: opposite to a weight where material is removed."""
        turn = [180.0 if plane in self.remove else 0.0 for plane in planes]
        return (self.labels.weight(weights)[1] + turn) % 360

    def work_words(self, planes: Sequence[str], weights: ComplexArray) -> list[str]:
        """What to add to each plane, or to take away from it, where it is something."""
        each = zip(planes, weights, self.places(planes, weights), strict=True)
        return [
            f"{plane} {'less ' * (plane in self.remove)}{self.labels.weight_words(abs(w))} at {degrees(at)}"
            for plane, w, at in each
            if w
        ]

    @property
    def within(self) -> FloatArray:
        """Radius (S, C) of the 95 % region of each reading in a check run, in the job's unit."""
        if not self.errors_known:
            return np.full(self.before.shape, np.nan)
        return reach(self.after_covariance) * self.labels.vibration_scale

    def vibration_columns(self) -> tuple[Column, ...]:
        """Speed, sensor, vibration before and after, one row a reading."""
        nothing = INVISIBLE * float(np.abs(self.before).max()) * self.labels.vibration_scale
        return (
            *reading_columns(self.labels, self.speeds, self.sensors),
            *vector_columns(self.labels, "before", self.before),
            *vector_columns(self.labels, "after", self.after, nothing),
        )

    def work_rows(self, planes: Sequence[str], weights: ComplexArray) -> list[dict[str, Any]]:
        """Weights of planes as JSON types, and where to take material away from some."""
        columns = self.work_columns(planes, weights)
        return records(columns if self.remove else columns[:-2])

    def work_columns(self, planes: Sequence[str], weights: ComplexArray) -> tuple[Column, ...]:
        """Weights of planes, and where to take material away from some."""
        gone = [plane in self.remove for plane in planes]
        return (
            *weight_columns(self.labels, planes, weights),
            Column("action", ["remove" if away else "add" for away in gone]),
            Column("remove_at_deg", np.where(gone, self.places(planes, weights), np.nan)),
        )


@dataclass(frozen=True, eq=False)
class Prediction(Outlook):
    """What a method gives, and how its weights err. Its fields: `balancing.Correction`."""

    draws: ComplexArray
    mounted: Mounted
    conditioning: Conditioning
    fitted: Solution
    method: str
    row_weights: FloatArray | None = None
    limits: Limits | None = None
    unknowns: Unknowns | None = None

    @property
    def region_known(self) -> bool:
        """Whether it is known how far the weights may be from the best ones; not for a biased ridge."""
        return len(self.draws) > 2 * len(self.planes)

    def region(self, planes: Sequence[int] | None = None) -> Region:
        """Where the weights of these planes (by index; None: all) are jointly with 95 %."""
        chosen = list(range(len(self.planes)) if planes is None else planes)
        return Region.of(self.draws[:, chosen], self.weights[chosen])

    @property
    def covariance(self) -> FloatArray:
        """Covariance of (Re D₁, Im D₁, …), (2P, 2P); NaN where errors are unknown."""
        return self.region().covariance

    @cached_property
    def _off(self) -> tuple[FloatArray, FloatArray]:
        """How far draws (n, P) are off in size, along a weight within its own error, and in angle (rad)."""
        size = np.abs(self.weights)
        draws = self.draws if self.region_known else np.full((1, len(size)), np.nan)
        along = draws / np.exp(1j * np.angle(self.weights))
        sizes = np.where(self.clear, np.abs(draws), along.real) - size
        return sizes, np.where(self.clear, np.angle(along), np.nan)

    @cached_property
    def clear(self) -> BoolArray:
        """Whether the 95 % region of each weight (P,) leaves zero out, so that its angle is determined."""
        if not self.region_known:
            return np.ones(len(self.weights), dtype=bool)
        return np.array([bool(w) and not self.region([p]).holds(0 * w) for p, w in enumerate(self.weights)])

    @property
    def mass_std(self) -> FloatArray:
        """Standard deviation (P,) of the weights' sizes; NaN where errors are unknown."""
        return np.asarray(self._off[0].std(axis=0))

    @property
    def angle_std(self) -> FloatArray:
        """Standard deviation (P,) of the weights' angles, rad; NaN for one whose 95 % region holds zero."""
        return np.asarray(self._off[1].std(axis=0))

    def half_widths(self) -> tuple[FloatArray, FloatArray]:
        """Half widths (P,) of 95 % intervals of the weights' sizes and angles (rad); NaN: not known."""
        return half_width(self._off[0]), half_width(self._off[1])

    @property
    def parts(self) -> Self | None:
        """The weights as those of groups, or of two planes as static part and couple; None: neither."""
        of = self.unknowns or static_and_couple(self.planes)
        if of is None:
            return None
        influence, (weights, draws) = (
            mapped(self.influence, of.names, of.shares),
            (each @ of.inverse.T for each in (self.weights, self.draws)),
        )
        return replace(
            self, influence=influence, weights=weights, draws=draws, remove=(), limits=None, unknowns=None
        )

    @property
    def told_apart(self) -> bool:
        """Whether planes act differently enough, or the regions of their weights leave zero out."""
        alike = self.conditioning.condition_number > HARDLY_APART
        return not alike or bool(self.clear[self.conditioning.weakest].all())

    @property
    def combination(self) -> str:
        """What is determined of two planes that are hardly told apart, and what is not; else empty.

        The columns w of both planes, scaled to length 1, differ by little but a factor: w₂ ≈ ρ w₁. Then
        D₁ + ρ D₂, the weight in the first plane that does the same, is determined, and
        (D₁ − ρ D₂) / 2 is not. With ρ ≈ 1 they are the static part and the couple. Where the regions of both
        weights leave zero out, each is determined, whatever the couple.
        """
        apart, labels = self.conditioning, self.labels
        if len(self.planes) != 2 or self.told_apart:
            return ""
        v = apart.directions[:, 0].conj() * apart.lengths
        static = abs(v[1] / v[0] - 1) < STATIC
        ratio = 1.0 if static else v[1] / v[0]
        ways = np.array([[1, 0.5], [ratio, -0.5 * ratio]])
        both, widths = self.weights @ ways, half_width((self.draws - self.weights) @ ways)
        if abs(both[1]) > widths[1]:
            return ""
        size, angle = map(float, labels.weight(both[0]))
        sure, open_ = (figures(width * labels.weight_scale, 2) for width in widths)
        unit = labels.weight_in
        shown = f"{three_figures(size)} ± {sure} {unit} at {degrees(angle)}"
        if static:
            return f"static part {shown}; couple not determined: ± {open_} {unit}"
        first, second = map(repr, self.planes)
        return (
            f"planes {first} and {second} together do what {shown} would in {first} alone; "
            f"how it is shared between them is not determined: ± {open_} {unit}"
        )

    @property
    def to_add(self) -> ComplexArray:
        """What to add to the weights mounted now, one per plane of `mounted`."""
        return in_order(self.weights, self.planes, self.mounted.planes) - self.mounted.weights

    @property
    def active(self) -> tuple[str, ...]:
        """Limits that bind, in words."""
        limits, fitted = self.limits, self.fitted
        if limits is None:
            return ()
        labels = self.labels
        weights = zip(self.planes, map(labels.weight_words, limits.max_weight), strict=True)
        names = reading_names(labels, self.sensors, self.speeds)
        readings = zip(names, map(labels.amplitude_words, limits.residual.ravel()), strict=True)
        at_end = [
            D != 0 and any(abs(np.angle(D * np.exp(-1j * end))) < 1e-6 for a, w in arcs for end in (a, a + w))
            for D, arcs in zip(self.weights, limits.forbidden, strict=True)
        ]
        heavy, high = compress(weights, fitted.active_weights), compress(readings, fitted.active_residuals)
        return (
            *(f"plane {name!r} has its largest weight, {most}" for name, most in heavy),
            *(f"{name} has its largest amplitude, {most}" for name, most in high),
            *(
                f"plane {name!r} stands at the end of a forbidden arc"
                for name in compress(self.planes, at_end)
            ),
        )

    @property
    def held(self) -> BoolArray:
        """Which weights (P,) limits hold, so that errors do not move their sizes."""
        return self.half_widths()[0] < HELD * np.abs(self.weights)

    @property
    def method_in_words(self) -> str:
        """What the method makes small, a sentence."""
        return method_words(self.method, weighted=self.row_weights is not None)

    def limits_document(self) -> dict[str, Any] | None:
        """Of weights and angles, where to work, and of readings in the order of `residuals`; None: no limits.

        In the job's own units; an infinite limit is None.
        """
        if self.limits is None:
            return None
        arcs = {
            plane: [self.labels.arc(*arc, opposite=plane in self.remove) for arc in forbidden]
            for plane, forbidden in zip(self.planes, self.limits.forbidden, strict=True)
        }
        most = self.limits.max_weight * self.labels.weight_scale
        return plain(
            {
                "max_weight": dict(zip(self.planes, most.tolist(), strict=True)),
                "amplitude": self.limits.residual.ravel() * self.labels.vibration_scale,
                "forbidden_deg": {plane: each for plane, each in arcs.items() if each},
            }
        )
