"""Correction weights with the vibration they should leave: numbers, errors, tables and text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from balancing.conditioning import Conditioning
from balancing.convention_test import ConventionTest, OtherReading, assumptions
from balancing.conventions import Labels
from balancing.influence import Influence, Mounted
from balancing.methods import Solution, method_words
from balancing.regions import NORMAL_RADIUS, Region, half_width, reach, real_parts
from balancing.tables import (
    INVISIBLE,
    ROUNDING,
    covariance_column,
    degrees,
    error_document,
    error_words,
    largest_readings,
    reading_columns,
    reading_names,
    rms,
    small,
    three_figures,
    vector_columns,
    weight_columns,
    weight_rows,
)
from balancing.trials import Limits
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import BoolArray, ComplexArray, FloatArray
from rotorid.base.json import cell, plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import capital, counted, cut, figures, listing, wrap

if TYPE_CHECKING:
    import pandas as pd

HELD = 1e-5
"""Relative scatter of a weight below which a limit holds it."""
_TOUCHES = 2e-3
"""Relative distance from a limit that counts as none (the solver stays a little inside)."""
_NAME = 16
"""So many letters of the name of a run stand over a column."""


@dataclass(frozen=True, eq=False)
class Choice:
    """Weights in some planes, and the root mean square that they leave: predicted, and of its errors."""

    planes: tuple[str, ...]
    weights: ComplexArray
    rms: float
    error: float

    @property
    def expected(self) -> float:
        """Root mean square with the errors."""
        return float(np.hypot(self.rms, self.error))

    @property
    def most(self) -> float:
        """What they leave at most with 95 %."""
        return float(self.rms + NORMAL_RADIUS / np.sqrt(2) * self.error)


@dataclass(frozen=True, eq=False)
class MountDecision:
    """One judgement of a correction.

    Attributes
    ----------
    word
        "mount", "do not mount", or "measure again" (runs contradict each other besides).
    cause
        A clause; empty: nothing is wrong.
    instead
        What to do, in sentences.
    before, expected
        Root mean square without the weights, and in a check run with them, errors included.
    choices
        Fewer planes, the one with the smallest expected vibration first; those that keep the limits.
    warnings, notes
        What is not determined, what contradicts, what to do; what the user may want to know.
    """

    word: Literal["mount", "do not mount", "measure again"] = "mount"
    cause: str = ""
    instead: tuple[str, ...] = ()
    before: float = 0.0
    expected: float = 0.0
    choices: tuple[Choice, ...] = ()
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, in the job's units."""
        scale = labels.vibration_scale
        return {
            "word": self.word,
            "cause": self.cause or None,
            "instead": list(self.instead),
            "rms_before": self.before * scale,
            "rms_expected": self.expected * scale,
            "fewer_planes": [
                {
                    "planes": list(c.planes),
                    "rms_after": c.rms * scale,
                    "rms_expected": c.expected * scale,
                    "largest_weight": float(np.abs(c.weights).max() * labels.weight_scale),
                }
                for c in self.choices
            ],
        }

    def lines(self) -> tuple[str, ...]:
        """Sentences; none for "mount"."""
        if self.word == "mount":
            return ()
        heads = {"do not mount": "Do not mount these weights", "measure again": "Measure again"}
        return (f"{heads[self.word]}: {self.cause}.", *self.instead)


