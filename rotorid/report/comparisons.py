"""Parts of the sheet of a reduction that compare: other places, masses and methods, both models running."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rotorid.base.text import listing
from rotorid.base.units import RPM
from rotorid.report.grids import Grid, Numbers, Part
from rotorid.report.page import NOTHING
from rotorid.report.pictures import (
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


def trade_off_part(document: Mapping[str, Any], show: Numbers) -> Part:
    """Other masses at the same nodes: frequencies against shapes."""
    count = len(document["nodes"])
    rows = [
        row
        for r, found in enumerate(document["trade_off"]["alternatives"])
        for row in _by_mode(show, f"trade_off.alternatives.{r}", found["model"], count, found["masses_kg"])
    ]
    heads = ("masses from", "mode", "rad/s", "error, %", "MAC")
    note = (
        "Masses that have all frequencies of the rotor (matching sets) can still move unlike it: choose by "
        "the error and the MAC."
    )
    return Part("Other masses at these nodes", tables=(Grid("", heads, tuple(rows), (0,), note),))


def methods_part(document: Mapping[str, Any], show: Numbers, methods: Methods | None) -> Part:
    """All methods of reduction at the same nodes."""
    count, rows, said = len(document["nodes"]), [], []
    for m, found in enumerate(document["methods"]["methods"]):
        rows += _by_mode(show, f"methods.methods.{m}", found["method"], count, None)
        said += [f"{found['method']}: {found['reason']}"] if found["reason"] else []
    heads = ("method", "mode", "rad/s", "error, %", "MAC")
    models = [found for found in document["methods"]["methods"] if found["mass_matrix_kg"] is not None]
    full = listing([found["method"] for found in models if not found["diagonal"]], "and")
    said.append(f"{full} have full mass matrices, which couple the nodes.")
    return Part(
        "Other methods at these nodes",
        tuple(said),
        (Grid("Frequencies and shapes by method", heads, tuple(rows), (0,)),),
        () if methods is None else (methods_picture(methods),),
    )


def _by_mode(
    show: Numbers, key: str, name: str, count: int, masses: list[float] | None
) -> list[tuple[str, ...]]:
    """One row per mode; the name and the masses stand in the first."""
    from markupsafe import Markup

    first = name
    if masses is not None:
        list_of = Markup(", ").join(show(f"{key}.masses_kg.{i}", decimals=2) for i in range(len(masses)))
        first = Markup("{}: {} kg").format(name, list_of)
    return [
        (
            first if k == 0 else "",
            str(k + 1),
            show(f"{key}.natural_frequencies_rad_s.{k}", decimals=3),
            show(f"{key}.relative_error.{k}", decimals=3, scale=100.0, sign=True),
            show(f"{key}.mac.{k}", decimals=4),
        )
        for k in range(count)
    ]


def placement_part(document: Mapping[str, Any], show: Numbers, placement: Placement | None) -> Part:
    """The ranking of places, and the choices with a name."""
    from markupsafe import Markup

    found = document["placement"]
    said = Markup("{} choices of nodes, {} of them with positive masses.").format(
        show("placement.considered", decimals=0), show("placement.ranked", decimals=0)
    )
    trap = Markup(
        "{} choices match all checked frequencies but not the shapes: choose by both columns."
    ).format(show("placement.frequency_match_with_wrong_shapes", decimals=0))
    named = [
        (words, f"placement.{key}", found[key])
        for words, key in (
            ("best by frequency", "best_by_frequency"),
            ("best by MAC", "best_by_mac"),
            ("compromise", "compromise"),
            ("the book's rule", "book_rule"),
        )
        if found[key] is not None
    ]
    ranked = [
        (str(choice["rank"]), f"placement.choices.{r}", choice)
        for r, choice in enumerate(found["choices"][:TOP])
    ]
    heads = ("nodes", "masses, kg", "largest error, %", "smallest MAC", "condition")
    tables = [
        Grid(caption, (first, *heads), tuple(_choice(show, *row) for row in rows), (0, 1, 2))
        for caption, first, rows in (
            ("Choices with a name", "choice", named),
            ("First in rank", "rank", ranked),
        )
        if rows
    ]
    drawings = () if placement is None or not placement.ranked else (placement_picture(placement),)
    return Part("Other places of the masses", (said, trap), tuple(tables), drawings)


def _choice(show: Numbers, words: str, key: str, choice: Mapping[str, Any]) -> tuple[str, ...]:
    from markupsafe import Markup

    masses = (show(f"{key}.masses_kg.{i}", decimals=2) for i in range(len(choice["masses_kg"])))
    return (
        words,
        ", ".join(map(str, choice["nodes"])),
        Markup(", ").join(masses),
        show(f"{key}.largest_error", decimals=3, scale=100.0),
        show(f"{key}.smallest_mac", decimals=4),
        show(f"{key}.condition_number", 3),
    )


def response_part(document: Mapping[str, Any], show: Numbers, response: ResponseCost | None) -> Part:
    """Unbalance response of both models."""
    from markupsafe import Markup

    found = document["response"]
    said = [
        Markup("Compared at {} speeds from {} to {} rpm, at the masses.").format(
            len(found["speeds_rad_s"]),
            show("response.speeds_rad_s.0", decimals=1, scale=RPM),
            show(f"response.speeds_rad_s.{len(found['speeds_rad_s']) - 1}", decimals=1, scale=RPM),
        )
    ]
    if found["largest"] is not None:
        said.append(
            Markup(
                "The small model is within {} % of the largest influence coefficient at the same speed "
                "(median {} %), within {} % of the largest of all speeds. Worst at {} rpm: reading at {}, "
                "unbalance at {}."
            ).format(
                show("response.largest", 3, scale=100.0),
                show("response.median", 3, scale=100.0),
                show("response.largest_to_highest", 3, scale=100.0),
                show("response.where.speed_rad_s", decimals=1, scale=RPM),
                found["where"]["sensor"],
                found["where"]["plane"],
            )
        )
    left = sum(map(bool, found["excluded"]))
    if left:
        said.append(Markup("{} speeds near critical speeds are left out of these numbers.").format(left))
    drawings = () if response is None else (running_picture(response),)
    return Part("Unbalance response beside the full rotor's", tuple(said), drawings=drawings)


def stability_part(document: Mapping[str, Any], show: Numbers, stability: StabilityCost | None) -> Part:
    """Stability of both models over speed; where nothing damps, there is nothing to draw."""
    from markupsafe import Markup

    found = document["stability"]
    heading = "Stability"
    span = Markup("From {} to {} rpm").format(
        show("stability.full.lowest_rad_s", decimals=1, scale=RPM),
        show("stability.full.highest_rad_s", decimals=1, scale=RPM),
    )
    decrements = [v for which in ("full", "small") for v in found[f"{which}_log_decrement"] if v is not None]
    if decrements and max(map(abs, decrements)) < UNDAMPED:
        return Part(heading, (span + " no damping acts on either model: no motion grows, and none decays.",))
    rows: list[tuple[str, ...]] = [
        ("status", *(_status(found[which]["status"]) for which in ("full", "small")))
    ]
    for words, key, digits in (
        ("threshold, rpm", "threshold_rpm", 6),
        ("threshold, rad/s", "threshold_rad_s", 6),
        ("whirl frequency there, rad/s", "frequency_rad_s", 6),
        ("whirl by running speed", "whirl_ratio", 4),
        ("smallest logarithmic decrement", "smallest_log_decrement", 3),
    ):
        rows.append((words, *(show(f"stability.{which}.{key}", digits) for which in ("full", "small"))))
    rows.append(("direction", *(found[which]["direction"] or NOTHING for which in ("full", "small"))))
    said = []
    if found["relative_difference_of_threshold"] is not None:
        said.append(
            Markup("The small model loses stability {} % away from the speed of the full rotor.").format(
                show("stability.relative_difference_of_threshold", 3, scale=100.0, sign=True)
            )
        )
    heads = ("", "full rotor", "small model")
    drawings = () if stability is None else (stability_picture(stability),)
    return Part(heading, tuple(said), (Grid(span, heads, tuple(rows), (0,)),), drawings)


def _status(word: str) -> str:
    return {"threshold": "unstable above"}.get(word, word)
