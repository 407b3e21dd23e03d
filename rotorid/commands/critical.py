"""`critical`: critical speeds with their whirl directions, and mode shapes, of a rotor without damping."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rotorid.base.text import listing
from rotorid.commands.option_values import Band, band
from rotorid.report.options import rotor_of
from rotorid.report.outcome import Outcome, command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fem import Modes, Rotor, SpeedMap


@dataclass(frozen=True)
class CriticalOptions:
    """Options of `critical`.

    Attributes
    ----------
    number : -n N from 1
        How many critical speeds, by default 3; rigid-body motions come besides.
    mesh_check
        Estimate by refinement how far off the mesh makes each.
    speed_map : --map
        Critical speeds over the stiffness of the bearings, too; the picture is of them then.
    operating : A:B
        Operating speeds, such as 5300:6500rpm.
    """

    number: int | None = None
    mesh_check: bool = False
    speed_map: bool = False
    operating: Band | None = None
    panels: ClassVar[Mapping[str, str]] = {"Method": "speed_map mesh_check"}


@command
def critical(rotor: Rotor | Path | str, options: CriticalOptions | None = None) -> Outcome:
    """Critical speeds with whirl directions, and mode shapes, of the undamped rotor.

    Damping and cross-coupling that does work are left out; `rotorid campbell` has them.

    Example: rotorid critical sample_data/rotor23.csv -n 3 --plot modes.png

    Example: rotorid critical sample_data/compressor/rotor.toml -n 4 --map --plot map.png

    Parameters
    ----------
    rotor : ROTOR
        Rotor table (.csv, .xlsx) or rotor file (.toml).
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be.
    """
    import fem
    from fem.parameters import band as error_band
    from rotorid.commands.operating_range import Separation, unsearched

    options = options or CriticalOptions()
    operating = band(options.operating)
    model = rotor_of(rotor)
    modes = fem.critical_speeds(model, options.number)
    speeds = modes.frequencies
    n = options.number or int((speeds > 0).sum()) or 1
    mesh = fem.mesh_check(model, n) if options.mesh_check else None
    chart, left_out = _map(model, n) if options.speed_map else (None, [])
    std, doubts = error_band(
        model,
        "the critical speeds",
        lambda other: speeds if other is model else fem.critical_speeds_near(other, speeds),
    )
    left_out += _stubby(model, modes)
    modes = dataclasses.replace(modes, std=std, warnings=(*modes.warnings, *left_out, *doubts))
    apart = None
    if operating:
        more = int((speeds > 0).sum()) >= (options.number or 3)
        doubt = unsearched(0.0, max(speeds.tolist(), default=0.0), operating) if more else ""
        apart = Separation(speeds.tolist(), operating, doubt and f"{doubt} (-n)")
    table, shapes = modes.tables()
    beside = {"operating": apart, "mesh_check": mesh, "map": chart}
    asked = {key: result for key, result in beside.items() if result is not None}
    return Outcome(
        result=modes,
        sentences=(modes.sentence(), *(part.sentence() for part in asked.values())),
        tables=(table,),
        more=tuple(one.under(key) for key, part in asked.items() for one in part.tables()[:1]),
        file=chart.tables()[-1] if chart else shapes,
        keys={**modes.to_dict(), **{key: part.to_dict() for key, part in asked.items()}},
        warnings=modes.warnings,
        notes=(modes.cut,) if modes.cut else (),
        pictures=_pictures(modes, chart, operating),
        title="Critical speeds",
    )


def _pictures(
    modes: Modes, chart: SpeedMap | None, operating: tuple[float, float] | None
) -> dict[str, Callable[[], Figure]]:
    """The map, if there is one, and the mode shapes."""
    from fem.plots import draw_modes, draw_speed_map
    from rotorid.base.plot_style import on_figure

    shapes = {
        "Mode shapes, each to its largest value 1, over the rotor.": lambda: on_figure(
            lambda ax: draw_modes(modes, ax)
        )
    }
    if chart is None:
        return shapes
    return {
        "Critical speeds over the stiffness of the supports.": lambda: on_figure(
            lambda ax: draw_speed_map(chart, ax, operating), height=5.0
        ),
        **shapes,
    }


def _stubby(model: Rotor, modes: Modes) -> list[str]:
    """What shear and rotary inertia of the shaft, where left out, would change by more than 1 %."""
    import fem

    missing = [key for key in ("shear", "rotary_inertia") if not getattr(model.model, key)]
    discs = model.discs
    if "rotary_inertia" in missing:  # of discs it has a warning of its own
        discs = tuple(dataclasses.replace(disc, diametral_inertia=0.0) for disc in discs)
    with suppress(ValueError):  # none is left in the bearing tables
        other = dataclasses.replace(
            model, model=dataclasses.replace(model.model, **dict.fromkeys(missing, True)), discs=discs
        )
        full = fem.critical_speeds(other, modes.frequencies.size) if missing else modes
        high, low = (each.frequencies[each.frequencies > 0] for each in (modes, full))
        excess = max((100 * (f / g - 1) for f, g in zip(high, low, strict=False)), default=0.0)
        if excess > 1:
            keys = ", ".join(f"{key} = true" for key in missing)
            return [f"these speeds are too high, by up to {excess:.1f} %: [model] {keys} in a rotor file"]
    return []


def _map(model: Rotor, n: int) -> tuple[SpeedMap, list[str]]:
    """The map of the bearings, two decades around the stiffness they have, and what it leaves out.

    What a seal adds is not known when the stiffness of the bearings is chosen: seals are left out.
    """
    import numpy as np

    import fem

    bearings = [support for support in model.supports if support.kind == "bearing"]
    stiffnesses = np.concatenate(
        [np.zeros(1), *(b.at(b.speeds or 0.0)[0][..., [0, 1], [0, 1]].ravel() for b in bearings)]
    )
    stiffnesses = stiffnesses[stiffnesses > 0]
    stiffness = (
        np.geomspace(stiffnesses.min() / 100, stiffnesses.max() * 100, 49) if stiffnesses.size else None
    )
    chart = fem.speed_map(dataclasses.replace(model, supports=bearings), stiffness, n)
    left_out = {
        "seals": len(bearings) < len(model.supports),
        "pedestals": any(bearing.pedestal for bearing in bearings),
    }
    words = listing((name for name, there in left_out.items() if there), "and")
    return chart, [f"the map leaves out {words}"] if words else []
