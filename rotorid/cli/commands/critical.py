"""`rotorid critical`: critical speeds and mode shapes."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorid.cli.common import (
    JsonOption,
    OperatingOption,
    OutputOption,
    PlotOption,
    ReportOption,
    RotorArgument,
    band,
    check_targets,
    emit,
    picture,
    separation,
    separation_text,
)
from rotorid.cli.progress import busy
from rotorid.cli.verbose import note_rotor

if TYPE_CHECKING:
    from fem import Rotor, SpeedMap


def critical(
    rotor: RotorArgument,
    n: Annotated[
        int | None,
        typer.Option(
            "-n",
            "--number",
            min=1,
            help="How many critical speeds, by default 3; rigid-body motions come besides.",
        ),
    ] = None,
    mesh_check: Annotated[
        bool, typer.Option("--mesh-check", help="Estimate by refinement how far off the mesh makes each.")
    ] = False,
    speed_map: Annotated[
        bool,
        typer.Option("--map", help="Critical speeds over the stiffness of the bearings; --plot draws it."),
    ] = False,
    operating: OperatingOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
    report: ReportOption = None,
) -> None:
    """Critical speeds with their whirl directions, and mode shapes, of the rotor without damping.

    Damping and cross-coupling that does work are left out; `rotorid campbell` has them.

    Example: rotorid critical sample_data/rotor23.csv -n 3 --plot modes.png

    Example: rotorid critical sample_data/compressor/rotor.toml -n 4 --map --plot map.png
    """
    import fem
    from fem.plots import draw_speed_map
    from rotorid.tables import read_rotor, rotor_files

    check_targets(plot, output, report=report)
    service = band(operating)
    model = read_rotor(rotor)
    with busy("critical speeds"):
        modes = fem.critical_speeds(model, n)
        n = n or sum(frequency > 0 for frequency in modes.frequencies.tolist()) or 1
        mesh = fem.mesh_check(model, n) if mesh_check else None
        chart, left_out = _map(model, n) if speed_map else (None, [])

    modes = dataclasses.replace(modes, warnings=(*modes.warnings, *left_out))
    document: dict[str, Any] = modes.to_dict()
    inside = None if service is None else separation(modes.frequencies.tolist(), service)
    if inside is not None:
        document["operating"] = inside
    if mesh is not None:
        document["mesh_check"] = mesh.to_dict()
    if chart is not None:
        document["map"] = chart.to_dict()
    parts = [part for part in (mesh, chart) if part is not None]

    def draw(ax: Any) -> object:  # noqa: ANN401
        if chart is None:
            return modes.plot(ax)
        return draw_speed_map(chart.stiffness, chart.speeds, ax, supports=chart.own, operating=service)

    def sheet(document: dict[str, Any], record: dict[str, Any]) -> bytes:
        from rotorid.report.rotor import critical_report

        return critical_report(document, modes, provenance=record, chart=chart, operating=service)

    note_rotor(model)
    emit(
        document,
        lambda: "\n\n".join(
            [
                modes.summary(),
                *([] if inside is None else [separation_text(inside)]),
                *(part.summary() for part in parts),
            ]
        ),
        as_json=json,
        files=rotor_files(rotor),
        options={"number": n, "mesh_check": mesh_check, "map": speed_map, "operating": operating},
        figure=(plot, picture(draw, 10.0, 6.0 if chart else 5.0)),
        table=(output, modes.to_frame if chart is None else chart.to_frame),
        report=(report, sheet),
    )


def _map(model: Rotor, n: int) -> tuple[SpeedMap, list[str]]:
    """The map of the bearings, two decades around the stiffness they have, and what it leaves out.

    What a seal adds is not known when the stiffness of the bearings is chosen: seals are left out.
    """
    import numpy as np

    import fem

    bearings = [support for support in model.supports if support.kind == "bearing"]
    own = np.concatenate(
        [np.zeros(1), *(b.at(b.speeds or 0.0)[0][..., [0, 1], [0, 1]].ravel() for b in bearings)]
    )
    own = own[own > 0]
    stiffness = np.geomspace(own.min() / 100, own.max() * 100, 49) if own.size else None
    chart = fem.speed_map(dataclasses.replace(model, supports=bearings), stiffness, n)
    met = {item.support for item in chart.intersections}
    said = []
    for i, support in enumerate(model.supports, start=1):
        name = repr(support.name) if support.name else f"{i} at node {support.node}"
        if support.kind == "seal":
            said.append(f"map: seal {name} is left out, its stiffness is that of no bearing")
        elif support.pedestal is not None:
            said.append(
                f"map: bearing {name} stands on the ground there; of its pedestal the stiffness counts in "
                "the bearing's own line, mass and damping are left out"
            )
    for i, bearing in enumerate(bearings, start=1):
        if (bearing.name or f"support {i}") not in met:
            said.append(
                f"map: no critical speed meets the stiffness of bearing {bearing.name or i!r}: it has "
                "none, or its table ends before"
            )
    return chart, said
