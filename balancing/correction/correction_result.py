"""Correction weights with the vibration they should leave: result, text, and JSON types."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.coefficients.baseline import describe_errors
from balancing.coefficients.convention_test import ConventionTest
from balancing.coefficients.run_errors import RunErrors
from balancing.correction.convention_assumptions import OtherReading, assumptions, contradiction
from balancing.correction.correction_words import error_document, error_words, method_words
from balancing.correction.mount_decision import MountDecision
from balancing.data.conventions import Labels
from balancing.data.limits import Limits
from balancing.data.reading_errors import Source
from balancing.data.result_columns import (
    INVISIBLE,
    ROUNDING,
    covariance_column,
    degrees,
    known,
    largest_readings,
    reading_columns,
    rms,
    small,
    three_figures,
    vector_columns,
    weight_columns,
    weight_rows,
)
from balancing.data.trials import ReadingErrors
from balancing.solvers.error_propagation import region_radius
from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import cell, plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.text import capital, counted, cut, figures, listing, wrap
from rotorid.regression import coverage_factor

if TYPE_CHECKING:
    import pandas as pd


HELD = 1e-5
"""Relative scatter of a weight below which a limit holds it."""
_NAME = 16
"""So many letters of the name of a run stand over a column."""


@dataclass(frozen=True, eq=False)
class Correction(Answered):
    """Weights to mount, and the vibration they should leave.

    Attributes
    ----------
    speeds, sensors, planes
        rad/s (S,), names (C) and (P).
    weights
        Total correction weights for the bare rotor (every weight of the runs removed), angle with the
        rotation, shape (P,).
    before, after
        Vibration of the bare rotor and its prediction with the corrections mounted, shape (S, C).
    covariance
        Of (Re D₁, Im D₁, …), shape (2P, 2P); None where errors are unknown.
    after_covariance
        Of a reading in a check run around its prediction, shape (S, C, 2, 2); None where errors are unknown.
    dof
        Degrees of freedom of the errors; None for stated ones.
    errors, error_source
        Of a single reading, and where they come from.
    run_errors
        What changes from run to run.
    check_rms
        Root mean square below which 95 of 100 check runs stay; None where errors are unknown.
    condition_number
        Of the stacked, column-scaled W (readings of weight 0 left out).
    rank
        Number of planes whose weights the readings determine (all, or `correct` raises).
    method
        Of `balancing.solvers.correction_methods`: one of `METHODS` or `VARIANTS`.
    mounted
        Run, planes and weights (all planes of the runs) mounted in the last run; None if there were none.
    labels
        Units and conventions to print in.
    warnings
        What changes what a person does.
    notes
        What the user may want to know.
    explained
        Of the method "weighted": whether errors alone explain what the weights leave.
    singular_values
        Of the stacked, column-scaled W, largest first.
    gap
        Certified relative distance of the objective from its optimum; None for a closed form, and for the
        method "weighted" within limits.
    chi_square, fit_dof
        Of the method "weighted": how well these weights explain the readings.
    row_weights
        How much each reading counts, relative to the largest, (S·C,); None: all alike.
    limits, active
        What the correction had to keep to, and the limits that bind, in words.
    remove
        Planes where material is taken away, opposite to the weight that would be added.
    convention_test
        What the runs say about the relation of phases to angles; None: they were not asked.
    others
        What the same numbers give if a convention that is assumed is otherwise.
    decision
        Whether to mount the weights, and what to do instead.
    """

    speeds: FloatArray
    sensors: tuple[str, ...]
    planes: tuple[str, ...]
    weights: ComplexArray
    before: ComplexArray
    after: ComplexArray
    covariance: FloatArray | None
    after_covariance: FloatArray | None
    dof: float | None
    errors: ReadingErrors | None
    error_source: Source
    run_errors: RunErrors
    check_rms: float | None
    condition_number: float
    rank: int
    method: str
    mounted: tuple[str, tuple[str, ...], ComplexArray] | None
    labels: Labels
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    explained: bool
    singular_values: FloatArray
    gap: float | None = None
    chi_square: float | None = None
    fit_dof: int | None = None
    row_weights: FloatArray | None = None
    limits: Limits | None = None
    active: tuple[str, ...] = ()
    remove: tuple[str, ...] = ()
    convention_test: ConventionTest | None = None
    others: tuple[OtherReading, ...] = ()
    decision: MountDecision = field(default_factory=MountDecision)

    @property
    def plane_covariance(self) -> FloatArray | None:
        """Covariance (P, 2, 2) of each plane's weight; None where errors are unknown."""
        if self.covariance is None:
            return None
        P = len(self.planes)
        return np.asarray(np.einsum("papb->pab", self.covariance.reshape(P, 2, P, 2)))

    @property
    def mass_std(self) -> FloatArray | None:
        """Standard deviation (P,) of the weights' sizes; None where errors are unknown."""
        return self._along(1.0)

    @property
    def angle_std(self) -> FloatArray | None:
        """Standard deviation (P,) of the weights' angles, rad; NaN for a weight within its own error.

        Within its own error is a weight whose 95 % region contains zero: its angle is not determined.
        """
        across, covariance = self._along(1j), self.plane_covariance
        if across is None or covariance is None:
            return None
        vector = np.stack((self.weights.real, self.weights.imag), axis=-1)
        regular = covariance + 1e-12 * np.trace(covariance, axis1=1, axis2=2)[:, None, None] * np.eye(2)
        regular[~regular.any(axis=(1, 2))] = np.eye(2) * np.finfo(float).tiny
        distance = np.einsum("pi,pi->p", vector, np.linalg.solve(regular, vector[..., None])[..., 0])
        clear = (distance > region_radius(self.dof) ** 2) & (np.abs(self.weights) > 0)
        return np.where(clear, across / np.where(clear, np.abs(self.weights), 1.0), np.nan)

    def _along(self, turn: complex) -> FloatArray | None:
        covariance = self.plane_covariance
        if covariance is None:
            return None
        size = np.abs(self.weights)
        unit = turn * np.where(size > 0, self.weights, 1.0) / np.where(size > 0, size, 1.0)
        u = np.stack((unit.real, unit.imag), axis=-1)
        return np.asarray(np.sqrt(np.maximum(np.einsum("pi,pij,pj->p", u, covariance, u), 0.0)))

    @property
    def coverage_factor(self) -> float | None:
        """Half width of a 95 % interval in standard deviations; None where errors are unknown."""
        return None if self.covariance is None else coverage_factor(self.dof)

    @property
    def to_add(self) -> ComplexArray | None:
        """What to add to the weights mounted in the last run, one per plane of `mounted`; None without it."""
        if self.mounted is None:
            return None
        _, planes, weights = self.mounted
        total = dict(zip(self.planes, self.weights, strict=True))
        return np.array([total.get(p, 0.0) for p in planes], dtype=complex) - weights

    def half_widths(self) -> tuple[FloatArray, FloatArray]:
        """Half widths (P,) of 95 % intervals of the weights' sizes and angles (rad); NaN: not known."""
        n, factor = len(self.planes), self.coverage_factor or np.nan
        return factor * known(self.mass_std, n), factor * known(self.angle_std, n)

    def places(self, planes: Sequence[str], weights: ComplexArray) -> FloatArray:
        """Where to work, degrees as the job counts them: opposite to a weight where material is removed."""
        turn = [180.0 if plane in self.remove else 0.0 for plane in planes]
        return np.asarray((self.labels.weight(weights)[1] + turn) % 360)

    def plane_limits(self, p: int) -> dict[str, Any]:
        """Largest weight and forbidden arcs of a plane as the job writes them: where to work, from and to."""
        if self.limits is None:
            return {"max_weight": None, "forbidden_deg": []}
        opposite = self.planes[p] in self.remove
        return {
            "max_weight": cell(self.limits.max_weight[p] * self.labels.weight_scale),
            "forbidden_deg": [self.labels.arc(*a, opposite=opposite) for a in self.limits.forbidden[p]],
        }

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        scale = self.labels.vibration_scale
        old = np.abs(self.before) * scale
        residuals = self._residual_columns()
        new = np.array(residuals[4].values)
        return plain(
            {
                "judgement": self.decision.to_dict(self.labels),
                "method": self.method,
                "conventions": self.labels.conventions(),
                "corrections_refer_to": "the bare rotor, with every weight of the runs removed",
                "corrections": rows(self._weight_columns()),
                **self._mounted(),
                "residuals": rows(residuals),
                "rms_before": rms(old),
                "rms_after": rms(new),
                "rms_after_95": None if self.check_rms is None else self.check_rms * scale,
                "max_before": old.max(),
                "max_after": np.max(new),
                "condition_number": self.condition_number,
                "rank": self.rank,
                "singular_values": self.singular_values,
                "duality_gap": self.gap,
                "chi_square": self.chi_square,
                "chi_square_dof": self.fit_dof,
                "limits": self._limits(),
                "limits_that_bind": self.active,
                "errors": error_document(
                    self.error_source, self.errors, self.dof, self.run_errors, self.labels
                ),
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

    @property
    def answer(self) -> Answer:
        """Whether to mount the weights, these with their 95 %, the largest readings left; then the tables."""
        test = self.convention_test
        assumed = assumptions(self.labels, test, self.others)
        sure = test is not None and test.verdict == "confirmed"
        said = (" ".join(assumed),) if assumed else ()
        judged, rms_words = self._judgement(), self._rms_words()
        promised = "" if rms_words in judged else f"Predicted: {rms_words}."
        tables = (promised, self._mounted_text(), self._vibration_text(), self._quality_text())
        return Answer(
            judged,
            f"{self._weights_text()}\n\n{self._left()}",
            (() if sure else said) + self.warnings[len(self._contradictions) :],
            (said if sure else ()) + self.notes,
            tuple(table for table in tables if table),
            "every reading, method and errors",
        )

    @property
    def sound(self) -> bool:
        """Whether nothing speaks against mounting the weights."""
        return self.decision.word == "mount" and not self._contradictions

    @property
    def _contradictions(self) -> tuple[str, ...]:
        return () if self.convention_test is None else contradiction(self.convention_test, self.labels)

    def _judgement(self) -> str:
        if not self.sound:
            first = [f"Do not mount anything yet: {words}." for words in self._contradictions]
            return "\n".join([*first, *self.decision.lines()])
        if not self.weights.any():
            return "Mount nothing: the limits leave no plane a weight."
        what = "Remove this material" if set(self.planes) <= set(self.remove) else "Mount these weights"
        ways = {"phase": f"phases {self.labels.phase}", "angles": f"angles count {self.labels.angle_words}"}
        said = " and ".join(ways[name] for name in self.labels.assumed) if self.others else ""
        return f"{what}{f', if {said} as assumed' if said else ''}: {self._rms_words()}."

    def _weight_columns(self) -> tuple[Column, ...]:
        n, covariance = len(self.planes), self.plane_covariance
        blocks = [None] * n if covariance is None else self.labels.weight_covariance(covariance)
        gone = [plane in self.remove for plane in self.planes]
        return (
            *weight_columns(self.labels, self.planes, self.weights),
            Column("mass_std", known(self.mass_std, n) * self.labels.weight_scale),
            Column("angle_std_deg", np.degrees(known(self.angle_std, n))),
            Column("covariance", blocks),
            Column("action", ["remove" if away else "add" for away in gone]),
            Column("remove_at_deg", np.where(gone, self.places(self.planes, self.weights), np.nan)),
        )

    def _residual_columns(self) -> tuple[Column, ...]:
        return (
            *self.vibration_columns(ROUNDING),
            covariance_column(self.labels, "after_covariance", self.after_covariance, self.before.size),
        )

    def vibration_columns(self, rounding: float, after: ComplexArray | None = None) -> tuple[Column, ...]:
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

    def _mounted(self) -> dict[str, Any]:
        if self.mounted is None or self.to_add is None:
            return {"mounted_in_last_run": None, "add_to_mounted": None}
        run, planes, weights = self.mounted
        return {
            "mounted_in_last_run": {"run": run, "weights": weight_rows(self.labels, planes, weights)},
            "add_to_mounted": self.work_rows(planes, self.to_add),
        }

    def work_rows(self, planes: Sequence[str], weights: ComplexArray) -> list[dict[str, Any]]:
        """Weights of planes as JSON types, and where to take material away from some."""
        added = weight_rows(self.labels, planes, weights)
        for row, at in zip(added, self.places(planes, weights).tolist(), strict=True):
            if row["plane"] in self.remove:
                row.update(action="remove", remove_at_deg=at)
            elif self.remove:
                row.update(action="add", remove_at_deg=None)
        return added

    def _limits(self) -> dict[str, Any] | None:
        """Of the weights, and of each reading in the order of `residuals`; None where there is none."""
        if self.limits is None:
            return None
        own = {plane: self.plane_limits(p) for p, plane in enumerate(self.planes)}
        arcs = {plane: each["forbidden_deg"] for plane, each in own.items()}
        return {
            "max_weight": {plane: each["max_weight"] for plane, each in own.items()},
            "amplitude": self.limits.residual.ravel() * self.labels.vibration_scale,
            "forbidden_deg": {plane: pairs for plane, pairs in arcs.items() if pairs},
        }

    def _other_places(self, other: OtherReading) -> FloatArray:
        return replace(self, labels=other.labels).places(self.planes, other.weights)

    def _other_rows(self, other: OtherReading) -> list[dict[str, Any]]:
        n, at = len(self.planes), self._other_places(other)
        gone = [plane in self.remove for plane in self.planes]
        return rows(
            (
                Column("if", (other.words,) * n),
                Column("phase", (other.labels.phase,) * n),
                Column("angles", (other.labels.angle_words,) * n),
                *weight_columns(other.labels, self.planes, other.weights),
                Column("remove_at_deg", np.where(gone, at, np.nan)),
            )
        )

    def _other_columns(self, shown: FloatArray) -> list[Column]:
        """The angles if a convention is otherwise, and the mass where that is another than the one shown."""
        found = []
        for other in self.others:
            at = [degrees(angle) for angle in self._other_places(other)]
            masses = map(figures, other.labels.weight(other.weights)[0])
            cells = [
                place if mass == figures(own) else f"{mass} at {place}"
                for place, mass, own in zip(at, masses, shown, strict=True)
            ]
            found.append(Column(f"if {other.words}", cells, str))
        return found

    def _weights_text(self) -> str:
        unit, mass = self.labels.weight_in, self.labels.weight(self.weights)[0]
        columns = [
            Column("plane", self.planes, str),
            *self._work_columns(),
            Column(unit, mass, figures),
            Column("angle", self.places(self.planes, self.weights), degrees),
            *self._width_columns(unit),
            *self._other_columns(mass),
        ]
        taken = f" ({' and '.join(self.labels.assumed)} assumed)" if self.labels.assumed else ""
        conventions = f"{capital(self.labels.turning_in_words())}; phases as {self.labels.phase}{taken}"
        lines = [f"{conventions}; weights for the bare rotor."]
        if self.mounted is not None and self.mounted[2].any():
            run, stays = self.mounted[0], self._in_planes(self.labels, self.to_add, self.remove)
            cells = [stays.pop(plane, "nothing") for plane in self.planes]
            work = "remove" if set(self.planes) <= set(self.remove) else "add"
            columns.append(Column(f"{work} if {cut(run, _NAME)!r} stays", cells, str))
            also = [f"{words} in plane {plane!r}" for plane, words in stays.items()]
            lines += [f"If {run!r} stays mounted, also {listing(also, 'and')}."] if also else []
        lines += [f"Limits that bind: {'; '.join(self.active)}."] if self.active else []
        return "\n".join([text(columns, width=COLUMNS), *lines])

    def _work_columns(self) -> list[Column]:
        """What to do in each plane, beside its name: a long name is cut, this never."""
        if not set(self.planes) & set(self.remove):
            return []
        return [Column("", ["(remove)" if p in self.remove else "(add)" for p in self.planes], str)]

    def _width_columns(self, unit: str) -> list[Column]:
        if not self.coverage_factor:
            return []
        sizes, angles = self.half_widths()
        held = sizes < HELD * np.abs(self.weights)
        widths = [f"± {figures(width * self.labels.weight_scale, 2)} {unit}" for width in sizes]
        return [
            Column("95 %", ["at its limit" if h else w for h, w in zip(held, widths, strict=True)], str),
            Column("", [_angle_width(half) for half in np.degrees(angles)], str),
        ]

    def _in_planes(
        self, labels: Labels, weights: ComplexArray | None, gone: Collection[str] = ()
    ) -> dict[str, str]:
        """Weights in the planes of the runs, where there are any, and where to work."""
        if self.mounted is None or weights is None:
            return {}
        mass, angle = labels.weight(weights)
        return {
            plane: f"{figures(m)} at {degrees(a + 180 * (plane in gone))}"
            for plane, m, a in zip(self.mounted[1], mass, angle, strict=True)
            if m
        }

    def _mounted_text(self) -> str:
        if self.mounted is None:
            return ""
        run, _, weights = self.mounted
        said = {f"Mounted in run {run!r}, the last one": self._in_planes(self.labels, weights)}
        for other in self.others:
            add = self._in_planes(other.labels, other.to_add, self.remove)
            said[f"To add to that if it is {other.words}"] = add
        each = [
            f"{what} ({self.labels.weight_in}): {', '.join(map(' '.join, there.items())) or 'nothing'}."
            for what, there in said.items()
        ]
        return "\n".join(wrap(line) for line in each)

    def _left(self) -> str:
        within = self.within(self.after_covariance).reshape(self.before.shape)
        words = largest_readings(self.labels, self.speeds, self.sensors, self.before, self.after, within)
        lines = [f"Largest predicted{words}"]
        if self.error_source == "assumed" and self.errors is not None:
            size = describe_errors(self.errors, self.labels.vibration_in, self.labels.vibration_scale)
            lines.append(f"The errors of the readings are assumed, {size}: state them, or repeat readings.")
        if self.covariance is None:
            why = "no errors are stated, no reading is repeated, and no run is more than needed"
            lines.append(
                f"No intervals: {why if self.errors is None else 'the errors of the readings are not known'}."
            )
        return "\n".join(lines)

    def within(self, covariance: FloatArray | None) -> FloatArray:
        """Radius (S·C,) in the job's unit of the 95 % region of a check run's readings; NaN: not known."""
        if covariance is None:
            return known(None, self.before.size)
        largest = np.sqrt(np.linalg.eigvalsh(covariance)[..., -1]) * self.labels.vibration_scale
        return np.asarray(region_radius(self.dof) * largest.ravel())

    def _vibration_text(self) -> str:
        columns = [*self.vibration_columns(INVISIBLE)]
        if self.after_covariance is not None:
            within = self.within(self.after_covariance)
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
        checked = None if self.check_rms is None else figures(self.check_rms * scale, 2)
        if new.max() <= ROUNDING * old.max():
            if checked is None:
                return f"{before} → 0 by arithmetic: as many readings as weights say nothing of what is left"
            return " ".join(f"{before} → below {checked} {unit} in 95 of 100 check runs".split())
        words = f"{before} → {small(rms(new), old.max())} {unit}".rstrip()
        return words if checked is None else f"{words}; a check run stays below {checked} in 95 of 100"

    def _quality_text(self) -> str:
        n = len(self.planes)
        planes = {1: "the plane is", 2: "both planes are"}.get(n, f"all {n} planes are")
        numbers = f"rank {self.rank} of {n}, condition number {self.condition_number:.3g}"
        lines = [method_words(self.method, weighted=self.row_weights is not None)]
        if self.gap is not None:
            lines[0] += f" The optimum is certified: at most {max(self.gap, 0.0):.1e} better is possible."
        if self.method not in ("ridge", "truncated"):
            lines.append(f"{planes.capitalize()} determined ({numbers}).")
        elif self.singular_values.size:
            shown = ", ".join(f"{s:.3g}" for s in self.singular_values)
            lines.append(f"{numbers.capitalize()}, singular values {shown}.")
        if self.chi_square is not None and self.fit_dof:
            lines.append(
                f"What is left of the vibration is {np.sqrt(self.chi_square / self.fit_dof):.2g} times what "
                f"the errors of the readings explain (χ² {self.chi_square:.1f} with "
                f"{counted(self.fit_dof, 'degree')} of freedom)."
            )
        if self.covariance is not None:
            lines.append(error_words(self.error_source, self.errors, self.dof, self.run_errors, self.labels))
        return "\n".join(wrap(line, "") for line in lines)


def _angle_width(half: float) -> str:
    """Half width of an angle's interval, degrees, in words."""
    if np.isnan(half):
        return "angle not determined"
    return "held by a limit" if half < np.degrees(HELD) else f"± {figures(half, 2)}°"
