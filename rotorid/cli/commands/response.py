"""`rotorid response`: vibration of a rotor model under a given unbalance."""

from __future__ import annotations

import dataclasses
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from rotorid.base.arrays import FloatArray
from rotorid.base.text import counted
from rotorid.base.units import RPM
from rotorid.cli.commands.refine import refine, response_from_rest, settle
from rotorid.cli.common import (
    JsonOption,
    OperatingOption,
    OutputOption,
    PlotOption,
    ReportOption,
    RotorArgument,
    emit,
    picture,
)
from rotorid.cli.output import check_targets
from rotorid.cli.progress import busy
from rotorid.cli.verbose import note_rotor
from rotorid.workflows.parameters import (
    band,
    one_speed,
    rising_speeds,
)
from rotorid.workflows.parameters import sensors as parse_sensors

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fem import Peaks, Response, Rotor
    from fem.model.sensors import SensorLike


class View(StrEnum):
    """What the picture shows."""

    BODE = "bode"
    POLAR = "polar"
    ORBITS = "orbits"


def response(
    rotor: RotorArgument,
    unbalance: Annotated[
        Path,
        typer.Option(
            metavar="FILE", help="Table: plane, unbalance_g_mm (or mass_g and radius_mm), angle_deg."
        ),
    ],
    speed: Annotated[
        str,
        typer.Option("--speeds", help="FIRST:LAST:STEP or a list, rad/s; or with a unit: 500:15000:20rpm."),
    ],
    sensors: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Nodes or stations with angles from x in degrees, 2:45,22:45; default: all stations, or "
            "else all supports, in x.",
            show_default=False,
        ),
    ] = None,
    operating: OperatingOption = None,
    view: Annotated[View, typer.Option(help="What --plot draws.")] = View.BODE,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="SPEED", help="Speed of the orbits; default: at the largest reading.", show_default=False
        ),
    ] = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
    report: ReportOption = None,
) -> None:
    """Vibration under unbalance: readings, orbits, bearing forces, and the peaks after API 684.

    Example: rotorid response sample_data/compressor/rotor.toml
    --unbalance sample_data/compressor/unbalance.csv --speeds 1000:15000:20rpm
    --sensors "probe DE:45,probe NDE:45" --operating 5300:6500rpm --plot bode.png
    """
    import fem
    from fem.model.sensors import as_sensor, label
    from fem.response import judged
    from rotorid.tables import read_rotor, read_unbalance, rotor_files

    check_targets(plot, output, report=report)
    model = read_rotor(rotor)
    service = band(operating)
    places = _places(model, sensors)
    omega = rising_speeds(speed)
    mounted = read_unbalance(unbalance, model)
    nodes = dict.fromkeys(model.node(as_sensor(place, model).node) for place in places)
    nodes |= dict.fromkeys(support.node for support in model.supports)
    with busy(f"response at {counted(len(omega), 'speed')}"):
        result = response_from_rest(model, mounted, omega, [*nodes])
    labels = [str(label(place)) for place in places]
    finer, peaks = result, []
    if np.count_nonzero(result.speeds) >= 3:  # rest is no part of a peak
        with busy("peaks"):
            finer = judged(refine(result, places))
            peaks = [fem.response_peaks(finer, place, operating=service) for place in places]
            finer = settle(finer, peaks, result.speeds)
            result = dataclasses.replace(result, windows=finer.windows, warnings=finer.warnings)
    if any(peak.undamped for found in peaks for peak in found.peaks):
        text = "practically undamped peaks: what is largest beside them depends on the speeds asked for"
        result, finer = (dataclasses.replace(r, warnings=(*r.warnings, text)) for r in (result, finer))
    Z = np.stack([finer.at(place) for place in places], axis=1)
    drawn = {
        View.BODE: lambda: _bode(finer, Z, labels, peaks, service),
        View.POLAR: lambda: _polar(finer, Z, labels),
        View.ORBITS: picture(lambda ax: _orbits(finer, places, at, Z, ax), 7.5, 7.0),
    }
    if at is not None:
        _index(result, at)

    def sheet(document: dict[str, Any], record: dict[str, Any]) -> bytes:
        from rotorid.report.rotor import response_report

        return response_report(document, finer, places, peaks, provenance=record, operating=service)

    note_rotor(model, speeds=len(omega))
    emit(
        _document(result, finer, places, labels, peaks),
        lambda: _summary(result, finer, Z, labels, peaks),
        as_json=json,
        files=[*rotor_files(rotor), unbalance],
        options={"speeds": speed, "sensors": sensors, "operating": operating},
        figure=(plot, drawn[view]),
        table=(output, lambda: _frame(result, places, labels)),
        report=(report, sheet),
    )


