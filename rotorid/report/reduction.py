"""Sheet of `rotorid reduce`: the masses, how good they are, and what was compared with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from rotorid.base.rpm import RPM
from rotorid.base.text import counted, listing
from rotorid.report.comparisons import (
    methods_part,
    placement_part,
    response_part,
    stability_part,
)
from rotorid.report.document import Cells, Document
from rotorid.report.number_tables import Grid, Part, below, every_warning, numbered, words
from rotorid.report.page import render_report
from rotorid.report.rotor_description import rotor_sheet
from rotorid.report.rotor_figures import reduction_picture

if TYPE_CHECKING:
    from rotorid.reduction import Reduction

SCALES = {"first": "1 at the first mass", "largest": "1 at their largest", "length": "the length 1"}


def reduce_report(
    document: Mapping[str, Any], results: Mapping[str, Any], provenance: Mapping[str, Any]
) -> bytes:
    """Make the sheet of a reduction, HTML in UTF-8.

    Parameters
    ----------
    document
        What `rotorid reduce --json` prints, without the provenance.
    results
        The results that it is from, by their keys in it; the reduction is that of "".
    provenance
        Program version, input files, date and options.
    """
    document = Document(document)
    result: Reduction = results[""]
    parts = [
        _masses(document, result),
        *_uncertain(document),
        *_if("methods", document, methods_part, results["methods"]),
        *_if("response", document, response_part, results["response"]),
        *_if("stability", document, stability_part, results["stability"]),
        *_if("small_model", document, _small),
        *_if("placement", document, placement_part, results["placement"]),
        _compliance(document),
    ]
    return render_report(
        "parts.html",
        document,
        title=f"Rotor reduced to {counted(len(document['nodes']), 'mass', 'masses')}",
        warnings=every_warning(document),
        provenance=provenance,
        about=_about(document, provenance),
        rotor=None
        if result.rotor is None
        else rotor_sheet(
            result.rotor, planes=list(result.nodes), meaning="places of the masses", at_rest=True
        ),
        parts=parts,
    )


def _if(key: str, document: Document, part: Callable[..., Part], *results: object) -> list[Part]:
    """The part of what the document holds under a key, if it holds it."""
    return [] if document.get(key) is None else [part(document, *results)]


def _about(document: Mapping[str, Any], provenance: Mapping[str, Any]) -> list[tuple[str, str]]:
    files = ", ".join(str(entry["file"]) for entry in provenance["inputs"])
    how = f"formula (50), regression over {counted(document['modes'], 'mode')}"
    how += ", no mass below 0" if document["nonnegative"] else ""
    how += ", rows of each mode relative to its 1/ω²" if document["rows"] == "relative" else ""
    return [
        ("Files", files),
        ("Masses at", f"nodes {listing(map(str, document['nodes']), 'and')}"),
        ("Method", how),
        ("Modes from", {"rotor": "the rotor model", "measured": "measurement"}[document["source"]]),
        ("Shapes scaled", f"to {SCALES[document['normalise']]}"),
    ]


def _masses(document: Document, result: Reduction) -> Part:
    masses, note = [words("node", document["nodes"])], ""
    if document["positions_m"] is not None:
        masses.append(document.column("position, m", "positions_m.*", decimals=4))
    masses.append(document.column("mass, kg", "masses_kg.*", decimals=3))
    if document["masses_std_kg"] is not None:
        masses.append(document.column("±, kg", "masses_std_kg.*", 2))
        note = "±: one standard deviation from the residuals of the regression: error of the model."
    count = len(document["natural_frequencies_rad_s"])
    modes = (
        numbered("mode", count),
        document.column("model, rad/s", "natural_frequencies_rad_s.*", decimals=4),
        document.column("rotor, rad/s", "rotor_frequencies_rad_s.*", rows=range(count), decimals=4),
        document.column("error, %", "relative_error.*", decimals=3, scale=100.0, sign=True),
        document.column("MAC", "mac.*", decimals=5),
    )
    meaning = "MAC: 1 where the shapes at the masses are the same, 0 where nothing of them is."
    drawn = (
        "the model (points) and the rotor (lines)"
        if document["source"] == "rotor"
        else "the model (full) and as measured (hollow)"
    )
    return Part(
        "Masses and modes",
        (_condition(document),),
        (
            Grid("Equivalent masses", tuple(masses), note),
            Grid("Natural frequencies and shapes", modes, meaning),
        ),
        (reduction_picture(result, drawn),),
    )


def _condition(document: Document) -> str:
    from markupsafe import Markup

    return Markup("Condition number of the regression: {}.").format(document.show("condition_number", 3))


def _uncertain(document: Document) -> list[Part]:
    """What errors of the inputs do to masses and frequencies."""
    if document.get("uncertainty") is None:
        return []
    columns = [
        (
            words("quantity", _names(document)[kind]),
            document.column("value", f"{kind}_{unit}.*", decimals=digits),
            document.column("±", f"uncertainty.{kind}_std_{unit}.*", 3),
        )
        for kind, unit, digits in (("masses", "kg", 3), ("natural_frequencies", "rad_s", 4))
    ]
    table = Grid("Uncertainty", below(*columns), "±: one standard deviation, of redrawn inputs.")
    return [Part("What errors of the inputs do", tables=(table,))]


def _names(document: Document) -> dict[str, list[str]]:
    return {
        "masses": [f"mass at {node}, kg" for node in document["nodes"]],
        "natural_frequencies": [f"frequency {k + 1}, rad/s" for k in range(len(document["nodes"]))],
    }


def _small(document: Document) -> Part:
    """What the small model keeps, in words."""
    small = document["small_model"]
    words_of = [
        "Both planes: masses on a massless shaft, with the rotor's bearings, seals and gyroscopic effect."
    ]
    bare = [node for node, mass in zip(small["nodes"], small["masses_kg"], strict=True) if not mass]
    if bare:
        words_of.append(f"Places without mass that carry supports: nodes {listing(map(str, bare), 'and')}.")
    return Part("The small model to go on with", tuple(words_of))


def _compliance(document: Document) -> Part:
    """What the masses were computed from: compliance at the masses, springs that it does not hold."""
    tables = [Grid("Compliance", _deflections(document, "compliance_m_per_N"))]
    if any(document["seal_stiffness_N_per_m"]):
        springs = (
            words("node", document["nodes"]),
            document.column("stiffness, N/m", "seal_stiffness_N_per_m.*"),
        )
        tables.append(Grid("Springs of seals to the ground", springs))
    used = range(document["modes"])
    columns = (
        numbered("mode", len(used)),
        document.column("rad/s", "rotor_frequencies_rad_s.*", 9, rows=used),
        document.column("rpm", "rotor_frequencies_rad_s.*", 7, rows=used, scale=RPM),
    )
    tables.append(Grid("Modes of the regression", columns))
    tables += _apart(document)
    return Part("Compliance at the masses, and modes used", tables=tuple(tables))


def _deflections(document: Document, key: str) -> tuple[Cells, ...]:
    """Deflections at the masses under unit forces there."""
    nodes = document["nodes"]
    return (
        words("deflection, nm/N", (f"at {node}" for node in nodes)),
        *(document.column(f"force at {node}", f"{key}.*.{j}", scale=1e9) for j, node in enumerate(nodes)),
    )


def _apart(document: Document) -> list[Grid]:
    """The shaft's own compliance and the shares of its two bearings, formula (47)."""
    if "separated" not in document:
        return []
    shares = (
        document.column(f"share of {support}", f"separated.fractions.*.{s}", decimals=4)
        for s, support in enumerate(document["separated"]["supports"])
    )
    columns = (*_deflections(document, "separated.delta_m_per_N"), *shares)
    return [Grid("Of the shaft alone, on rigid bearings; shares of the bearings' nodes", columns)]
