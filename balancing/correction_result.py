"""A correction as it is judged and told: whether to mount its weights, JSON, tables and text."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np

from balancing.convention_test import ConventionTest, assumptions
from balancing.conventions import Labels
from balancing.printed_readings import (
    INVISIBLE,
    covariance_column,
    degrees,
    error_document,
    error_words,
    largest_readings,
    rms,
    small,
    three_figures,
    weight_columns,
    weight_rows,
)
from balancing.weights_and_prediction import HELD, Prediction
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import ComplexArray
from rotorid.base.json import plain
from rotorid.base.tables import Column, frame, records, text
from rotorid.base.text import WIDTH, capital, cut, figures, listing

if TYPE_CHECKING:
    import pandas as pd

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


@dataclass(frozen=True, eq=False)
class MountDecision:
    """One judgement of a correction.

    Attributes
    ----------
    word
        "mount", "determined in part" (not what each plane needs), "do not mount", or "measure again" (runs
        contradict each other besides).
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
    elsewhere
        Where the weights make it worse that they were not made for, in sentences.
    """

    word: Literal["mount", "determined in part", "do not mount", "measure again"] = "mount"
    cause: str = ""
    instead: tuple[str, ...] = ()
    before: float = 0.0
    expected: float = 0.0
    choices: tuple[Choice, ...] = ()
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    elsewhere: tuple[str, ...] = ()

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, in the job's units."""
        scale = labels.vibration_scale
        return {
            "word": self.word,
            "cause": self.cause or None,
            "instead": list(self.instead),
            "rms_before": self.before * scale,
            "rms_expected": self.expected * scale,
            **({"worse_elsewhere": list(self.elsewhere)} if self.elsewhere else {}),
        }

    def lines(self) -> tuple[str, ...]:
        """Sentences; none for "mount"."""
        if self.word == "mount":
            return ()
        head = "Do not mount these weights" if self.word == "do not mount" else capital(self.word)
        return (f"{head}: {self.cause}.", *self.instead)