def _places(rotor: Rotor, sensors: str | None) -> list[SensorLike]:
    """Where to read the vibration, checked."""
    if sensors is not None:
        from fem.model.sensors import as_sensor

        places: list[SensorLike] = [*parse_sensors(sensors)]
        for place in places:
            as_sensor(place, rotor)
        return places
    nodes = dict.fromkeys(support.node for support in rotor.supports)
    return [*rotor.stations] or [*nodes] or [*range(1, rotor.n_nodes + 1)]


def _orbit_data(result: Response, places: list[SensorLike]) -> dict[str, Any]:
    """Ellipses of the sensors' nodes, one list over speed for each sensor."""
    import fem
    from fem.model.sensors import as_sensor

    nodes = [result.rotor.node(as_sensor(place, result.rotor).node) for place in places]
    index = [result.column(node) for node in nodes]
    ellipses = fem.orbits(result.x[:, index], result.y[:, index])
    names = {1: "forward", -1: "backward", 0: "straight"}
    return {
        "nodes": nodes,
        "major_axis_m": ellipses.major.T.tolist(),
        "minor_axis_m": ellipses.minor.T.tolist(),
        "inclination_deg": np.degrees(ellipses.inclination).T.tolist(),
        "direction": [[names[int(way)] for way in row] for row in ellipses.direction.T],
    }


def _document(
    result: Response, finer: Response, places: list[SensorLike], labels: list[str], peaks: list[Peaks]
) -> dict[str, Any]:
    """At the speeds asked for; what is largest, and the peaks, with the speeds between them."""
    document = result.to_dict(places)
    warnings = document.pop("warnings")
    forces = finer.bearing_forces().largest.T
    at_sensor = [_largest(finer, np.abs(finer.at(place))) for place in places]
    at_support = [_largest(finer, force) for force in forces]
    return {
        **document,
        "orbits": _orbit_data(result, places),
        "largest": [
            {"sensor": name, "amplitude_m": size, "speed_rad_s": speed}
            for name, (size, speed) in zip(labels, at_sensor, strict=True)
        ],
        "bearing_forces": {
            **result.bearing_forces().to_dict(),
            "largest_N": [size for size, _ in at_support],
            "largest_at_rad_s": [speed for _, speed in at_support],
        },
        "peaks": [
            {"sensor": label, **peak}
            for label, found in zip(labels, peaks, strict=False)
            for peak in found.to_dict()["peaks"]
        ],
        "warnings": warnings,
    }


def _largest(result: Response, size: FloatArray) -> tuple[float | None, float | None]:
    """The largest of a size over speed where a steady response exists, and its speed, rad/s."""
    from fem.vibration import largest_at

    k = largest_at(size, result.steady)
    return (None, None) if k is None else (float(size[k]), float(result.speeds[k]))


