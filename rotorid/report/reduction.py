"""Sheet of `rotorid reduce`: the masses, how good they are, and what was compared with them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from rotorid.base.text import counted
from rotorid.base.units import RPM
from rotorid.report.comparisons import (
    methods_part,
    placement_part,
    response_part,
    stability_part,
    trade_off_part,
)
from rotorid.report.grids import Grid, Numbers, Part, every_warning, few
from rotorid.report.inputs import rotor_sheet
from rotorid.report.page import NOTHING, render_report
from rotorid.report.pictures import reduction_picture

if TYPE_CHECKING:
    from rotorid.reduction import Methods, Placement, Reduction, ResponseCost, StabilityCost

SCALES = {"first": "1 at the first mass", "largest": "1 at their largest", "length": "the length 1"}


def reduce_report(
    document: Mapping[str, Any],
    result: Reduction,
    *,
    provenance: Mapping[str, Any],
    placement: Placement | None = None,
    methods: Methods | None = None,
    response: ResponseCost | None = None,
    stability: StabilityCost | None = None,
) -> bytes:
    """Make the sheet of a reduction.

    Parameters
    ----------
    document
        What `rotorid reduce --json` prints, without the provenance.
    result
        The reduction it is from.
    provenance
        Program version, input files, date and options.
    placement, methods, response, stability
        What the document holds besides, for the pictures.

    Returns
    -------
    bytes
        HTML, UTF-8.
    """
    show = Numbers(document)
    parts = [
        _masses(document, show, result),
        *_uncertain(document, show),
        *_what_if(document, show),
        *_if("trade_off", document, lambda: trade_off_part(document, show)),
        *_if("methods", document, lambda: methods_part(document, show, methods)),
        *_if("response", document, lambda: response_part(document, show, response)),
        *_if("stability", document, lambda: stability_part(document, show, stability)),
        *_if("small_model", document, lambda: _small(document)),
        *_if("placement", document, lambda: placement_part(document, show, placement)),
        _compliance(document, show),
    ]
    return render_report(
        "reduce.html",
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


def _if(key: str, document: Mapping[str, Any], part: Callable[[], Part]) -> list[Part]:
    return [part()] if document.get(key) is not None else []


def _about(document: Mapping[str, Any], provenance: Mapping[str, Any]) -> list[tuple[str, str]]:
    files = ", ".join(str(entry["file"]) for entry in provenance["inputs"])
    how = f"formula (50), regression over {counted(document['modes'], 'mode')}"
    how += ", no mass below 0" if document["nonnegative"] else ""
    how += ", rows of each mode relative to its 1/ω²" if document["rows"] == "relative" else ""
    return [
        ("Files", files),
        ("Masses at", f"nodes {few(document['nodes'])}"),
        ("Method", how),
        ("Modes from", {"rotor": "the rotor model", "measured": "measurement"}[document["source"]]),
        ("Shapes scaled", f"to {SCALES[document['normalise']]}"),
    ]


def _masses(document: Mapping[str, Any], show: Numbers, result: Reduction) -> Part:
    known = document["positions_m"] is not None
    sure = document["masses_std_kg"] is not None
    heads = ["node", *(["position, m"] if known else []), "mass, kg", *(["±, kg"] if sure else [])]
    rows = tuple(
        (
            str(node),
            *([show(f"positions_m.{i}", decimals=4)] if known else []),
            show(f"masses_kg.{i}", decimals=3),
            *([show(f"masses_std_kg.{i}", 2)] if sure else []),
        )
        for i, node in enumerate(document["nodes"])
    )
    note = (
        "±: one standard deviation from the residuals of the regression: error of the model." if sure else ""
    )
    modes = tuple(
        (
            str(k + 1),
            show(f"natural_frequencies_rad_s.{k}", decimals=4),
            show(f"rotor_frequencies_rad_s.{k}", decimals=4),
            show(f"relative_error.{k}", decimals=3, scale=100.0, sign=True),
            show(f"mac.{k}", decimals=5),
        )
        for k in range(len(document["natural_frequencies_rad_s"]))
    )
    words = (
        "the model (points) and the rotor (lines)"
        if document["source"] == "rotor"
        else "the model (full) and as measured (hollow)"
    )
    return Part(
        "Masses and modes",
        (_condition(show),),
        (
            Grid("Equivalent masses", tuple(heads), rows, (0,), note),
            Grid(
                "Natural frequencies and shapes",
                ("mode", "model, rad/s", "rotor, rad/s", "error, %", "MAC"),
                modes,
                note="MAC: 1 where the shapes at the masses are the same, 0 where nothing of them is.",
            ),
        ),
        (reduction_picture(result, words),),
    )


def _condition(show: Numbers) -> str:
    from markupsafe import Markup

    return Markup("Condition number of the regression: {}.").format(show("condition_number", 3))


def _uncertain(document: Mapping[str, Any], show: Numbers) -> list[Part]:
    """What errors of the inputs do to masses and frequencies."""
    found = document.get("uncertainty")
    if found is None:
        return []
    drawn = found["drawn"] is not None
    rows = []
    for key, square, digits in (
        ("masses", "masses_kg2", 3),
        ("natural_frequencies", "natural_frequencies_rad2_s2", 4),
    ):
        unit = "kg" if key == "masses" else "rad_s"
        for i, name in enumerate(_names(document)[key]):
            shares = {name: part[square][i] or 0.0 for name, part in found["contributions"].items()}
            whole = sum(shares.values())
            largest = sorted(shares, key=lambda name: -shares[name])[:3] if whole > 0 else []
            stem = f"uncertainty.{key}"
            rows.append(
                (
                    name,
                    show(f"{stem}_{unit}.{i}", decimals=digits),
                    show(f"{stem}_std_{unit}.{i}", 3),
                    *([show(f"uncertainty.drawn.{key}_std_{unit}.{i}", 3)] if drawn else []),
                    ", ".join(f"{name} {100 * shares[name] / whole:.0f} %" for name in largest) or NOTHING,
                )
            )
    heads = ("quantity", "value", "±", *(["± of drawn inputs"] if drawn else []), "from")
    texts = (0, len(heads) - 1)
    note = "±: one standard deviation; from: the inputs that make up most of the variance."
    return [
        Part("What errors of the inputs do", tables=(Grid("Uncertainty", heads, tuple(rows), texts, note),))
    ]


def _what_if(document: Mapping[str, Any], show: Numbers) -> list[Part]:
    if "what_if" not in document:
        return []
    rows = tuple(
        (
            name,
            show(f"what_if.exact.{key}.{i}", 4, sign=True),
            show(f"what_if.first_order.{key}.{i}", 4, sign=True),
        )
        for kind, key in (("masses", "masses_kg"), ("natural_frequencies", "frequencies_rad_s"))
        for i, name in enumerate(_names(document)[kind])
    )
    heads = ("quantity", "change", "predicted to first order")
    return [
        Part(
            "What the asked change of inputs does", tables=(Grid("Change, kg and rad/s", heads, rows, (0,)),)
        )
    ]


def _names(document: Mapping[str, Any]) -> dict[str, list[str]]:
    return {
        "masses": [f"mass at {node}, kg" for node in document["nodes"]],
        "natural_frequencies": [f"frequency {k + 1}, rad/s" for k in range(len(document["nodes"]))],
    }


def _small(document: Mapping[str, Any]) -> Part:
    """What the small model keeps, in words."""
    small = document["small_model"]
    said = [
        "Both planes: masses on a massless shaft, with the rotor's bearings, seals and gyroscopic effect."
    ]
    if small["support_nodes"]:
        said.append(f"Places without mass that carry supports: nodes {few(small['support_nodes'])}.")
    if small["modal_damping"]:
        ratios = few([f"{100 * ratio:g} %" for ratio in small["modal_damping"]])
        said.append(f"Modal damping of the first modes: {ratios} of critical.")
    return Part("The small model to go on with", tuple(said))


def _compliance(document: Mapping[str, Any], show: Numbers) -> Part:
    """What the masses were computed from: compliance at the masses, springs that it does not hold."""
    nodes = document["nodes"]
    rows = tuple(
        (f"at {node}", *(show(f"compliance_m_per_N.{i}.{j}", 6, scale=1e9) for j in range(len(nodes))))
        for i, node in enumerate(nodes)
    )
    heads = ("deflection, nm/N", *(f"force at {node}" for node in nodes))
    tables = [Grid("Compliance", heads, rows, (0,))]
    if any(document["seal_stiffness_N_per_m"]):
        springs = tuple((str(node), show(f"seal_stiffness_N_per_m.{i}", 6)) for i, node in enumerate(nodes))
        tables.append(Grid("Springs of seals to the ground", ("node", "stiffness, N/m"), springs, (0,)))
    used = tuple(
        (
            str(k + 1),
            show(f"rotor_frequencies_rad_s.{k}", 9),
            show(f"rotor_frequencies_rad_s.{k}", 7, scale=RPM),
        )
        for k in range(document["modes"])
    )
    tables.append(Grid("Modes of the regression", ("mode", "rad/s", "rpm"), used))
    tables += _apart(document, show)
    return Part("Compliance at the masses, and modes used", tables=tuple(tables))


def _apart(document: Mapping[str, Any], show: Numbers) -> list[Grid]:
    """The shaft's own compliance and the shares of its two bearings, formula (47)."""
    if "separated" not in document:
        return []
    nodes, supports = document["nodes"], document["separated"]["supports"]
    rows = tuple(
        (
            f"at {node}",
            *(show(f"separated.delta_m_per_N.{i}.{j}", 6, scale=1e9) for j in range(len(nodes))),
            *(show(f"separated.fractions.{i}.{s}", decimals=4) for s in range(len(supports))),
        )
        for i, node in enumerate(nodes)
    )
    heads = ("deflection, nm/N", *(f"force at {node}" for node in nodes))
    heads += tuple(f"share of {support}" for support in supports)
    return [Grid("Of the shaft alone, on rigid bearings; shares of the bearings' nodes", heads, rows, (0,))]
