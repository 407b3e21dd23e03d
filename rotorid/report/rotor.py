"""The page of a command on a rotor: its sentences, tables and pictures, and what the rotor is."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rotorid.base.tables import Table
from rotorid.report.number_tables import Part, every_warning
from rotorid.report.page import inline_svg, render_report
from rotorid.report.rotor_description import rotor_sheet
from rotorid.report.rotor_figures import LETTERS, WIDTH, Drawing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ABREAST = 9
"""Columns of a table that stand side by side."""


def rotor_page(
    document: Mapping[str, Any],
    provenance: Mapping[str, Any],
    *,
    title: str,
    sentences: Sequence[str],
    notes: Sequence[str],
    tables: tuple[Sequence[Table], Sequence[Table]],
    pictures: Mapping[str, Callable[[], Figure]],
    rotor: Mapping[str, Any],
) -> bytes:
    """Make the page, HTML in UTF-8.

    Parameters
    ----------
    document
        What `--json` prints, without the provenance.
    provenance
        Program version, input files, date and options.
    title
        Of the page.
    sentences, notes
        The answer, and what a reader must know besides the warnings of the document.
    tables, pictures
        Those of the answer and the further ones; what draws each picture, by its caption.
    rotor
        What `rotor_sheet` takes; empty for a model that cannot be drawn.
    """
    first, others = tables
    drawings = tuple(_drawing(draw, caption) for caption, draw in pictures.items())
    return render_report(
        "parts.html",
        document,
        title=title,
        warnings=[*every_warning(document), *notes],
        provenance=provenance,
        sentences=sentences,
        about=[("Rotor file", str(entry["file"])) for entry in provenance["inputs"][:1]],
        rotor=rotor_sheet(**rotor) if rotor else None,
        parts=[
            Part("Result", (), tuple(first), drawings),
            *(Part("" if k else "Behind it", (), _narrow(table)) for k, table in enumerate(others)),
        ],
    )


def _drawing(draw: Callable[[], Figure], caption: str) -> Drawing:
    """A picture as wide as a telephone."""
    import matplotlib as mpl

    with mpl.rc_context({"font.size": LETTERS, "hatch.linewidth": 0.6}):
        figure = draw()
        wide, high = figure.get_size_inches()
        figure.set_size_inches(WIDTH, high * min(1.0, WIDTH / wide))
        return Drawing(inline_svg(figure, caption), caption)


def _narrow(table: Table) -> tuple[Table, ...]:
    """The table, or several that repeat its first two columns."""
    first, others = table.columns[:2], table.columns[2:]
    step = ABREAST - 2
    return tuple(
        Table(table.name, (*first, *others[k : k + step]), table.note)
        for k in range(0, max(len(others), 1), step)
    )
