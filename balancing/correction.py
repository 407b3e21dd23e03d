"""Correction weights with the vibration they should leave: numbers, errors, tables and text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import compress
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from balancing.conditioning import Conditioning
from balancing.convention_test import ConventionTest, OtherReading, assumptions
from balancing.conventions import Labels
from balancing.influence import Influence, Mounted
from balancing.methods import Solution, method_words
from balancing.regions import NORMAL_RADIUS, Region, half_width, reach
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
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import capital, cut, figures, listing, wrap

if TYPE_CHECKING:
    import pandas as pd

HELD = 1e-5
"""Relative scatter of a weight below which a limit holds it."""
HARDLY_APART = 10.0
"""Above this condition number two planes do the same but for a fifth of their effect."""
STATIC = 0.2
"""Difference of the effects of two planes, relative, below which their sum is called the static part."""
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
        return self.region().covariance

    @cached_property
    def _off(self) -> tuple[FloatArray, FloatArray]:
        """How far draws (n, P) are off in size, along a weight within its own error, and in angle (rad)."""
        size = np.abs(self.weights)
        draws = self.draws if self.region_known else np.full((1, len(size)), np.nan)
        along = draws / np.exp(1j * np.angle(self.weights))
        sizes = np.where(self._clear, np.abs(draws), along.real) - size
        return sizes, np.where(self._clear, np.angle(along), np.nan)

    @cached_property
    def _clear(self) -> BoolArray:
        """Whether the 95 % region of each weight (P,) leaves zero out, so that its angle is determined."""
        nothing = np.zeros(1, dtype=complex)
        return np.array([bool(w) and not self.region([p]).holds(nothing) for p, w in enumerate(self.weights)])

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
    def combination(self) -> str:
        """What is determined of two planes that are hardly told apart, and what is not; else empty.

        The columns w of both planes, scaled to length 1, differ by little but a factor: w₂ ≈ ρ w₁. Then
        D₁ + ρ D₂, the weight in the first plane that does the same, is determined, and
        (D₁ − ρ D₂) / 2 is not. With ρ ≈ 1 they are the static part and the couple.
        """
        apart, labels = self.conditioning, self.labels
        if len(self.planes) != 2 or not self.region_known or apart.condition_number <= HARDLY_APART:
            return ""
        v = apart.directions[:, 0].conj() * apart.lengths
        ratio = v[1] / v[0]
        static = bool(abs(ratio - 1) < STATIC)
        ways = np.array([[1, 0.5], [1, -0.5]]) if static else np.array([[1, 0.5], [ratio, -0.5 * ratio]])
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
        limits, fitted = self.limits, self.fitted
        if limits is None:
            return ()
        names = reading_names(self.labels, self.sensors, self.speeds)
        at = np.exp(-1j * np.angle(self.weights))
        ends = [
            bool(D)
            and any(np.abs(np.angle(u * np.exp([1j * a, 1j * (a + w)]))).min() < 1e-6 for a, w in arcs)
            for D, u, arcs in zip(self.weights, at, limits.forbidden, strict=True)
        ]
        heavy, high = compress(self.planes, fitted.active_weights), compress(names, fitted.active_residuals)
        return (
            *(f"plane {name!r} has its largest weight" for name in heavy),
            *(f"{name} has its largest amplitude" for name in high),
            *(f"plane {name!r} stands at the end of a forbidden arc" for name in compress(self.planes, ends)),
        )

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
        together = (self.combination,) if self.combination else ()
        return (*self.influence.remarks.notes, *together, *self.decision.notes)

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
                "limits": self.limits_document(),
                "limits_that_bind": self.active,
                "errors": error_document(self.influence.reading, self.influence.run_errors, self.labels),
                "convention_test": None if self.convention_test is None else asdict(self.convention_test),
                "other_readings": [row for other in self.others for row in other.rows],
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
        *numbers, _, action, _ = self._weight_columns()
        shown = frame(numbers)
        if self.remove:
            shown.insert(1, "action", list(action.values))
            shown["equivalent_added_deg"] = shown["angle_deg"]
            shown["angle_deg"] = self.places(self.planes, self.weights)
        for other in self.others:
            word = other.words.replace(" ", "_")
            shown[f"mass_if_{word}"] = [row["mass"] for row in other.rows]
            shown[f"angle_deg_if_{word}"] = other.places
        return shown

    def sentence(self) -> str:
        """Whether to mount what, and what a check run will read."""
        together = f"{capital(self.combination)}." if self.combination else ""
        if not self.sound:
            first = [f"Do not mount anything yet: {words}." for words in self.contradictions]
            stop, *instead = self.decision.lines() or ("",)
            return "\n".join(filter(None, (*first, stop, together, *instead)))
        if not self.weights.any():
            return "Mount nothing: the limits leave no plane a weight."
        what = "Remove this material" if set(self.planes) <= set(self.remove) else "Mount these weights"
        ways = {"phase": f"phases {self.labels.phase}", "angles": f"angles count {self.labels.angle_words}"}
        taken = " and ".join(ways[name] for name in self.labels.assumed) if self.others else ""
        what += f", if {taken} as assumed" if taken else ""
        left = self._rms_words()
        return f"{what}: {self.combination}. Predicted: {left}." if together else f"{what}: {left}."

    @property
    def answer(self) -> Answer:
        """Whether to mount the weights, these with their 95 %, the largest readings left; then the tables."""
        first, test = self.sentence(), self.convention_test
        warnings = list(self.warnings[len(self.contradictions) :])
        notes = [note for note in self.notes if note != self.combination]
        if assumed := " ".join(assumptions(self.labels, test, self.others)):
            (notes if test is not None and test.verdict == "confirmed" else warnings).insert(0, assumed)
        predicted = self._rms_words()
        tables = [] if predicted in first else [f"Predicted: {predicted}."]
        within = self.within if self.errors_known else None
        left = largest_readings(self.labels, self.speeds, self.sensors, self.before, self.after, within)
        return Answer(
            first,
            f"{self._weights_text()}\n\nLargest left{left}",
            tuple(warnings),
            tuple(notes),
            (*tables, self._vibration_text(), self._quality_text()),
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
        labels, planes = self.labels, self.planes
        head = {"if": words, "phase": labels.phase, "angles": labels.angle_words}
        *columns, _, at = self._work_columns(planes, self.weights)
        each = [head | row for row in rows((*columns, at))]
        return OtherReading(words, each, self.places(planes, self.weights).tolist())

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
        columns = self._work_columns(planes, weights)
        return rows(columns if self.remove else columns[:-2])

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

    def _work_columns(self, planes: Sequence[str], weights: ComplexArray) -> tuple[Column, ...]:
        gone = [plane in self.remove for plane in planes]
        return (
            *weight_columns(self.labels, planes, weights),
            Column("action", ["remove" if away else "add" for away in gone]),
            Column("remove_at_deg", np.where(gone, self.places(planes, weights), np.nan)),
        )

    def _weight_columns(self) -> tuple[Column, ...]:
        P = len(self.planes)
        blocks = np.einsum("papb->pab", self.covariance.reshape(P, 2, P, 2))
        *columns, action, at = self._work_columns(self.planes, self.weights)
        return (
            *columns,
            Column("mass_std", self.mass_std * self.labels.weight_scale),
            Column("angle_std_deg", np.degrees(self.angle_std)),
            Column("covariance", self.labels.weight_covariance(blocks) if self.region_known else [None] * P),
            action,
            at,
        )

    def _residual_columns(self) -> tuple[Column, ...]:
        covariance = self.after_covariance if self.errors_known else None
        last = covariance_column(self.labels, "after_covariance", covariance, self.before.size)
        return (*self.vibration_columns(ROUNDING), last)

    def _weights_text(self) -> str:
        labels, removed = self.labels, set(self.planes) & set(self.remove)
        plane, mass, *_ = weight_columns(labels, self.planes, self.weights)
        work = [Column("", ["(remove)" if p in removed else "(add)" for p in self.planes], str)]
        columns = [
            plane,
            *(work if removed else []),
            mass,
            Column("angle", self.places(self.planes, self.weights), degrees),
            *self._width_columns(),
        ]
        for other in self.others:  # the mass where that is another than the one shown
            cells = [
                degrees(at)
                if figures(row["mass"]) == figures(here)
                else f"{figures(row['mass'])} at {degrees(at)}"
                for row, at, here in zip(other.rows, other.places, mass.values, strict=True)
            ]
            columns.append(Column(f"if {other.words}", cells, str))
        taken = f" ({' and '.join(labels.assumed)} assumed)" if labels.assumed else ""
        conventions = f"{capital(labels.turning_in_words())}; phases as {labels.phase}{taken}"
        lines = [f"{conventions}; weights for the bare rotor."]
        if self.mounted.weights.any():
            planes, run = self.mounted.planes, self.mounted.run
            sizes, places = labels.weight(self.to_add)[0], self.places(planes, self.to_add)
            each = zip(planes, sizes, places, strict=True)
            stays = {plane: f"{figures(size)} at {degrees(at)}" for plane, size, at in each if size}
            word = "remove" if removed == set(self.planes) else "add"
            cells = [stays.pop(plane, "nothing") for plane in self.planes]
            columns.append(Column(f"{word} if {cut(run, _NAME)!r} stays", cells, str))
            also = [f"{words} in plane {plane!r}" for plane, words in stays.items()]
            lines += [f"If {run!r} stays mounted, also {listing(also, 'and')}."] if also else []
        lines += [f"Limits that bind: {'; '.join(self.active)}."] if self.active else []
        return "\n".join([text(columns, width=COLUMNS), *lines])

    def _width_columns(self) -> list[Column]:
        if not self.region_known:
            return []
        (sizes, angles), labels = self.half_widths(), self.labels
        widths = [f"± {figures(width * labels.weight_scale, 2)} {labels.weight_in}" for width in sizes]
        return [
            Column("95 %", ["at its limit" if h else w for h, w in zip(self.held, widths, strict=True)], str),
            Column("", [_angle_width(half) for half in np.degrees(angles)], str),
        ]

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
        old, new = np.abs(self.before).max(), np.abs(self.after).max()
        before = f"rms {three_figures(rms(self.before) * scale)}"
        checked = figures(self.check_rms * scale, 2) if self.errors_known else ""
        if checked and new <= ROUNDING * old:
            return " ".join(f"{before} → below {checked} {unit} in 95 of 100 check runs".split())
        left = "0 by arithmetic," if new <= ROUNDING * old else small(rms(self.after) * scale, old * scale)
        words = f"{before} → {left} {unit}".rstrip(" ,")
        return f"{words}; a check run stays below {checked} in 95 of 100" if checked else words

    def _quality_text(self) -> str:
        fitted, lines = self.fitted, [self.method_in_words, self.conditioning.sentence()]
        if fitted.gap is not None:
            lines[0] += f" The optimum is certified: at most {max(fitted.gap, 0.0):.1e} better is possible."
        if self.errors_known:
            lines.append(error_words(self.influence.reading, self.influence.run_errors, self.labels))
        return "\n".join(wrap(line, "") for line in lines)


def _angle_width(half: float) -> str:
    """Half width of an angle's interval, degrees, in words."""
    if np.isnan(half):
        return "angle not determined"
    return "held by a limit" if half < np.degrees(HELD) else f"± {figures(half, 2)}°"
