"""Sheets of `rotorid critical` and `rotorid response`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from fem.model.rotor import Rotor
from rotorid.base.units import RPM, rpm_text
from rotorid.report.grids import Grid, Numbers, Part, evenly, every_warning
from rotorid.report.inputs import place, rotor_sheet, unbalance_table
from rotorid.report.page import render_report
from rotorid.report.pictures import bode_picture, map_picture, modes_picture

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
    """Make the sheet of critical speeds.

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

    Returns
    -------
    bytes
        HTML, UTF-8.
    """
    show = Numbers(document)
    parts = [
        Part(
            "Critical speeds",
            tables=(_criticals(document, show),),
            drawings=(modes_picture(modes),),
        ),
        *_map(document, show, chart, operating),
        Part("Mode shapes", tables=_shapes(document, show)),
    ]
    return render_report(
        "critical.html",
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
) -> bytes:
    """Make the sheet of an unbalance response.

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

    Returns
    -------
    bytes
        HTML, UTF-8.
    """
    show = Numbers(document)
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
            tables=(_largest(document, show), *_peaks(document, show, operating)),
            drawings=(bode_picture(response, places, peaks, operating),),
        ),
        *_forces(document, show, rotor),
        Part("Readings", tables=_readings(document, show)),
    ]
    return render_report(
        "response.html",
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


def _criticals(document: Mapping[str, Any], show: Numbers) -> Grid:
    heads = ["mode", "rpm", "rad/s", "Hz", "whirl"]
    operating, mesh = document.get("operating"), document.get("mesh_check")
    heads += ["from operating range, %"] if operating else []
    heads += ["error of the mesh, %"] if mesh else []
    rows = []
    for k, way in enumerate(document["direction"]):
        row = [
            str(k + 1),
            show(f"critical_speeds_rpm.{k}", decimals=2),
            show(f"critical_speeds_rad_s.{k}", decimals=4),
            show(f"critical_speeds_rad_s.{k}", decimals=4, scale=1 / math.tau),
            way if document["critical_speeds_rad_s"][k] else "rigid body",
        ]
        if operating:
            inside = operating["critical_speeds"][k]["inside"]
            distance = show(f"operating.critical_speeds.{k}.separation_percent", decimals=1)
            row.append("INSIDE" if inside else distance)
        if mesh:
            row.append(show(f"mesh_check.relative_error.{k}", 2, scale=100.0))
        rows.append(tuple(row))
    note = "The distance is in percent of the nearest end of the operating range." if operating else ""
    note = f"{note} {document.get('critical_speeds_cut') or ''}".strip()
    return Grid("Where the frequency of free whirl equals the speed of rotation", tuple(heads), tuple(rows),
                (4,), note)  # fmt: skip


def _map(document: Mapping[str, Any], show: Numbers, chart: SpeedMap | None, operating: Band) -> list[Part]:
    if chart is None:
        return []
    limits = tuple(
        (
            str(k + 1),
            show(f"map.free_rad_s.{k}", decimals=1, scale=RPM),
            show(f"map.pinned_rad_s.{k}", decimals=1, scale=RPM),
        )
        for k in range(len(document["map"]["free_rad_s"]))
    )
    met = tuple(
        (
            item["support"],
            item["direction"],
            str(item["mode"]),
            show(f"map.intersections.{i}.speed_rad_s", decimals=1, scale=RPM),
            show(f"map.intersections.{i}.stiffness_N_per_m", 4, scale=1e-6),
        )
        for i, item in enumerate(document["map"]["intersections"])
    )
    heads = ("support", "direction", "critical speed", "rpm", "stiffness, MN/m")
    tables = [
        Grid("Limits of soft and of stiff supports", ("mode", "free, rpm", "pinned, rpm"), limits),
        Grid("With the stiffness that the supports have", heads, met, (0, 1)),
    ]
    said = "Undamped, every support of the same stiffness in x and y."
    kept = tuple(table for table in tables if table.rows)
    return [Part("Critical speed map", (said,), kept, (map_picture(chart, operating),))]


def _shapes(document: Mapping[str, Any], show: Numbers) -> tuple[Grid, ...]:
    """Deflections at the nodes, some modes abreast."""
    count, tables = len(document["mode_shapes"]), []
    for first in range(0, count, MODES_ABREAST):
        some = range(first, min(first + MODES_ABREAST, count))
        rows = tuple(
            (
                str(i + 1),
                show(f"positions_m.{i}", decimals=4),
                *(show(f"mode_shapes.{k}.{i}", decimals=4) for k in some),
            )
            for i in range(len(document["positions_m"]))
        )
        heads = ("node", "position, m", *(f"mode {k + 1}" for k in some))
        tables.append(Grid("Deflection at the nodes, 1 at node 1 (or the largest 1)", heads, rows))
    return tuple(tables)


def _margins(document: Mapping[str, Any]) -> list[str]:
    """Peaks whose separation from the operating range is not as required, as warnings."""
    return [
        f"peak at {peak['speed_rpm']:.6g} rpm, {peak['sensor']}: {peak['separation_margin_percent']:.1f} % "
        f"from the operating range; API 684 requires {peak['required_margin_percent']:.1f} %"
        for peak in document["peaks"]
        if peak["enough"] is False
    ]


def _largest(document: Mapping[str, Any], show: Numbers) -> Grid:
    rows = tuple(
        (
            item["sensor"] if isinstance(item["sensor"], str) else f"node {item['sensor']}",
            show(f"largest.{k}.amplitude_m", 4, scale=MICRO),
            show(f"largest.{k}.speed_rad_s", decimals=1, scale=RPM),
            show(f"largest.{k}.speed_rad_s", 6),
        )
        for k, item in enumerate(document["largest"])
    )
    return Grid("Largest readings", ("sensor", "amplitude, µm peak", "rpm", "rad/s"), rows, (0,))


def _peaks(document: Mapping[str, Any], show: Numbers, operating: Band) -> tuple[Grid, ...]:
    """Peaks with amplification factors, and with margins where there is a range; nothing without peaks."""
    words = {True: "enough", False: "NOT ENOUGH", None: "–"}
    rows: list[tuple[str, ...]] = []
    notes: dict[str, list[str]] = {}
    for k, peak in enumerate(document["peaks"]):
        key = f"peaks.{k}"
        margin = (
            show(f"{key}.separation_margin_percent", decimals=1),
            show(f"{key}.required_margin_percent", decimals=1),
            words[peak["enough"]],
        )
        rows.append(
            (
                peak["sensor"],
                show(f"{key}.speed_rpm", decimals=1),
                show(f"{key}.amplitude", 4, scale=MICRO),
                show(f"{key}.amplification_factor", decimals=2),
                *(() if operating is None else margin),
            )
        )
        if peak["note"]:
            notes.setdefault(peak["note"], []).append(f"{peak['sensor']} {peak['speed_rpm']:.0f} rpm")
    heads: tuple[str, ...] = ("sensor", "rpm", "amplitude, µm peak", "AF")
    heads += () if operating is None else ("margin, %", "required, %", "margin is")
    said = [f"No AF, for {text}: {', '.join(where)}." for text, where in notes.items()]
    note = " ".join(["AF: amplification factor after API 684.", *said])
    return (Grid("Peaks", heads, tuple(rows), (0, 6), note),) if rows else ()


def _forces(document: Mapping[str, Any], show: Numbers, rotor: Rotor) -> list[Part]:
    rows = tuple(
        (
            support.name or f"support {k + 1}",
            place(rotor, support.node),
            show(f"bearing_forces.largest_N.{k}", 4),
            show(f"bearing_forces.largest_at_rad_s.{k}", decimals=1, scale=RPM),
        )
        for k, support in enumerate(rotor.supports)
    )
    heads = ("support", "node", "largest force, N", "rpm")
    return [Part("Forces on the supports", tables=(Grid("", heads, rows, (0, 1)),))] if rows else []


def _readings(document: Mapping[str, Any], show: Numbers) -> tuple[Grid, ...]:
    """Amplitude and phase at some of the speeds asked for, a few sensors abreast."""
    sensors, count = document["sensors"], len(document["speeds_rad_s"])
    picked = evenly(count, READINGS)
    note = (
        f"{len(picked)} of the {count} speeds asked for; --output writes all." if len(picked) < count else ""
    )
    tables = []
    for first in range(0, len(sensors), ABREAST):
        some = range(first, min(first + ABREAST, len(sensors)))
        heads = ["rpm", *(h for k in some for h in (f"{sensors[k]}: µm peak", "phase, °"))]
        rows = []
        for i in picked:
            row = [show(f"speeds_rad_s.{i}", decimals=1, scale=RPM)]
            for k in some:
                row += [show(f"amplitude_m.{k}.{i}", 4, scale=MICRO), show(f"phase_deg.{k}.{i}", decimals=1)]
            rows.append(tuple(row))
        tables.append(Grid("Amplitude and phase (lead)", tuple(heads), tuple(rows), note=note))
    return tuple(tables)
