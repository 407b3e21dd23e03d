"""`rotorid response`: vibration of a rotor model under a given unbalance."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from rotorid.cli.common import (
    JsonOption,
    OperatingOption,
    OutputOption,
    PlotOption,
    RotorArgument,
    band,
    check_targets,
    emit,
    picture,
    speeds,
)
from rotorid.cli.common import sensors as parse_sensors
from rotorid.cli.progress import busy

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fem import Peaks, Response, Rotor
    from fem.sensors import SensorLike


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
) -> None:
    """Vibration under unbalance: readings, orbits, bearing forces, and the peaks after API 684.

    Example: rotorid response sample_data/compressor/rotor.toml
    --unbalance sample_data/compressor/unbalance.csv --speeds 1000:15000:20rpm
    --sensors "probe DE:45,probe NDE:45" --operating 5300:6500rpm --plot bode.png
    """
    import fem
    from rotorid.tables import read_rotor, read_unbalance, rotor_files

    check_targets(plot, output)
    model = read_rotor(rotor)
    service = band(operating)
    places = _places(model, sensors)
    omega = sorted(set(speeds(speed)))
    mounted = read_unbalance(unbalance, model)
    with busy(f"response at {len(omega)} speeds"):
        result = fem.unbalance_response(model, mounted, omega)
    Z = np.stack([result.at(place) for place in places], axis=1)
    labels = [str(fem.sensors.label(place)) for place in places]
    with busy("peaks"):
        peaks = _peaks(result, places, Z, service)
    drawn = {
        View.BODE: lambda: _bode(result, Z, labels, peaks, service),
        View.POLAR: lambda: _polar(result, Z, labels),
        View.ORBITS: picture(lambda ax: _orbits(result, places, at, Z, ax), 7.5, 7.0),
    }
    if at is not None:
        _index(result, at)
    emit(
        _document(result, places, labels, peaks),
        lambda: _summary(result, Z, labels, peaks),
        as_json=json,
        files=[*rotor_files(rotor), unbalance],
        options={"speeds": speed, "sensors": sensors, "operating": operating},
        figure=(plot, drawn[view]),
        table=(output, lambda: _frame(result, Z, labels)),
    )


def _places(rotor: Rotor, sensors: str | None) -> list[SensorLike]:
    """Where to read the vibration, checked."""
    if sensors is not None:
        from fem.sensors import as_sensor

        places: list[SensorLike] = [*parse_sensors(sensors)]
        for place in places:
            as_sensor(place, rotor)
        return places
    nodes = dict.fromkeys(support.node for support in rotor.supports)
    return [*rotor.stations] or [*nodes] or [*range(1, rotor.n_nodes + 1)]


def _peaks(
    result: Response,
    places: list[SensorLike],
    Z: np.ndarray[Any, Any],
    operating: tuple[float, float] | None,
) -> list[Peaks]:
    """Peaks of each reading, with more speeds around each, so that the steps asked for do not matter."""
    import fem

    omega = result.speeds
    if omega.size < 3:
        return []
    for _ in range(2):
        size = np.abs(Z)
        summits = np.flatnonzero(((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])).any(axis=1)) + 1
        if not summits.size:
            break
        closer = [np.linspace(omega[k - 1], omega[k + 1], 41) for k in summits]
        omega = np.unique(np.concatenate([omega, *closer]))
        # speeds that differ by rounding alone would make summits of rounding
        omega = omega[np.diff(omega, prepend=-np.inf) > 1e-7 * omega]
        finer = fem.unbalance_response(result.rotor, result.unbalance, omega)
        Z = np.stack([finer.at(place) for place in places], axis=1)
    return [fem.find_peaks(omega, np.abs(reading), operating=operating) for reading in Z.T]


def _orbit_data(result: Response, places: list[SensorLike]) -> dict[str, Any]:
    """Ellipses of the sensors' nodes, one list over speed for each sensor."""
    import fem
    from fem.sensors import as_sensor

    nodes = [result.rotor.node(as_sensor(place, result.rotor).node) for place in places]
    index = [node - 1 for node in nodes]
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
    result: Response, places: list[SensorLike], labels: list[str], peaks: list[Peaks]
) -> dict[str, Any]:
    document = result.to_dict(places)
    warnings = document.pop("warnings")
    return {
        **document,
        "orbits": _orbit_data(result, places),
        "bearing_forces": result.bearing_forces().to_dict(),
        "peaks": [
            {"sensor": label, **peak}
            for label, found in zip(labels, peaks, strict=False)
            for peak in found.to_dict()["peaks"]
        ],
        "warnings": warnings,
    }


