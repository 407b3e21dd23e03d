"""Sheets of `rotorid critical` and `rotorid response`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fem.model.rotor import Rotor
from fem.plots.mode_shapes import smooth_shapes
from rotorid.base.arrays import FloatArray
from rotorid.base.rpm import RPM, rpm_text
from rotorid.base.tables import Column, Table
from rotorid.report.document import NOTHING, Document
from rotorid.report.number_tables import Grid, Part, evenly, every_warning, words
from rotorid.report.page import render_report
from rotorid.report.rotor_description import place, rotor_sheet, unbalance_table
from rotorid.report.rotor_figures import bode_picture, map_picture, modes_picture

if TYPE_CHECKING:
    from fem import Modes, Peaks, Response, SpeedMap
    from fem.model.sensors import SensorLike

MICRO = 1e6
READINGS = 12
"""Speeds of the printed readings."""
ABREAST, MODES_ABREAST = 2, 4
"""Sensors, and modes, that stand side by side in a table."""

Band = tuple[float, float] | None


def critical_report(
    document: Mapping[str, Any],
    modes: Modes,
    *,
    provenance: Mapping[str, Any],
    chart: SpeedMap | None = None,
    operating: Band = None,
) -> bytes:
    """Make the sheet of critical speeds, HTML in UTF-8.

    Parameters
    ----------
    document
        What `rotorid critical --json` prints, without the provenance.
    modes
        The result it is from.
    provenance
        Program version, input files, date and options.
    chart
        The critical speed map, if the document has one.
    operating
        Range of operating speeds, rad/s.
    """
    document = Document(document)
    parts = [
        Part(
            "Critical speeds",
            tables=(_criticals(document, modes),),
            drawings=(modes_picture(modes),),
        ),
        *_map(document, chart, operating),
        Part("Mode shapes", tables=_shapes(modes)),
    ]
    return render_report(
        "parts.html",
        document,
        title="Critical speeds",
        warnings=[*_inside(document), *every_warning(document)],
        provenance=provenance,
        about=[*_files(provenance), *_operating(operating)],
        rotor=rotor_sheet(modes.rotor, conservative=True),
        parts=parts,
    )


def response_report(
    document: Mapping[str, Any],
    response: Response,
    places: Sequence[SensorLike],
    peaks: Sequence[Peaks],
    *,
    provenance: Mapping[str, Any],
    operating: Band = None,
    std: FloatArray | None = None,
) -> bytes:
    """Make the sheet of an unbalance response, HTML in UTF-8.

    Parameters
    ----------
    document
        What `rotorid response --json` prints, without the provenance.
    response
        The response with the speeds between those asked for, as it is drawn.
    places
        Where vibration is read.
    peaks
        Of each place; empty where too few speeds were asked for.
    provenance
        Program version, input files, date and options.
    operating
        Range of operating speeds, rad/s.
    std
        Of the amplitudes, as `bode_figure` takes them.
    """
    document = Document(document)
    rotor = response.rotor
    low, high = document["speeds_rad_s"][0], document["speeds_rad_s"][-1]
    about = [
        *_files(provenance),
        (
            "Speeds",
            f"{len(document['speeds_rad_s'])}, from {low * RPM:.6g} to {rpm_text(high)} "
            f"({low:.6g} to {high:.6g} rad/s)",
        ),
        *_operating(operating),
    ]
    parts = [
        Part("Unbalance", tables=(unbalance_table(rotor, response.unbalance),)),
        Part(
            "Vibration",
            tables=(_largest(document), *_peaks(document, operating)),
            drawings=(bode_picture(response, places, peaks, operating, std),),
        ),
        *_forces(document, rotor),
        Part("Readings", tables=_readings(document)),
    ]
    return render_report(
        "parts.html",
        document,
        title="Unbalance response",
        warnings=[*_margins(document), *every_warning(document)],
        provenance=provenance,
        about=about,
        rotor=rotor_sheet(rotor, planes=sorted(response.unbalance), sensors=places, meaning="unbalance"),
        parts=parts,
    )


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
    return tuple(
        Table(caption, (node, position, *scaled[first : first + MODES_ABREAST]))
        for first in range(0, len(scaled), MODES_ABREAST)
    )


def _margins(document: Mapping[str, Any]) -> list[str]:
    """Peaks whose separation from the operating range is not as required, as warnings."""
    return [
        f"peak at {peak['speed_rpm']:.6g} rpm, {peak['sensor']}: {peak['separation_margin_percent']:.1f} % "
        f"from the operating range; API 684 requires {peak['required_margin_percent']:.1f} %"
        for peak in document["peaks"]
        if peak["enough"] is False
    ]


def _largest(document: Document) -> Grid:
    sensors = [item["sensor"] for item in document["largest"]]
    return Grid(
        "Largest readings",
        (
            words("sensor", (name if isinstance(name, str) else f"node {name}" for name in sensors)),
            document.column("amplitude, µm peak", "largest.*.amplitude_m", 4, scale=MICRO),
            document.column("rpm", "largest.*.speed_rad_s", decimals=1, scale=RPM),
            document.column("rad/s", "largest.*.speed_rad_s"),
        ),
    )


def _peaks(document: Document, operating: Band) -> tuple[Grid, ...]:
    """Peaks with amplification factors, and with margins where there is a range; nothing without peaks."""
    peaks = document["peaks"]
    if not peaks:
        return ()
    columns = [
        words("sensor", (peak["sensor"] for peak in peaks)),
        document.column("rpm", "peaks.*.speed_rpm", decimals=1),
        document.column("amplitude, µm peak", "peaks.*.amplitude", 4, scale=MICRO),
        document.column("AF", "peaks.*.amplification_factor", decimals=2),
    ]
    if operating is not None:
        verdicts = {True: "enough", False: "NOT ENOUGH", None: NOTHING}
        columns += [
            document.column("margin, %", "peaks.*.separation_margin_percent", decimals=1),
            document.column("required, %", "peaks.*.required_margin_percent", decimals=1),
            words("margin is", (verdicts[peak["enough"]] for peak in peaks)),
        ]
    notes: dict[str, list[str]] = {}
    for peak in peaks:
        if peak["note"]:
            notes.setdefault(peak["note"], []).append(f"{peak['sensor']} {peak['speed_rpm']:.0f} rpm")
    said = [f"No AF, for {text}: {', '.join(where)}." for text, where in notes.items()]
    note = " ".join(["AF: amplification factor after API 684.", *said])
    return (Grid("Peaks", tuple(columns), note),)


def _forces(document: Document, rotor: Rotor) -> list[Part]:
    supports = rotor.supports
    if not supports:
        return []
    columns = (
        words("support", (each.name or f"support {k}" for k, each in enumerate(supports, start=1))),
        words("node", (place(rotor, each.node) for each in supports)),
        document.column("largest force, N", "bearing_forces.largest_N.*", 4),
        document.column("rpm", "bearing_forces.largest_at_rad_s.*", decimals=1, scale=RPM),
    )
    return [Part("Forces on the supports", tables=(Grid("", columns),))]


def _readings(document: Document) -> tuple[Grid, ...]:
    """Amplitude and phase at some of the speeds asked for, a few sensors abreast."""
    sensors, count = document["sensors"], len(document["speeds_rad_s"])
    picked = evenly(count, READINGS)
    note = (
        f"{len(picked)} of the {count} speeds asked for; --output writes all." if len(picked) < count else ""
    )
    speeds = document.column("rpm", "speeds_rad_s.*", rows=picked, decimals=1, scale=RPM)
    readings = []
    for k, sensor in enumerate(sensors):
        size = document.column(f"{sensor}: µm peak", f"amplitude_m.{k}.*", 4, rows=picked, scale=MICRO)
        readings += [size, document.column("phase, °", f"phase_deg.{k}.*", rows=picked, decimals=1)]
    return tuple(
        Grid("Amplitude and phase (lead)", (speeds, *readings[first : first + 2 * ABREAST]), note)
        for first in range(0, len(readings), 2 * ABREAST)
    )