def _summary(
    result: Response, finer: Response, Z: np.ndarray[Any, Any], labels: list[str], peaks: list[Peaks]
) -> str:
    # How many speeds were asked for, and what is largest with those between.
    lines = [
        *result.summary().splitlines()[:1],
        *finer.summary().splitlines()[1:],
        "",
        f"{'sensor':>20} {'largest, µm':>14} {'at rpm':>11}",
    ]
    for k, label in enumerate(labels):
        size, speed = _largest(finer, np.abs(Z[:, k]))
        if size is None or speed is None:
            lines.append(f"{label:>20} {'none':>14} {'-':>11}")
        else:
            lines.append(f"{label:>20} {1e6 * size:14.4g} {speed * RPM:11.1f}")
    if result.rotor.supports:
        lines += ["", finer.bearing_forces().summary()]
    for label, found in zip(labels, peaks, strict=False):
        lines += ["", f"peaks at {label}", found.summary("µm", 1e6)]
    return "\n".join(lines)


def _frame(result: Response, places: list[SensorLike], labels: list[str]) -> pd.DataFrame:
    """One row per speed and sensor."""
    import pandas as pd

    from fem.response import phase_degrees

    Z = np.stack([result.at(place) for place in places], axis=1)
    S, C = Z.shape
    return pd.DataFrame(
        {
            "speed_rad_s": np.repeat(result.speeds, C),
            "sensor": labels * S,
            "amplitude_m": np.abs(Z).ravel(),
            "phase_deg": phase_degrees(Z).ravel(),
        }
    )


def _bode(
    result: Response,
    Z: np.ndarray[Any, Any],
    labels: list[str],
    peaks: list[Peaks],
    operating: tuple[float, float] | None,
) -> Figure:
    """Amplitude and phase; marked is the sensor with the largest reading."""
    from matplotlib.figure import Figure

    from fem.plots import draw_bode

    figure = Figure(figsize=(10, 7), layout="constrained")
    above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    marks = []
    if peaks:
        loudest = int(np.argmax(np.abs(Z[result.steady]).max(axis=0, initial=0.0)))
        for peak in peaks[loudest].peaks:
            factor = "" if peak.amplification is None else f", AF {peak.amplification:.1f}"
            marks.append((peak.speed, f"{peak.speed * RPM:.0f} rpm{factor}"))
    draw_bode(
        result.speeds, Z, labels, (above, below), peaks=marks, operating=operating, windows=result.windows
    )
    return figure


def _polar(result: Response, Z: np.ndarray[Any, Any], labels: list[str]) -> Figure:
    from matplotlib.figure import Figure

    from fem.plots import draw_polar

    figure = Figure(figsize=(7.5, 7.5), layout="constrained")
    draw_polar(result.speeds, Z, labels, figure.add_subplot(projection="polar"), windows=result.windows)
    return figure


def _orbits(
    result: Response,
    places: list[SensorLike],
    at: str | None,
    Z: np.ndarray[Any, Any],
    ax: Any,  # noqa: ANN401
) -> object:
    from fem.model.sensors import as_sensor
    from fem.plots import draw_orbits
    from fem.vibration import largest_at

    k = largest_at(np.abs(Z).max(axis=1), result.steady) if at is None else _index(result, at)
    if k is None:
        raise ValueError("there is no steady response at any of these speeds, so no orbit to draw")
    names = list(dict.fromkeys(as_sensor(place, result.rotor).node for place in places))
    index = [result.column(name) for name in names]
    labels = [f"node {name}" if isinstance(name, int) else name for name in names]
    title = f"{result.speeds[k] * RPM:.0f} rpm = {result.speeds[k]:.5g} rad/s"
    return draw_orbits(result.x[k, index], result.y[k, index], labels, ax, title=title)


def _index(result: Response, at: str) -> int:
    """The speed nearest to one asked for, which must lie among them."""
    wanted = one_speed(at, "--at")
    low, high = result.speeds[0], result.speeds[-1]
    if not low * (1 - 1e-9) <= wanted <= high * (1 + 1e-9):
        raise ValueError(f"--at {at}: the response was asked for from {low:.6g} to {high:.6g} rad/s only")
    k = int(np.argmin(np.abs(result.speeds - wanted)))
    if not result.steady[k]:
        raise ValueError(f"--at {at}: there is no steady response, so no orbit to draw; take another speed")
    return k