def _summary(result: Response, Z: np.ndarray[Any, Any], labels: list[str], peaks: list[Peaks]) -> str:
    lines = [result.summary(), "", f"{'sensor':>20}{'largest, µm':>14}{'at rpm':>10}"]
    for k, label in enumerate(labels):
        size = np.abs(Z[:, k])
        i = int(np.argmax(size))
        lines.append(f"{label:>20}{1e6 * size[i]:14.4g}{result.speeds[i] * 30 / np.pi:10.0f}")
    if result.rotor.supports:
        lines += ["", result.bearing_forces().summary()]
    for label, found in zip(labels, peaks, strict=False):
        lines += ["", f"peaks at {label}", found.summary()]
    return "\n".join(lines)


def _frame(result: Response, Z: np.ndarray[Any, Any], labels: list[str]) -> pd.DataFrame:
    """One row per speed and sensor."""
    import pandas as pd

    from fem.response import phase_degrees

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
        loudest = int(np.argmax(np.abs(Z).max(axis=0)))
        for peak in peaks[loudest].peaks:
            factor = "" if peak.amplification is None else f", AF {peak.amplification:.1f}"
            marks.append((peak.speed, f"{peak.speed * 30 / np.pi:.0f} rpm{factor}"))
    draw_bode(result.speeds, Z, labels, (above, below), peaks=marks, operating=operating)
    return figure


def _polar(result: Response, Z: np.ndarray[Any, Any], labels: list[str]) -> Figure:
    from matplotlib.figure import Figure

    from fem.plots import draw_polar

    figure = Figure(figsize=(7.5, 7.5), layout="constrained")
    draw_polar(result.speeds, Z, labels, figure.add_subplot(projection="polar"))
    return figure


def _orbits(
    result: Response,
    places: list[SensorLike],
    at: str | None,
    Z: np.ndarray[Any, Any],
    ax: Any,  # noqa: ANN401
) -> object:
    from fem.plots import draw_orbits
    from fem.sensors import as_sensor

    k = _index(result, at) if at is not None else int(np.argmax(np.abs(Z).max(axis=1)))
    names = list(dict.fromkeys(as_sensor(place, result.rotor).node for place in places))
    index = [result.rotor.node(name) - 1 for name in names]
    labels = [f"node {name}" if isinstance(name, int) else name for name in names]
    title = f"{result.speeds[k] * 30 / np.pi:.0f} rpm = {result.speeds[k]:.5g} rad/s"
    return draw_orbits(result.x[k, index], result.y[k, index], labels, ax, title=title)


def _index(result: Response, at: str) -> int:
    """The speed nearest to one asked for, which must lie among them."""
    wanted = speeds(at)
    if len(wanted) != 1:
        raise ValueError(f"--at takes one speed, such as 9000rpm; got {at!r}")
    low, high = result.speeds[0], result.speeds[-1]
    if not low * (1 - 1e-9) <= wanted[0] <= high * (1 + 1e-9):
        raise ValueError(f"--at {at}: the response was asked for from {low:.6g} to {high:.6g} rad/s only")
    return int(np.argmin(np.abs(result.speeds - wanted[0])))
