"""Correction weights with the vibration they should leave: result, text of 80 columns, and JSON types."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing.coefficients.baseline import describe_errors
from balancing.coefficients.convention_test import ConventionTest
from balancing.coefficients.run_errors import RunErrors
from balancing.correction.counsel import Counsel
from balancing.correction.other_readings import OtherReading, assumptions, contradiction
from balancing.data.conventions import Labels
from balancing.data.errors import Source
from balancing.data.limits import Limits
from balancing.data.trials import ReadingErrors
from balancing.solvers.error_propagation import region_radius
from balancing.solvers.methods import METHODS, VARIANTS
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.base.json import finite
from rotorid.base.registry import Method, find
from rotorid.base.text import capital, counted, figures, table, wrap
from rotorid.base.units import rpm
from rotorid.regression import coverage_factor

if TYPE_CHECKING:
    import pandas as pd


HELD = 1e-5
"""Relative scatter of a weight below which a limit holds it."""
SMALL = 5e-4
"""Share of a reading that is not worth a word."""
DUST = 1e-12
"""Predicted amplitudes below this share of the largest one before are rounding."""

_SOURCES = {
    "stated": "as stated in the job",
    "repeats": "from repeated readings",
    "stated, enlarged by repeats": "stated ones, enlarged because repeated readings scatter more",
    "residuals": "from the disagreement of the runs",
    "assumed": "assumed: nothing states or measures them",
}


@dataclass(frozen=True, eq=False)
class Correction:
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
        Of `balancing.solvers.methods`: one of `METHODS` or `VARIANTS`.
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
    counsel
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
    counsel: Counsel = field(default_factory=Counsel)

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

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, in the job's own units and conventions; what is unknown is None."""
        return _correction_dict(self)

    def to_frame(self) -> pd.DataFrame:
        """One row per plane: plane, mass, unit, angle_deg, mass_std, angle_std_deg (NaN where unknown).

        Where material is taken away from a plane, `action` says so, `angle_deg` is the place to work at, and
        `equivalent_added_deg` the angle of the added weight that would do the same. Where a convention is
        assumed, `mass_if_…` and `angle_deg_if_…` say what the other reading gives.
        """
        import pandas as pd

        left_out = ("covariance", "action", "remove_at_deg")
        rows = [{k: v for k, v in row.items() if k not in left_out} for row in self.to_dict()["corrections"]]
        frame = pd.DataFrame(rows)
        if self.remove:
            known = self.to_dict()["corrections"]
            frame.insert(1, "action", [row["action"] for row in known])
            frame["equivalent_added_deg"] = frame["angle_deg"]
            frame["angle_deg"] = [
                row["angle_deg"] if row["remove_at_deg"] is None else row["remove_at_deg"] for row in known
            ]
        for other in self.others:
            mass, angle = other.labels.weight(other.weights)
            word = other.words.replace(" ", "_")
            frame[f"mass_if_{word}"] = mass
            frame[f"angle_deg_if_{word}"] = (angle + [180.0 * (p in self.remove) for p in self.planes]) % 360
        return frame.astype({"mass_std": float, "angle_std_deg": float})

    def residuals_frame(self) -> pd.DataFrame:
        """One row per speed and sensor: amplitude and phase before and after (NaN: after is nothing)."""
        import pandas as pd

        frame = pd.DataFrame(self.to_dict()["residuals"]).drop(columns="after_covariance")
        return frame.astype({"after_phase_deg": float})

    def summary(self) -> str:
        """Text for an engineer, 80 columns: warnings, corrections with 95 %, vibration before and after."""
        return _text(self)