@dataclass(frozen=True, eq=False)
class Correction(Answered):
    """Weights to mount, and the vibration they should leave.

    Attributes
    ----------
    influence
        Coefficients of the planes at the speeds in question, with the vibration to correct as baseline.
    weights
        Total correction weights for the bare rotor (every weight of the runs removed), angle with the
        rotation, shape (P,).
    draws
        The same for every draw of the errors, (n, P); none where errors are unknown.
    after_covariance
        Of a reading in a check run around its prediction, (S, C, 2, 2); NaN where errors are unknown.
    check_rms
        Root mean square below which 95 of 100 check runs stay; NaN where errors are unknown.
    mounted
        What is mounted now, in all planes of the runs.
    conditioning
        What the readings tell of the planes (those of weight 0 left out).
    fitted
        What the method says of its solution.
    method
        One of `balancing.METHODS`, or "ridge".
    row_weights
        How much each reading counts, relative to the largest, (S·C,); None: all alike.
    limits
        What the correction had to keep to; None: nothing.
    remove
        Planes where material is taken away, opposite to the weight that would be added.
    decision
        Whether to mount the weights, and what to do instead.
    convention_test
        What the runs say about the relation of phases to angles; None: they were not asked.
    others
        What the same numbers give if a convention that is assumed is otherwise.
    """

    influence: Influence
    weights: ComplexArray
    draws: ComplexArray
    after_covariance: FloatArray
    check_rms: float
    mounted: Mounted
    conditioning: Conditioning
    fitted: Solution
    method: str
    row_weights: FloatArray | None = None
    limits: Limits | None = None
    remove: tuple[str, ...] = ()
    decision: MountDecision = field(default_factory=MountDecision)
    convention_test: ConventionTest | None = None
    others: tuple[OtherReading, ...] = ()

    @property
    def speeds(self) -> FloatArray:
        """rad/s, (S,)."""
        return self.influence.speeds

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names, C."""
        return self.influence.sensors

    @property
    def planes(self) -> tuple[str, ...]:
        """Names, P."""
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
        return np.asarray(self.before + self.influence.W @ self.weights)

    @property
    def errors_known(self) -> bool:
        """Whether it is known how far a check run may be from its prediction."""
        return bool(np.isfinite(self.check_rms))

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
        """Of (Re D₁, Im D₁, …), (2P, 2P); NaN where errors are unknown."""
        if not self.region_known:
            return np.full((2 * len(self.planes),) * 2, np.nan)
        return np.asarray(np.cov(real_parts(self.draws).T))

    @property
    def _turned(self) -> ComplexArray:
        """Draws seen along each weight, (n, P): size and angle off in real and imaginary part."""
        size = np.abs(self.weights)
        unit = np.where(size > 0, self.weights, 1.0) / np.where(size > 0, size, 1.0)
        return np.asarray(self.draws / unit)

    @property
    def _sizes(self) -> FloatArray:
        """Sizes of draws (n, P); along the weight where it is within its own error."""
        return np.where(self._clear, np.abs(self.draws), self._turned.real)

    @property
    def mass_std(self) -> FloatArray:
        """Standard deviation (P,) of the weights' sizes; NaN where errors are unknown."""
        return self._sizes.std(axis=0) if self.region_known else np.full(len(self.planes), np.nan)

    @property
    def angle_std(self) -> FloatArray:
        """Standard deviation (P,) of the weights' angles, rad; NaN for a weight within its own error.

        Within its own error is a weight whose 95 % region holds zero: its angle is not determined.
        """
        if not self.region_known:
            return np.full(len(self.planes), np.nan)
        return np.where(self._clear, np.angle(self._turned).std(axis=0), np.nan)

    @property
    def _clear(self) -> BoolArray:
        nothing = np.zeros(1, dtype=complex)
        if not self.region_known:
            return np.ones(len(self.planes), dtype=bool)
        clear = [bool(w) and not self.region([p]).holds(nothing) for p, w in enumerate(self.weights)]
        return np.array(clear)

    def half_widths(self) -> tuple[FloatArray, FloatArray]:
        """Half widths (P,) of 95 % intervals of the weights' sizes and angles (rad); NaN: not known."""
        if not self.region_known:
            return self.mass_std, self.angle_std
        angles = np.where(self._clear, half_width(np.angle(self._turned)), np.nan)
        return half_width(self._sizes - np.abs(self.weights)), angles

    @property
    def to_add(self) -> ComplexArray:
        """What to add to the weights mounted now, one per plane of `mounted`."""
        total = dict(zip(self.planes, self.weights, strict=True))
        planes = [total.get(plane, 0.0) for plane in self.mounted.planes]
        return np.array(planes, dtype=complex) - self.mounted.weights

    def places(self, planes: Sequence[str], weights: ComplexArray) -> FloatArray:
        """Where to work, degrees as the job counts them: opposite to a weight where material is removed."""
        turn = [180.0 if plane in self.remove else 0.0 for plane in planes]
        return np.asarray((self.labels.weight(weights)[1] + turn) % 360)

    @property
    def within(self) -> FloatArray:
        """Radius (S, C) of the 95 % region of each reading in a check run, in the job's unit."""
        if not self.errors_known:
            return np.full(self.before.shape, np.nan)
        return reach(self.after_covariance) * self.labels.vibration_scale

    @property
    def active(self) -> tuple[str, ...]:
        """Limits that bind, in words."""
        if self.limits is None:
            return ()
        weight, amplitude = self.labels.weight_words, self.labels.amplitude_words
        words = [
            f"plane {name!r} has its largest weight, {weight(float(limit))}"
            for name, D, limit in zip(self.planes, self.weights, self.limits.max_weight, strict=True)
            if abs(D) >= limit * (1 - _TOUCHES)
        ]
        names = reading_names(self.labels, self.sensors, self.speeds)
        words += [
            f"{name} has its largest amplitude, {amplitude(float(limit))}"
            for name, z, limit in zip(names, self.after.ravel(), self.limits.residual.ravel(), strict=True)
            if abs(z) >= limit * (1 - _TOUCHES)
        ]
        words += [
            f"plane {name!r} stands at the end of a forbidden arc"
            for name, D, arcs in zip(self.planes, self.weights, self.limits.forbidden, strict=True)
            if D and any(np.abs(np.angle(D * np.exp([-1j * a, -1j * (a + w)]))).min() < 1e-6 for a, w in arcs)
        ]
        return tuple(words)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """That the runs contradict their conventions; nothing may be mounted then."""
        return () if self.convention_test is None else self.convention_test.contradiction(self.labels)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the data do not determine, what contradicts, what to do."""
        return (*self.contradictions, *self.influence.remarks.warnings, *self.decision.warnings)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user may want to know."""
        within = [
            f"the weight in plane {plane!r} lies within its own error: its angle is not determined"
            for plane, clear, weight in zip(self.planes, self._clear, self.weights, strict=True)
            if weight and not clear
        ]
        return (*self.influence.remarks.notes, *within, *self.decision.notes)

    @property
    def sound(self) -> bool:
        """Whether nothing speaks against mounting the weights."""
        return self.decision.word == "mount" and not self.contradictions

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        scale = self.labels.vibration_scale
        old = np.abs(self.before) * scale
        residuals = self._residual_columns()
        new = np.array(residuals[4].values)
        there = bool(self.mounted.weights.any())
        planes, work = self.mounted.planes, weight_rows
        return plain(
            {
                "judgement": self.decision.to_dict(self.labels),
                "method": self.method,
                "conventions": self.labels.conventions(),
                "corrections_refer_to": "the bare rotor, with every weight of the runs removed",
                "corrections": rows(self._weight_columns()),
                "mounted_in_last_run": {
                    "run": self.mounted.run,
                    "weights": work(self.labels, planes, self.mounted.weights),
                }
                if there
                else None,
                "add_to_mounted": self.work_rows(planes, self.to_add) if there else None,
                "residuals": rows(residuals),
                "rms_before": rms(old),
                "rms_after": rms(new),
                "rms_after_95": self.check_rms * scale,
                "max_before": old.max(),
                "max_after": np.max(new),
                "condition_number": self.conditioning.condition_number,
                "rank": self.conditioning.rank,
                "singular_values": self.conditioning.singular_values,
                "duality_gap": self.fitted.gap,
                "chi_square": self.fitted.chi_square,
                "chi_square_dof": self.fitted.dof,
                "limits": self._limits(),
                "limits_that_bind": self.active,
                "errors": error_document(self.influence.reading, self.influence.run_errors, self.labels),
                "convention_test": None if self.convention_test is None else asdict(self.convention_test),
                "other_readings": [row for other in self.others for row in self._other_rows(other)],
                "assumptions": assumptions(self.labels, self.convention_test, self.others),
                "warnings": self.warnings,
                "notes": self.notes,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per plane: plane, mass, unit, angle_deg, mass_std, angle_std_deg (NaN where unknown).

        Where material is taken away from a plane, `action` says so, `angle_deg` is the place to work at, and
        `equivalent_added_deg` the angle of the added weight that would do the same. Where a convention is
        assumed, `mass_if_…` and `angle_deg_if_…` say what the other reading gives.
        """
        shown = frame([column for column in self._weight_columns() if column.name != "covariance"])
        action, at = shown.pop("action"), shown.pop("remove_at_deg")
        if self.remove:
            shown.insert(1, "action", action)
            shown["equivalent_added_deg"] = shown["angle_deg"]
            shown["angle_deg"] = at.fillna(shown["angle_deg"])
        for other in self.others:
            word = other.words.replace(" ", "_")
            shown[f"mass_if_{word}"] = other.labels.weight(other.weights)[0]
            shown[f"angle_deg_if_{word}"] = self._other_places(other)
        return shown

    def residuals_frame(self) -> pd.DataFrame:
        """One row per speed and sensor: amplitude and phase before and after (NaN: after is nothing)."""
        return frame(self._residual_columns()[:-1])

    def sentence(self) -> str:
        """Whether to mount what, and what a check run will read."""
        if not self.sound:
            first = [f"Do not mount anything yet: {words}." for words in self.contradictions]
            return "\n".join([*first, *self.decision.lines()])
        if not self.weights.any():
            return "Mount nothing: the limits leave no plane a weight."
        what = "Remove this material" if set(self.planes) <= set(self.remove) else "Mount these weights"
        ways = {"phase": f"phases {self.labels.phase}", "angles": f"angles count {self.labels.angle_words}"}
        taken = " and ".join(ways[name] for name in self.labels.assumed) if self.others else ""
        return f"{what}{f', if {taken} as assumed' if taken else ''}: {self._rms_words()}."

    @property
    def answer(self) -> Answer:
        """Whether to mount the weights, these with their 95 %, the largest readings left; then the tables."""
        test = self.convention_test
        assumed = assumptions(self.labels, test, self.others)
        sure = test is not None and test.verdict == "confirmed"
        taken = (" ".join(assumed),) if assumed else ()
        first, promised = self.sentence(), self._rms_words()
        promised = "" if promised in first else f"Predicted: {promised}."
        tables = (promised, self._vibration_text(), self._quality_text())
        within = self.within if self.errors_known else None
        left = largest_readings(self.labels, self.speeds, self.sensors, self.before, self.after, within)
        return Answer(
            first,
            f"{self._weights_text()}\n\nLargest left{left}",
            (() if sure else taken) + self.warnings[len(self.contradictions) :],
            (taken if sure else ()) + self.notes,
            tuple(table for table in tables if table),
            "every reading, method and errors",
        )

    @property
    def held(self) -> BoolArray:
        """Which weights (P,) limits hold, so that errors do not move their sizes."""
        return np.asarray(self.half_widths()[0] < HELD * np.abs(self.weights))

    @property
    def method_in_words(self) -> str:
        """What the method makes small, a sentence."""
        return method_words(self.method, weighted=self.row_weights is not None)

    def otherwise(self, words: str) -> OtherReading:
        """What a correction under other conventions notes of this one; in words, what is otherwise in it."""
        return OtherReading(words, self.labels, self.weights, self.to_add)

    def vibration_columns(
        self, rounding: float = INVISIBLE, after: ComplexArray | None = None
    ) -> tuple[Column, ...]:
        """Speed, sensor, vibration before and after, one row a reading.

        Parameters
        ----------
        rounding
            Amplitudes after, up to this share of the largest one before, are nothing.
        after
            In place of the prediction, (S, C).
        """
        nothing = rounding * float(np.abs(self.before).max()) * self.labels.vibration_scale
        return (
            *reading_columns(self.labels, self.speeds, self.sensors),
            *vector_columns(self.labels, "before", self.before),
            *vector_columns(self.labels, "after", self.after if after is None else after, nothing),
        )

    def work_rows(self, planes: Sequence[str], weights: ComplexArray) -> list[dict[str, Any]]:
        """Weights of planes as JSON types, and where to take material away from some."""
        added = weight_rows(self.labels, planes, weights)
        for row, at in zip(added, self.places(planes, weights).tolist(), strict=True):
            if row["plane"] in self.remove:
                row.update(action="remove", remove_at_deg=at)
            elif self.remove:
                row.update(action="add", remove_at_deg=None)
        return added

    def plane_limits(self, p: int) -> dict[str, Any]:
        """Largest weight and forbidden arcs of a plane as the job writes them: where to work, from and to."""
        if self.limits is None:
            return {"max_weight": None, "forbidden_deg": []}
        opposite = self.planes[p] in self.remove
        return {
            "max_weight": cell(self.limits.max_weight[p] * self.labels.weight_scale),
            "forbidden_deg": [self.labels.arc(*a, opposite=opposite) for a in self.limits.forbidden[p]],
        }

    def _weight_columns(self) -> tuple[Column, ...]:
        gone = [plane in self.remove for plane in self.planes]
        P = len(gone)
        blocks = np.einsum("papb->pab", self.covariance.reshape(P, 2, P, 2))
        return (
            *weight_columns(self.labels, self.planes, self.weights),
            Column("mass_std", self.mass_std * self.labels.weight_scale),
            Column("angle_std_deg", np.degrees(self.angle_std)),
            Column("covariance", self.labels.weight_covariance(blocks) if self.region_known else [None] * P),
            Column("action", ["remove" if away else "add" for away in gone]),
            Column("remove_at_deg", np.where(gone, self.places(self.planes, self.weights), np.nan)),
        )

    def _residual_columns(self) -> tuple[Column, ...]:
        covariance = self.after_covariance if self.errors_known else None
        last = covariance_column(self.labels, "after_covariance", covariance, self.before.size)
        return (*self.vibration_columns(ROUNDING), last)

    def _limits(self) -> dict[str, Any] | None:
        """Of the weights, and of each reading in the order of `residuals`; None where there is none."""
        if self.limits is None:
            return None
        each = {plane: self.plane_limits(p) for p, plane in enumerate(self.planes)}
        return {
            "max_weight": {plane: limits["max_weight"] for plane, limits in each.items()},
            "amplitude": self.limits.residual.ravel() * self.labels.vibration_scale,
            "forbidden_deg": {
                p: limits["forbidden_deg"] for p, limits in each.items() if limits["forbidden_deg"]
            },
        }

    def _other_places(self, other: OtherReading) -> FloatArray:
        influence = replace(self.influence, labels=other.labels)
        return replace(self, influence=influence).places(self.planes, other.weights)

    def _other_rows(self, other: OtherReading) -> list[dict[str, Any]]:
        n = len(self.planes)
        gone = [plane in self.remove for plane in self.planes]
        return rows(
            (
                Column("if", (other.words,) * n),
                Column("phase", (other.labels.phase,) * n),
                Column("angles", (other.labels.angle_words,) * n),
                *weight_columns(other.labels, self.planes, other.weights),
                Column("remove_at_deg", np.where(gone, self._other_places(other), np.nan)),
            )
        )

    def _other_columns(self, shown: FloatArray) -> list[Column]:
        """The angles if a convention is otherwise, and the mass where that is another than the one shown."""
        columns = []
        for other in self.others:
            places = map(degrees, self._other_places(other))
            masses = map(figures, other.labels.weight(other.weights)[0])
            cells = [
                place if mass == figures(here) else f"{mass} at {place}"
                for place, mass, here in zip(places, masses, shown, strict=True)
            ]
            columns.append(Column(f"if {other.words}", cells, str))
        return columns

    def _weights_text(self) -> str:
        unit, mass = self.labels.weight_in, self.labels.weight(self.weights)[0]
        removed = set(self.planes) & set(self.remove)
        work = [Column("", ["(remove)" if p in removed else "(add)" for p in self.planes], str)]
        columns = [
            Column("plane", self.planes, str),
            *(work if removed else []),
            Column(unit, mass, figures),
            Column("angle", self.places(self.planes, self.weights), degrees),
            *self._width_columns(unit),
            *self._other_columns(mass),
        ]
        taken = f" ({' and '.join(self.labels.assumed)} assumed)" if self.labels.assumed else ""
        conventions = f"{capital(self.labels.turning_in_words())}; phases as {self.labels.phase}{taken}"
        lines = [f"{conventions}; weights for the bare rotor."]
        if self.mounted.weights.any():
            stays = self._in_planes(self.to_add)
            cells = [stays.pop(plane, "nothing") for plane in self.planes]
            word = "remove" if set(self.planes) <= set(self.remove) else "add"
            columns.append(Column(f"{word} if {cut(self.mounted.run, _NAME)!r} stays", cells, str))
            also = [f"{words} in plane {plane!r}" for plane, words in stays.items()]
            lines += [f"If {self.mounted.run!r} stays mounted, also {listing(also, 'and')}."] if also else []
        lines += [f"Limits that bind: {'; '.join(self.active)}."] if self.active else []
        return "\n".join([text(columns, width=COLUMNS), *lines])

    def _width_columns(self, unit: str) -> list[Column]:
        if not self.region_known:
            return []
        sizes, angles = self.half_widths()
        widths = [f"± {figures(width * self.labels.weight_scale, 2)} {unit}" for width in sizes]
        return [
            Column("95 %", ["at its limit" if h else w for h, w in zip(self.held, widths, strict=True)], str),
            Column("", [_angle_width(half) for half in np.degrees(angles)], str),
        ]

    def _in_planes(self, weights: ComplexArray) -> dict[str, str]:
        """Weights in the planes of the runs, where there are any, and where to work."""
        planes, mass = self.mounted.planes, self.labels.weight(weights)[0]
        places = self.places(planes, weights)
        return {p: f"{figures(m)} at {degrees(a)}" for p, m, a in zip(planes, mass, places, strict=True) if m}

    def _vibration_text(self) -> str:
        columns = [*self.vibration_columns(INVISIBLE)]
        if self.errors_known:
            within = self.within.ravel()
            columns.append(Column("95 % within", within, lambda reach: f"± {figures(reach, 2)}"))
        unit = f" in {self.labels.vibration_in}" if self.labels.vibration_in else ""
        old, new = (np.abs(z).max() * self.labels.vibration_scale for z in (self.before, self.after))
        head = f"Vibration{unit}, bare rotor before and predicted after"
        return f"{head}\n{text(columns, left=2)}\nlargest {three_figures(old)} → {small(new, old)}"

    def _rms_words(self) -> str:
        """Before and after, and what a check run will show."""
        scale, unit = self.labels.vibration_scale, self.labels.vibration_in
        old, new = np.abs(self.before) * scale, np.abs(self.after) * scale
        before = f"rms {three_figures(rms(old))}"
        checked = figures(self.check_rms * scale, 2) if self.errors_known else ""
        if new.max() <= ROUNDING * old.max():
            if not checked:
                return f"{before} → 0 by arithmetic: as many readings as weights say nothing of what is left"
            return " ".join(f"{before} → below {checked} {unit} in 95 of 100 check runs".split())
        words = f"{before} → {small(rms(new), old.max())} {unit}".rstrip()
        return f"{words}; a check run stays below {checked} in 95 of 100" if checked else words

    def _quality_text(self) -> str:
        n, rank = len(self.planes), self.conditioning.rank
        planes = {1: "the plane is", 2: "both planes are"}.get(n, f"all {n} planes are")
        numbers = f"rank {rank} of {n}, condition number {self.conditioning.condition_number:.3g}"
        lines = [self.method_in_words]
        fitted = self.fitted
        if fitted.gap is not None:
            lines[0] += f" The optimum is certified: at most {max(fitted.gap, 0.0):.1e} better is possible."
        lines.append(
            f"{planes.capitalize()} determined ({numbers})." if self.method != "ridge" else f"{numbers}."
        )
        if fitted.chi_square is not None and fitted.dof:
            lines.append(
                f"What is left of the vibration is {np.sqrt(fitted.chi_square / fitted.dof):.2g} times what "
                f"the errors of the readings explain (χ² {fitted.chi_square:.1f} with "
                f"{counted(fitted.dof, 'degree')} of freedom)."
            )
        if self.errors_known:
            lines.append(error_words(self.influence.reading, self.influence.run_errors, self.labels))
        return "\n".join(wrap(line, "") for line in lines)


def _angle_width(half: float) -> str:
    """Half width of an angle's interval, degrees, in words."""
    if np.isnan(half):
        return "angle not determined"
    return "held by a limit" if half < np.degrees(HELD) else f"± {figures(half, 2)}°"
