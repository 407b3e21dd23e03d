"""Sheets of `rotorid fit` and `rotorid identify`: the estimate first, what it rests on behind it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import Answer
from rotorid.base.arrays import FloatArray
from rotorid.base.tables import evenly
from rotorid.base.text import counted, listing, sentence
from rotorid.base.unit_words import Shown
from rotorid.regression.estimate import value_digits
from rotorid.regression.undetermined_combinations import FoundCombination
from rotorid.report.document import NOTHING, Cells, Document
from rotorid.report.number_tables import Grid, Part, every_warning, shown, words
from rotorid.report.page import inline_svg, render_report
from rotorid.report.rotor_figures import Drawing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.identify import Identification
    from rotorid.identify.result_records import Fit
    from rotorid.regression.prior import PriorEffect

READINGS = 40
"""Rows at most."""
NOT_STATED = "not stated: all count alike, and intervals come from what the model leaves"
Facts = list[tuple[str, str]]


def fit_report(
    document: Mapping[str, Any], result: Fit, *, provenance: Mapping[str, Any], model: str
) -> bytes:
    """Make the sheet of a fit to time records, HTML in UTF-8.

    Parameters
    ----------
    document
        What `rotorid fit --json` prints, without the `provenance`.
    result
        The fit it is from.
    model
        Text of the model file; empty: there was none.
    """
    from markupsafe import Markup

    from rotorid.identify.plots_records import figure_fit

    document = Document(document)
    left = Markup("Residuals {} (rms, in the unit of the model)").format(document.show("residual_rms", 4))
    if result.autocorrelation is not None:
        seen = Markup("; correlation of neighbouring ones {} (0 of noise alone)")
        left += seen.format(document.show("autocorrelation", decimals=2))
    parts = [
        _estimate(document, result.answer, result.estimate.combinations, result.prior, result.at_bounds),
        Part("What the model leaves", (left + ".",), (Grid("Each signal", shown(result.series)),)),
        *_model(model),
        _picture(figure_fit(result), "Signals and residuals over time"),
    ]
    return _sheet("Parameters from time records", document, provenance, _records(result), parts)


def identification_report(
    document: Mapping[str, Any],
    result: Identification,
    *,
    provenance: Mapping[str, Any],
    model: str,
) -> bytes:
    """Make the sheet of an identification; see `fit_report`."""
    from rotorid.identify.plots import figure_identification

    document = Document(document)
    columns = result.residuals
    count = len(columns[0].values)
    rows = evenly(count, READINGS)
    note = f"{len(rows)} of {count} readings; --table prints all." if len(rows) < count else ""
    left = Part("What the model leaves", tables=(Grid("Each reading", shown(columns, rows), note),))
    parts = [
        _estimate(document, result.answer, result.combinations, result.prior),
        *[left][:count],
        *_model(model),
        _picture(figure_identification(result), "Amplitudes or shapes"),
    ]
    return _sheet("Coefficients from harmonic tests", document, provenance, _experiments(result), parts)


def _sheet(
    title: str, document: Document, provenance: Mapping[str, Any], about: Facts, parts: Sequence[Part]
) -> bytes:
    files = ", ".join(str(entry["file"]) for entry in provenance["inputs"])
    return render_report(
        "parts.html",
        document,
        title=title,
        warnings=every_warning(document),
        provenance=provenance,
        about=[("Files", files), *about] if files else about,
        rotor=None,
        parts=parts,
    )


def _records(result: Fit) -> Facts:
    """What was measured, with which errors, and how it was fitted."""
    from rotorid.identify.records import record_names

    names = record_names([one.name for one in result.records])
    spans = [
        f"{name}: {counted(len(one), 'time')}, {_span(one.axis, one.t)}"
        for name, one in zip(names, result.records, strict=True)
    ]
    errors = "stated" if any(one.sigma for one in result.records) else NOT_STATED
    if result.errors:
        errors = "estimated from the residuals of each output, and used as weights"
    how = f"{result.method}, integrator {result.integrator}: {result.message}"
    return [("Records", "; ".join(spans)), ("Errors", errors), ("Method", how)]


def _experiments(result: Identification) -> Facts:
    """What was measured, with which errors."""
    data, e = result.experiments, result.experiments.errors
    errors = NOT_STATED
    if data.covariances:
        errors = f"from repeated readings of {listing(data.covariances, 'and')}"
    elif e is not None:
        errors = f"{100 * e.relative:g} % of an amplitude, {math.degrees(e.phase):g}° of a phase"
        errors += f", {e.floor:g} at amplitude 0" if e.floor else ""
    what = f"{len(data)}, {_span(data.axis, data.frequencies)}; amplitudes of {listing(data.signals, 'and')}"
    return [("Experiments", what), ("Errors", errors)]


def _span(axis: Shown, values: FloatArray) -> str:
    """First and last of them, or the only one, as people see them."""
    ends = dict.fromkeys(f"{axis.scale * one:.6g}" for one in (values.min(), values.max()))
    return f"{' to '.join(ends)} {axis.word.rpartition(', ')[2]}"


def _estimate(
    document: Document,
    answer: Answer,
    combinations: Sequence[FoundCombination],
    prior: PriorEffect | None,
    at_bounds: Sequence[str] = (),
) -> Part:
    """The judgement, every parameter with its interval or why it has none, and what is determined instead."""
    found, solutions = document["parameters"], document["solutions"]
    numbers, remarks, why = [], [], prior.why if prior else {}
    for name, one in found.items():
        value, std = one["value"], one["std"]
        digits = value_digits(value or 0.0, std)
        keys = [f"{name}.value", f"{name}.std"]
        keys += [f"{name}.ci95.0", f"{name}.ci95.1"] if one["ci95"] is not None else []
        cells = [document.show(f"parameters.{key}", 3 if key.endswith("std") else digits) for key in keys]
        numbers.append([*cells, NOTHING, NOTHING][:4])
        several = value is None and len({one[name] for one in solutions}) > 1
        unknown = "several values" if several else "not determined" if value is None else why.get(name, "")
        remarks.append("at its bound" if name in at_bounds else unknown)
    value, std, low, high = zip(*numbers, strict=True)
    columns = [words("parameter", found), Cells("estimate", value), Cells("±", std)]
    columns += [Cells("95 %: from", low), Cells("to", high)]
    columns += [words("", remarks)] if any(remarks) else []
    note = " ".join(["±: one standard deviation.", *map(sentence, answer.notes)])
    tables = [Grid("Parameters, in the units of the model", tuple(columns), note)]
    if len(solutions) > 1:
        each = (
            Cells(f"solution {k + 1}", tuple(document.show(f"solutions.{k}.{name}", 6) for name in one))
            for k, one in enumerate(solutions)
        )
        tables.append(Grid("All solutions explain the data alike", (words("parameter", solutions[0]), *each)))
    said = answer.judgement.splitlines()
    said += [f"Determined: {'; '.join(c.line() for c in combinations)}."] if combinations else []
    return Part("What was found", tuple(said), tuple(tables))


def _model(text: str) -> list[Part]:
    """The model as its file says it."""
    return [Part("The model, as its file says", listing=text.strip())] if text.strip() else []


def _picture(figure: Figure, what: str) -> Part:
    caption = f"{what}; parameters with their 95 % intervals."
    return Part("Measured and model", drawings=(Drawing(inline_svg(figure, caption), caption),))