def _correction_dict(c: Correction) -> dict[str, Any]:
    """`Correction.to_dict`: the keys of INTERFACE.md for `rotorid balance`, and a few more."""
    mass, angle = c.labels.weight(c.weights)
    old, old_phase = c.labels.vibration(c.before)
    new, new_phase = c.labels.vibration(c.after)
    # what an exact solution leaves is rounding, whose direction means nothing
    new_phase = np.where(new > DUST * old.max(), new_phase, np.nan)
    new = np.where(new > DUST * old.max(), new, 0.0)
    covariance = None if c.plane_covariance is None else c.labels.weight_covariance(c.plane_covariance)
    after_covariance = c.after_covariance
    if after_covariance is not None:
        after_covariance = c.labels.vibration_covariance(after_covariance)
    mass_std, angle_std = c.mass_std, c.angle_std
    unit = c.labels.weight_unit
    return {
        "judgement": c.counsel.to_dict(c.labels),
        "method": c.method,
        "conventions": c.labels.conventions(),
        "corrections_refer_to": "the bare rotor, with every weight of the runs removed",
        "corrections": [
            {
                "plane": plane,
                "mass": float(mass[p]),
                "unit": unit,
                "angle_deg": float(angle[p]),
                "mass_std": None if mass_std is None else float(mass_std[p] * c.labels.weight_scale),
                "angle_std_deg": None if angle_std is None else finite(np.degrees(angle_std[p])),
                "covariance": None if covariance is None else covariance[p].tolist(),
                "action": "remove" if plane in c.remove else "add",
                "remove_at_deg": float((angle[p] + 180) % 360) if plane in c.remove else None,
            }
            for p, plane in enumerate(c.planes)
        ],
        **_mounted(c),
        "residuals": [
            {
                "speed_rpm": rpm(speed),
                "sensor": sensor,
                "before": float(old[s, k]),
                "before_phase_deg": float(old_phase[s, k]),
                "after": float(new[s, k]),
                "after_phase_deg": finite(new_phase[s, k]),
                "after_covariance": None if after_covariance is None else after_covariance[s, k].tolist(),
            }
            for s, speed in enumerate(c.speeds)
            for k, sensor in enumerate(c.sensors)
        ],
        "rms_before": float(np.sqrt(np.mean(old**2))),
        "rms_after": float(np.sqrt(np.mean(new**2))),
        "rms_after_95": None if c.check_rms is None else c.check_rms * c.labels.vibration_scale,
        "max_before": float(old.max()),
        "max_after": float(new.max()),
        "condition_number": finite(c.condition_number),
        "rank": c.rank,
        "singular_values": c.singular_values.tolist(),
        "duality_gap": c.gap,
        "chi_square": c.chi_square,
        "chi_square_dof": c.fit_dof,
        "limits": _limits(c),
        "limits_that_bind": list(c.active),
        "errors": _errors(c),
        "convention_test": None if c.convention_test is None else asdict(c.convention_test),
        "other_readings": [row for other in c.others for row in _other_rows(c, other)],
        "assumptions": list(assumptions(c.labels, c.convention_test, c.others)),
        "warnings": list(c.warnings),
        "notes": list(c.notes),
    }


def _text(c: Correction) -> str:
    """`Correction.summary`."""
    contradicted = 0 if c.convention_test is None else len(contradiction(c.convention_test, c.labels))
    blocks = [
        "\n".join(wrap(line, "  ") for line in c.counsel.lines()),
        *(wrap(f"Warning: {w}", "  ") for w in c.warnings[:contradicted]),
        wrap(" ".join(assumptions(c.labels, c.convention_test, c.others))),
        *(wrap(f"Warning: {w}", "  ") for w in c.warnings[contradicted:]),
        _corrections(c),
        _add(c),
        _vibration(c),
        _quality(c),
        *(wrap(f"Note: {w}.", "  ") for w in c.notes),
    ]
    return "\n\n".join(b for b in blocks if b)


def _corrections(c: Correction) -> str:
    mass, angle = c.labels.weight(c.weights)
    unit, factor = c.labels.weight_unit, c.coverage_factor
    rows = [["plane", unit, "angle", "95 %", ""]] if factor else [["plane", unit, "angle"]]
    rows[0] += [f"if {o.words}" for o in c.others]
    mass_std, angle_std = c.mass_std, c.angle_std
    for p, plane in enumerate(c.planes):
        gone = plane in c.remove
        row = [f"{plane} (remove)" if gone else plane, figures(mass[p]), _degrees(angle[p] + 180 * gone)]
        if factor and mass_std is not None and angle_std is not None:
            width = factor * mass_std[p]
            held = width < HELD * abs(c.weights[p])
            row.append("at its limit" if held else f"± {figures(width * c.labels.weight_scale, 2)} {unit}")
            half = factor * np.degrees(angle_std[p])
            if np.isnan(half):
                row.append("angle not determined")
            else:
                row.append("held by a limit" if half < np.degrees(HELD) else f"± {figures(half, 2)}°")
        rows.append(row + [_if_other(o, o.weights[p], row[1], gone=gone) for o in c.others])
    head = "Corrections: total weights for the bare rotor, every weight of the runs removed"
    taken = f" ({' and '.join(c.labels.assumed)} assumed)" if c.labels.assumed else ""
    foot = wrap(f"{capital(c.labels.turning_in_words())}; phases as {c.labels.phase}{taken}.", "")
    return f"{head}\n{table(rows)}\n{foot}"


def _if_other(other: OtherReading, weight: complex, shown: str, *, gone: bool) -> str:
    """The angle if a convention is otherwise, and the mass where that is another than the one shown."""
    mass, angle = other.labels.weight(weight)
    at = _degrees(float(angle) + 180 * gone)
    return at if figures(float(mass)) == shown else f"{figures(float(mass))} at {at}"