@dataclass(frozen=True, eq=False)
class Correction(Prediction, Answered):
    """Weights to mount, the vibration they should leave, and whether to mount them.

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
    unknowns
        The groups and planes whose weights these are; None: of the planes.
    decision
        Whether to mount the weights, and what to do instead.
    convention_test
        What the runs say about the relation of phases to angles; None: they were not asked.
    others
        What the same numbers give if a convention that is assumed is otherwise: what is, such as "lag or
        against" (either of both alone), and the correction then.
    """

    decision: MountDecision = field(default_factory=MountDecision)
    convention_test: ConventionTest | None = None
    others: tuple[tuple[str, Correction], ...] = ()

    @classmethod
    def of(cls, result: Correction, **more: Any) -> Self:  # noqa: ANN401
        """A correction with other fields and more."""
        return cls(**{name: getattr(result, name) for name in Correction.__dataclass_fields__} | more)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """Sentences on how the runs contradict their conventions; nothing may be mounted then."""
        return () if self.convention_test is None else self.convention_test.contradiction(self.labels)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the data do not determine, what contradicts, what to do."""
        return (*self.contradictions, *self.influence.remarks.warnings, *self.decision.warnings)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Sentences on the conventions that are assumed."""
        return assumptions(self.labels, self.convention_test, dict(self.others))

    @property
    def notes(self) -> tuple[str, ...]:
        """Further remarks for the user, none of them a warning."""
        return (*self.influence.remarks.notes, *self.decision.notes)

    @property
    def judgement(self) -> MountDecision:
        """The decision; not to mount anything where the runs contradict their conventions."""
        cause = "; ".join(self.contradictions)
        return (
            replace(self.decision, word="do not mount", cause=cause, instead=()) if cause else self.decision
        )

    @property
    def sound(self) -> bool:
        """Whether nothing speaks against mounting the weights."""
        return self.judgement.word == "mount"

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        scale = self.labels.vibration_scale
        old = np.abs(self.before) * scale
        covariance = self.after_covariance if self.errors_known else None
        last = covariance_column(self.labels, "after_covariance", covariance, old.size)
        residuals = (*self.vibration_columns(), last)
        new = np.array(residuals[4].values)
        run, planes, weights = self.mounted
        there = bool(weights.any())
        mounted = {"run": run, "weights": weight_rows(self.labels, planes, weights)} if there else None
        parts = () if self.parts is None else records(self.parts._weight_columns()[:-2])
        return plain(
            {
                "judgement": self.judgement.to_dict(self.labels),
                "method": self.method,
                "conventions": self.labels.conventions(),
                "corrections_refer_to": "the bare rotor, with every weight of the runs removed",
                "corrections": records(self._weight_columns()),
                "parts": [{"part": row.pop("plane"), **row} for row in parts],
                "mounted_in_last_run": mounted,
                "add_to_mounted": self.work_rows(planes, self.to_add) if there else None,
                "residuals": records(residuals),
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
                "convention_test": self.convention_test and asdict(self.convention_test),
                "other_readings": [row for words, other in self.others for row in other._rows_if(words)],
                "assumptions": self.assumptions,
                "warnings": self.warnings,
                "notes": self.notes,
            }
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per plane: plane, mass, unit, angle_deg, mass_std, angle_std_deg (NaN where unknown).

        Where material is taken away from a plane, `action` says so, `angle_deg` is the place to work at, and
        `equivalent_added_deg` the angle of the added weight that would do the same.
        """
        plane, mass, unit, angle, *numbers, _, action, _ = self._weight_columns()
        if not self.remove:
            return frame((plane, mass, unit, angle, *numbers))
        work = replace(angle, values=self.places(self.planes, self.weights))
        return frame(
            (plane, action, mass, unit, work, *numbers, replace(angle, heading="equivalent_added_deg"))
        )

    def _rows_if(self, words: str) -> list[dict[str, Any]]:
        """Weights under other conventions; in words, what is otherwise."""
        head = {"if": words, "phase": self.labels.phase, "angles": self.labels.angle_words}
        *columns, _, at = self.work_columns(self.planes, self.weights)
        return [head | row for row in records((*columns, at))]

    def _weight_columns(self) -> tuple[Column, ...]:
        P = len(self.planes)
        blocks = np.einsum("papb->pab", self.covariance.reshape(P, 2, P, 2))
        *columns, action, at = self.work_columns(self.planes, self.weights)
        return (
            *columns,
            Column("mass_std", self.mass_std * self.labels.weight_scale),
            Column("angle_std_deg", np.degrees(self.angle_std)),
            Column("covariance", self.labels.weight_covariance(blocks) if self.region_known else [None] * P),
            action,
            at,
        )

    def sentence(self) -> str:
        """Whether to mount what, what is determined, and what a check run will read."""
        labels = self.labels
        if not self.sound:
            first = list(self.judgement.lines())
            if self.judgement.word == "determined in part":
                first += [f"With these weights: {self._left()}.", *self.decision.elsewhere]
            return "\n".join(first)
        if not self.weights.any():
            return "Mount nothing: the limits leave no plane a weight."
        what = self._what()
        if self.others:
            ways = {"phase": f"phases {labels.phase}", "angles": f"angles count {labels.angle_words}"}
            what += f", if {' and '.join(ways[name] for name in labels.assumed)} as assumed"
        return "\n".join((f"{what}: {self._left()}.", *self.decision.elsewhere))

    @property
    def answer(self) -> Answer:
        """Whether to mount the weights, these with their 95 %, the largest readings left; then the tables."""
        first, test, predicted = self.sentence(), self.convention_test, self._left()
        warnings = list(self.warnings[len(self.contradictions) :])
        notes = list(self.notes)
        if assumed := " ".join(self.assumptions):
            (notes if test is not None and test.verdict == "confirmed" else warnings).insert(0, assumed)
        largest = largest_readings(
            self.labels, self.speeds, self.sensors, self.before, self.after, self.within
        )
        parts = [] if self.parts is None else [self._parts_text(self.parts)]
        tables = [self._vibration_text(), *([] if self.unknowns else parts), self._quality_text()]
        numbers = [self._weights_text(), *(parts if self.unknowns else [])]
        return Answer(
            first,
            "\n".join([*numbers, "", f"Largest left{largest}"]),
            tuple(warnings),
            tuple(notes),
            tuple(tables if predicted in first else [f"Predicted: {predicted}.", *tables]),
            "every reading, method and errors",
            to_mount=True,
        )

    def _what(self) -> str:
        """What to do."""
        return "Remove this material" if set(self.planes) <= set(self.remove) else "Mount these weights"

    def _left(self) -> str:
        """Root mean square before and after, and what a check run will show."""
        scale, unit = self.labels.vibration_scale, self.labels.vibration_in
        old, new = np.abs(self.before).max(), np.abs(self.after).max()
        before = f"rms {three_figures(rms(self.before) * scale)}"
        checked = figures(self.check_rms * scale, 2) if self.errors_known else ""
        exact = new <= INVISIBLE * old
        if checked and exact:
            return " ".join(f"{before} → below {checked} {unit} in ≥ 95 of 100 check runs".split())
        left = "0 by arithmetic," if exact else small(rms(self.after) * scale, old * scale)
        words = f"{before} → {left} {unit}".rstrip(" ,")
        return f"{words}; a check run stays below {checked} in ≥ 95 of 100" if checked else words

    def in_words(self) -> str:
        """Weights and their 95 %, in a line."""
        each = zip(self.planes, self._sizes()[0].texts, *self._widths(), self._places(self), strict=True)
        words = (f"{plane} {size} {width} at {place} {turn}" for plane, size, width, turn, place in each)
        return ", ".join(" ".join(one.split()) for one in words)

    def _weights_text(self) -> str:
        """Weights and their 95 %, in each plane; under other conventions, and beside what is mounted."""
        labels, sizes, removed = self.labels, self._sizes(), [plane in self.remove for plane in self.planes]
        actions = [Column("", ["(remove)" if away else "(add)" for away in removed])] if any(removed) else []
        columns = [Column("plane", self.planes), *actions, *sizes, Column("angle", self._places(self))]
        if self.region_known:
            widths, turns = self._widths(sizes[0].title or "")
            columns += [Column("95 %", widths), Column("", turns)]
        for words, other in self.others:  # the mass where that is another than the one shown
            both = (map(figures, one[0].values) for one in (other._sizes(), sizes))
            cells = [
                place if size == here else f"{size} at {place}"
                for size, here, place in zip(*both, self._places(other), strict=True)
            ]
            columns.append(Column(f"if {words}", cells))
        taken = f" ({' and '.join(labels.assumed)} assumed)" if labels.assumed else ""
        lines = [f"{capital(self._counting)}; phases as {labels.phase}{taken}; weights for the bare rotor."]
        if self.mounted.weights.any():
            run, planes, _ = self.mounted
            masses, places = labels.weight(self.to_add)[0], map(degrees, self.places(planes, self.to_add))
            each = zip(planes, masses, places, strict=True)
            stays = {name: f"{figures(size)} at {place}" for name, size, place in each if size}
            cells = [stays.pop(name, "nothing") for name in self.planes]
            word = "remove" if all(removed) else "add"
            columns.append(Column(f"{word} if {cut(run, _NAME)!r} stays", cells))
            also = [f"{words} in plane {name!r}" for name, words in stays.items()]
            lines += [f"If {run!r} stays mounted, also {listing(also, 'and')}."] if also else []
        lines += [f"Limits that bind: {'; '.join(self.active)}."] if self.active else []
        return "\n".join([text(columns, width=COLUMNS), *lines])

    def _sizes(self) -> tuple[Column, ...]:
        """Sizes of the weights, first in the unit of their errors."""
        return weight_columns(self.labels, self.planes, self.weights)[1:2]

    def _places(self, of: Correction) -> list[str]:
        """Where to work by a correction, this one or one under other conventions."""
        return list(map(degrees, of.places(of.planes, of.weights)))

    @property
    def _counting(self) -> str:
        return self.labels.turning_in_words()

    def _widths(self, unit: str = "") -> tuple[list[str], list[str]]:
        """Half of the 95 % intervals of the weights' sizes and angles, in words; empty where not known."""
        if not self.region_known:
            return [""] * len(self.planes), [""] * len(self.planes)
        sizes, angles = self.half_widths()
        widths = [f"± {figures(width * self.labels.weight_scale, 2)} {unit}".rstrip() for width in sizes]
        for p in np.flatnonzero(self.held):
            widths[p] = "at its limit"
        return widths, list(map(_angle_width, np.degrees(angles)))

    def _parts_text(self, parts: Correction) -> str:
        """Weights of groups, or of the static part and the couple."""
        how = "" if self.unknowns else f" (the sum; half the difference, opposite in {self.planes[1]!r})"
        return fill(f"In parts, {self.labels.weight_in}: {parts.in_words()}{how}.", WIDTH)

    def _vibration_text(self) -> str:
        columns = list(self.vibration_columns())
        if self.errors_known:
            columns.append(Column("95 % within", self.within.ravel(), lambda width: f"± {figures(width, 2)}"))
        unit = f" in {self.labels.vibration_in}" if self.labels.vibration_in else ""
        return f"Vibration{unit}, bare rotor before and predicted after\n{text(columns, left=2)}"

    @property
    def error_sentence(self) -> str:
        """Errors of readings, between runs, and of mounted weights and drift, in one or two sentences."""
        words = error_words(self.influence.reading, self.influence.run_errors, self.labels)
        trials = self.influence.trials
        if not (trials and any((*trials.placement, trials.drift))):
            return words
        return (
            f"{words[:-1]}; mounted weights: {100 * trials.placement.mass:.3g} % and "
            f"{np.degrees(trials.placement.angle):.3g}°, drift: {100 * trials.drift:.3g} % (stated)."
        )

    def _quality_text(self) -> str:
        """What the method makes small, what is determined, and with what errors."""
        lines = [self.method_in_words, self.conditioning.sentence()]
        if self.errors_known:
            lines.append(self.error_sentence)
        return "\n".join(fill(line, WIDTH) for line in lines)


def _angle_width(half: float) -> str:
    """Half width of an angle's interval, degrees, in words."""
    if np.isnan(half):
        return "(angle not determined)"
    return "held by a limit" if half < np.degrees(HELD) else f"± {figures(half, 2)}°"
