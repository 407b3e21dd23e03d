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
        What `rotor_sheet` takes.
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
        rotor=rotor_sheet(**rotor),
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


<<<<<<< HEAD
def _files(provenance: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [("Rotor file", str(entry["file"])) for entry in provenance["inputs"][:1]]


def _operating(operating: Band) -> list[tuple[str, str]]:
    if operating is None:
        return []
    low, high = operating
    return [("Operating", f"{low * RPM:.6g} to {rpm_text(high)} ({low:.6g} to {high:.6g} rad/s)")]


def _inside(document: Mapping[str, Any]) -> list[str]:
    """Critical speeds in the operating range, as warnings."""
    rows = document.get("operating", {}).get("critical_speeds", [])
    return [
        f"critical speed {k}, {row['speed_rad_s'] * RPM:.6g} rpm, lies inside the operating range"
        for k, row in enumerate(rows, start=1)
        if row["inside"]
    ]


def _criticals(document: Document, modes: Modes) -> Table:
    """The critical speeds, with their distance from the operating range and the error of the mesh."""
    speeds, _ = modes.tables()
    columns = [column for column in speeds.columns if column.key or column.heading in ("mode", "whirl")]
    operating, notes = document.get("operating"), []
    if operating:
        rows = operating["critical_speeds"]
        path = "operating.critical_speeds.*.separation_percent"
        distance = [row["separation_percent"] for row in rows]
        columns.append(Column("operating range", ["INSIDE" if row["inside"] else "outside" for row in rows]))
        columns.append(Column("from operating range, %", distance, "{:.1f}".format, path))
        notes.append("The distance is in percent of the nearest end of the operating range.")
    if document.get("mesh_check"):
        errors = [100.0 * error for error in document["mesh_check"]["relative_error"]]
        path = "mesh_check.relative_error.*"
        columns.append(Column("error of the mesh, %", errors, "{:.2g}".format, path, 100.0))
    if document.get("critical_speeds_cut"):
        notes.append(document["critical_speeds_cut"])
    caption = "Where the frequency of free whirl equals the speed of rotation"
    return Table(caption, tuple(columns), " ".join(notes))


def _map(document: Document, chart: SpeedMap | None, operating: Band) -> list[Part]:
    if chart is None:
        return []
    found = document["map"]
    modes = Column("mode", range(1, len(found["free_rad_s"]) + 1))
    limits = [
        Column(
            f"{name}, rpm",
            [None if speed is None else RPM * speed for speed in found[f"{name}_rad_s"]],
            "{:.1f}".format,
            f"map.{name}_rad_s.*",
            RPM,
        )
        for name in ("free", "pinned")
    ]
    table = Table("Limits of soft and of stiff supports", (modes, *limits))
    sentence = "Undamped, every support of the same stiffness in x and y."
    return [Part("Critical speed map", (sentence,), (table,), (map_picture(chart, operating),))]


def _shapes(modes: Modes) -> tuple[Table, ...]:
    """Deflections at the nodes, some modes abreast, each in the scale of the picture."""
    largest = np.abs(smooth_shapes(modes)[1]).max(axis=0)
    _, (node, position, *shapes) = (table.columns for table in modes.tables())
    position = Column("position, m", position.values, "{:.4f}".format, position.key)
    scaled = [
        Column(f"mode {k}", np.array(shape.values) / size, shape.shown, shape.key, 1 / float(size))
        for k, (shape, size) in enumerate(zip(shapes, largest, strict=True), start=1)
    ]
    caption = "Deflection at the nodes, in the scale of the picture: the largest between the ends is 1"
=======
def _narrow(table: Table) -> tuple[Table, ...]:
    """The table, or several that repeat its first two columns."""
    first, others = table.columns[:2], table.columns[2:]
    step = ABREAST - 2
>>>>>>> cmd
    return tuple(
        Table(table.name, (*first, *others[k : k + step]), table.note)
        for k in range(0, max(len(others), 1), step)
    )