def _other_rows(c: Correction, other: OtherReading) -> list[dict[str, Any]]:
    said = {"if": other.words, "phase": other.labels.phase, "angles": other.labels.angle_words}
    rows = _weights(other.labels, c.planes, other.weights)
    at = [(row["angle_deg"] + 180) % 360 if row["plane"] in c.remove else None for row in rows]
    return [{**said, **row, "remove_at_deg": place} for row, place in zip(rows, at, strict=True)]


def _add(c: Correction) -> str:
    if c.mounted is None or c.to_add is None:
        return ""
    run, planes, weights = c.mounted
    mass, angle = c.labels.weight(weights)
    more, more_angle = c.labels.weight(c.to_add)
    unit = c.labels.weight_unit
    rows = [["plane", f"mounted {unit}", "angle", f"add {unit}", "angle"]]
    rows[0] += [f"if {o.words}" for o in c.others if o.to_add is not None]
    for p, plane in enumerate(planes):
        gone = plane in c.remove
        name = f"{plane} (remove)" if gone else plane
        more_at = _degrees(more_angle[p] + 180 * gone)
        row = [name, figures(mass[p]), _degrees(angle[p]), figures(more[p]), more_at]
        row += [_if_other(o, o.to_add[p], row[3], gone=gone) for o in c.others if o.to_add is not None]
        rows.append(row)
    head = wrap(f"The same rotor, if the weights of run {run!r} (the last one) stay mounted:", "")
    foot = ""
    if any(plane in c.remove for plane in planes):
        foot = "\nWhere material is removed, the last columns say how much and where."
    return f"{head}\n{table(rows)}{foot}"


def _vibration(c: Correction) -> str:
    from balancing.solvers.error_propagation import region_radius

    old, old_phase = c.labels.vibration(c.before)
    new, new_phase = c.labels.vibration(c.after)
    rows = [["rpm", "sensor", "before", "phase", "after", "phase"]]
    bound: FloatArray | None = None
    if c.after_covariance is not None:
        largest = np.sqrt(np.linalg.eigvalsh(c.after_covariance)[..., -1]) * c.labels.vibration_scale
        bound = region_radius(c.dof) * largest
        rows[0].append("95 % within")
    for s, speed in enumerate(c.speeds):
        for k, sensor in enumerate(c.sensors):
            row = [f"{rpm(speed):.6g}", sensor, figures(old[s, k], 3), _degrees(old_phase[s, k], 0)]
            shown = small(new[s, k], old.max())
            row += [shown, "" if shown == "0" else _degrees(new_phase[s, k], 0)]
            if bound is not None:
                row.append(f"± {figures(bound[s, k], 2)}")
            rows.append(row)
    unit = f" in {c.labels.vibration_unit}" if c.labels.vibration_unit else ""
    last = wrap(_rms(c, old, new), "")
    return "\n".join([f"Vibration{unit}, bare rotor before and predicted after", table(rows, left=2), last])


def _rms(c: Correction, old: FloatArray, new: FloatArray) -> str:
    """Before and after, and what a check run will show."""
    before = f"rms {figures(float(np.sqrt(np.mean(old**2))), 3)}"
    checked = None if c.check_rms is None else figures(c.check_rms * c.labels.vibration_scale, 2)
    if new.max() <= DUST * old.max():
        if checked is None:
            return f"{before} → 0 by arithmetic: as many readings as weights say nothing of what is left"
        return f"{before} → below {checked} in 95 of 100 check runs"
    after = small(float(np.sqrt(np.mean(new**2))), old.max())
    words = f"{before} → {after}, largest {figures(old.max(), 3)} → {small(new.max(), old.max())}"
    return words if checked is None else f"{words}; rms of a check run below {checked} in 95 of 100"


def _quality(c: Correction) -> str:
    n = len(c.planes)
    planes = {1: "the plane is", 2: "both planes are"}.get(n, f"all {n} planes are")
    unit, scale = c.labels.vibration_unit, c.labels.vibration_scale
    numbers = f"rank {c.rank} of {n}, condition number {c.condition_number:.3g}"
    lines = [method_words(c)]
    if c.gap is not None:
        lines[0] += f" The optimum is certified: at most {max(c.gap, 0.0):.1e} better is possible."
    if c.active:
        lines.append(f"Limits that bind: {'; '.join(c.active)}.")
    soft = c.method in ("ridge", "truncated")
    if not soft:
        lines.append(f"{planes.capitalize()} determined ({numbers}).")
    elif c.singular_values.size:
        shown = ", ".join(f"{s:.3g}" for s in c.singular_values)
        lines.append(f"{numbers.capitalize()}, singular values {shown}.")
    if c.chi_square is not None and c.fit_dof:
        lines.append(
            f"What is left of the vibration is {np.sqrt(c.chi_square / c.fit_dof):.2g} times what the "
            f"errors of the readings explain (χ² {c.chi_square:.1f} with "
            f"{counted(c.fit_dof, 'degree')} of freedom)."
        )
    if c.covariance is None:
        lines.append(
            "No intervals: no errors are stated, no reading is repeated, and no run is more than needed."
            if c.errors is None
            else "No intervals: the errors of the readings are not known."
        )
    else:
        lines.append(
            f"One standard deviation of a reading: {describe_errors(c.errors, unit, scale)} "
            f"({_SOURCES[c.error_source]}){_between_runs(c)}."
        )
        if c.dof is not None and c.dof < 200:
            lines[-1] += f" Degrees of freedom: {c.dof:.3g}."
    return "\n".join(wrap(line, "") for line in lines)


