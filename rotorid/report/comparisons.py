"""Parts of the sheet of a reduction that compare: other places, masses and methods, both models running."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from rotorid.base.rpm import RPM
from rotorid.base.text import listing
from rotorid.report.document import NOTHING, Cells, Document
from rotorid.report.number_tables import Grid, Part, below, numbered, words
from rotorid.report.rotor_figures import (
    methods_picture,
    placement_picture,
    running_picture,
    stability_picture,
)

if TYPE_CHECKING:
    from rotorid.reduction import Methods, Placement, ResponseCost, StabilityCost

UNDAMPED = 1e-8
"""Logarithmic decrements below this are rounding."""
TOP = 10
"""Choices of nodes that are printed."""
STABILITY = (
    ("threshold, rpm", "threshold_rpm", 6),
    ("threshold, rad/s", "threshold_rad_s", 6),
    ("whirl frequency there, rad/s", "frequency_rad_s", 6),
    ("whirl by running speed", "whirl_ratio", 4),
    ("smallest logarithmic decrement", "smallest_log_decrement", 3),
)
"""Rows on the stability of a model: words, key of the document, significant digits."""


def methods_part(document: Document, methods: Methods) -> Part:
    """All methods of reduction at the same nodes."""
    found = document["methods"]["methods"]
    said = [f"{each['method']}: {each['reason']}" for each in found if each["reason"]]
    full = [each["method"] for each in found if each["mass_matrix_kg"] is not None and not each["diagonal"]]
    said.append(f"{listing(full, 'and')} have full mass matrices, which couple the nodes.")
    columns = _by_mode(document, "methods.methods", "method", [each["method"] for each in found])
    return Part(
        "Other methods at these nodes",
        tuple(said),
        (Grid("Frequencies and shapes by method", columns),),
        (methods_picture(methods),),
    )


def _by_mode(document: Document, key: str, head: str, names: Sequence[str]) -> tuple[Cells, ...]:
    """One row per model and mode; the name of the model stands in the first of each."""
    modes = range(len(document["nodes"]))
    columns = []
    for r, name in enumerate(names):
        stem = f"{key}.{r}"
        frequencies = document.column("rad/s", f"{stem}.natural_frequencies_rad_s.*", rows=modes, decimals=3)
        errors = document.column(
            "error, %", f"{stem}.relative_error.*", rows=modes, decimals=3, scale=100.0, sign=True
        )
        mac = document.column("MAC", f"{stem}.mac.*", rows=modes, decimals=4)
        first = words(head, (name, *("" for _ in modes[1:])))
        columns.append((first, numbered("mode", len(modes)), frequencies, errors, mac))
    return below(*columns)


def placement_part(document: Document, placement: Placement) -> Part:
    """The ranking of places, and the choices with a name."""
    from markupsafe import Markup

    found = document["placement"]
    said = Markup("{} choices of nodes, {} of them with positive masses.").format(
        document.show("placement.considered", decimals=0), document.show("placement.ranked", decimals=0)
    )
    trap = Markup(
        "{} choices match all checked frequencies but not the shapes: choose by both columns."
    ).format(document.show("placement.frequency_match_with_wrong_shapes", decimals=0))
    named = {
        f"placement.{key}": name
        for name, key in (
            ("best by frequency", "best_by_frequency"),
            ("best by MAC", "best_by_mac"),
            ("compromise", "compromise"),
            ("the book's rule", "book_rule"),
        )
        if found[key] is not None
    }
    ranked = {f"placement.choices.{r}": each["rank"] for r, each in enumerate(found["choices"][:TOP])}
    tables = [
        Grid(caption, _choices(document, head, choices))
        for caption, head, choices in (
            ("Choices with a name", "choice", named),
            ("First in rank", "rank", ranked),
        )
        if choices
    ]
    drawings = (placement_picture(placement),) if placement.ranked else ()
    return Part("Other places of the masses", (said, trap), tuple(tables), drawings)


def _choices(document: Document, head: str, choices: Mapping[str, object]) -> tuple[Cells, ...]:
    """One row per choice of nodes, each given by its path and called by a name or number."""
    return (
        words(head, choices.values()),
        words("nodes", (", ".join(map(str, document.found(f"{key}.nodes"))) for key in choices)),
        Cells(
            "masses, kg",
            tuple(document.listed(f"{key}.masses_kg.*", decimals=2) for key in choices),
            words=True,
        ),
        Cells(
            "largest error, %",
            tuple(document.show(f"{key}.largest_error", decimals=3, scale=100.0) for key in choices),
        ),
        Cells("smallest MAC", tuple(document.show(f"{key}.smallest_mac", decimals=4) for key in choices)),
        Cells("condition", tuple(document.show(f"{key}.condition_number", 3) for key in choices)),
    )


def response_part(document: Document, response: ResponseCost) -> Part:
    """Unbalance response of both models."""
    from markupsafe import Markup

    found = document["response"]
    said = [
        Markup("Compared at {} speeds from {} to {} rpm, at the masses.").format(
            len(found["speeds_rad_s"]),
            document.show("response.speeds_rad_s.0", decimals=1, scale=RPM),
            document.show(f"response.speeds_rad_s.{len(found['speeds_rad_s']) - 1}", decimals=1, scale=RPM),
        )
    ]
    if found["largest"] is not None:
        said.append(
            Markup(
                "The small model is within {} % of the largest influence coefficient at the same speed "
                "(median {} %). Worst at {} rpm: reading at {}, "
                "unbalance at {}."
            ).format(
                document.show("response.largest", 3, scale=100.0),
                document.show("response.median", 3, scale=100.0),
                document.show("response.where.speed_rad_s", decimals=1, scale=RPM),
                found["where"]["sensor"],
                found["where"]["plane"],
            )
        )
    left = sum(map(bool, found["excluded"]))
    if left:
        said.append(Markup("{} speeds near critical speeds are left out of these numbers.").format(left))
    drawn = running_picture(response)
    return Part("Unbalance response beside the full rotor's", tuple(said), drawings=(drawn,))


def stability_part(document: Document, stability: StabilityCost) -> Part:
    """Stability of both models over speed; where nothing damps, there is nothing to draw."""
    from markupsafe import Markup

    found = document["stability"]
    heading = "Stability"
    span = Markup("From {} to {} rpm").format(
        document.show("stability.full.lowest_rad_s", decimals=1, scale=RPM),
        document.show("stability.full.highest_rad_s", decimals=1, scale=RPM),
    )
    decrements = [v for which in ("full", "small") for v in found[f"{which}_log_decrement"] if v is not None]
    if decrements and max(map(abs, decrements)) < UNDAMPED:
        return Part(heading, (span + " no damping acts on either model: no motion grows, and none decays.",))
    columns = (
        words("", ("status", *(name for name, _, _ in STABILITY), "direction")),
        _one_model(document, "full rotor", "full"),
        _one_model(document, "small model", "small"),
    )
    said = []
    if found["relative_difference_of_threshold"] is not None:
        said.append(
            Markup("The small model loses stability {} % away from the speed of the full rotor.").format(
                document.show("stability.relative_difference_of_threshold", 3, scale=100.0, sign=True)
            )
        )
    return Part(heading, tuple(said), (Grid(span, columns),), (stability_picture(stability),))


def _one_model(document: Document, head: str, which: str) -> Cells:
    """What is known of the stability of one model."""
    found = document.found(f"stability.{which}")
    status = {"threshold": "unstable above"}.get(found["status"], found["status"])
    numbers = (document.show(f"stability.{which}.{key}", digits) for _, key, digits in STABILITY)
    return Cells(head, (status, *numbers, found["direction"] or NOTHING))