def _between_runs(c: Correction) -> str:
    """What changes from run to run, in words."""
    run, scale = c.run_errors, c.labels.vibration_scale
    p, w, f = np.sqrt(np.sum(run.sizes**2, axis=1))
    if run.origin == "none" or not (p or w or f):
        return ""
    floor = f"{figures(f * scale, 2)} {c.labels.vibration_unit}".rstrip()
    shown = (
        (p > SMALL, f"{100 * p:.2g} % of it"),
        (w > SMALL, f"{100 * w:.2g} % of what the weights do"),
        (f > 0, floor),
    )
    parts = [words for large, words in shown if large]
    common = f", {100 * run.common:.0f} % of the variance common to the sensors" if run.common > 0.1 else ""
    return f"; from run to run: {', '.join(parts)} ({run.origin}{common})"


def method_words(c: Correction) -> str:
    """What the method makes small."""
    every: tuple[Method[Any], ...] = (*METHODS, *VARIANTS)
    method = find(every, c.method, "method")
    about = method.about if c.row_weights is None else method.about.replace("amplitude", "weighted amplitude")
    return f"{capital(method.title or method.name)}: {about}."


def _mounted(c: Correction) -> dict[str, Any]:
    if c.mounted is None or c.to_add is None:
        return {"mounted_in_last_run": None, "add_to_mounted": None}
    run, planes, weights = c.mounted
    return {
        "mounted_in_last_run": {"run": run, "weights": _weights(c.labels, planes, weights)},
        "add_to_mounted": _weights(c.labels, planes, c.to_add),
    }


def _weights(labels: Labels, planes: tuple[str, ...], weights: ComplexArray) -> list[dict[str, Any]]:
    mass, angle = labels.weight(weights)
    return [
        {"plane": p, "mass": float(mass[i]), "unit": labels.weight_unit, "angle_deg": float(angle[i])}
        for i, p in enumerate(planes)
    ]


def _errors(c: Correction) -> dict[str, Any]:
    e, run = c.errors, c.run_errors
    p, w, f = (float(size) for size in np.sqrt(np.sum(run.sizes**2, axis=1)))
    return {
        "source": c.error_source,
        "amplitude_percent": None if e is None else 100 * e.amplitude,
        "phase_deg": None if e is None else float(np.degrees(e.phase)),
        "floor": None if e is None else e.floor * c.labels.vibration_scale,
        "degrees_of_freedom": c.dof,
        "between_runs": {
            "source": run.origin,
            "percent": 100 * p,
            "percent_of_effect": 100 * w,
            "floor": f * c.labels.vibration_scale,
            "rms": float(np.sqrt(run.kinds.sum())) * c.labels.vibration_scale,
            "common_share": run.common,
            "interval95": None
            if run.interval is None
            else [each * c.labels.vibration_scale for each in run.interval],
        },
    }


def _limits(c: Correction) -> dict[str, Any] | None:
    """Of the weights, and of each reading in the order of `residuals`; None where there is none."""
    if c.limits is None:
        return None
    weight = c.limits.max_weight * c.labels.weight_scale
    amplitude = c.limits.residual.ravel() * c.labels.vibration_scale
    return {
        "max_weight": {p: finite(w) for p, w in zip(c.planes, weight, strict=True)},
        "amplitude": [finite(a) for a in amplitude],
        "forbidden_deg": {
            p: [c.labels.arc(*arc, opposite=p in c.remove) for arc in arcs]
            for p, arcs in zip(c.planes, c.limits.forbidden, strict=True)
            if arcs
        },
    }


def small(value: float, scale: float) -> str:
    """A predicted amplitude; rounding dust of an exact solution is zero to a reader."""
    return "0" if value <= 1e-9 * scale else figures(value, 3)


def _degrees(angle: float, places: int = 1) -> str:
    return f"{round(angle, places) % 360:.{places}f}°"
