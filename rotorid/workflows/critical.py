"""`critical`: critical speeds with their whirl directions, and mode shapes, of a rotor without damping."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.tables import Table, file_bytes, frame
from rotorid.base.text import listing
from rotorid.workflows.input_checks import rotor_source
from rotorid.workflows.option_values import Band, band
from rotorid.workflows.result_provenance import Parts, log_rotor, phase, provenance, workflow

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fem import MeshCheck, Modes, Rotor, SpeedMap
    from rotorid.base.arrays import FloatArray


@dataclass(frozen=True)
class CriticalOptions:
    """Options of `critical`.

    Attributes
    ----------
    number : N
        How many critical speeds, by default 3; rigid-body motions come besides.
    mesh_check
        Estimate by refinement how far off the mesh makes each.
    speed_map
        Critical speeds over the stiffness of the bearings, too; the picture is of them then.
    operating : A:B
        Operating speeds, such as 5300:6500rpm.
    """

    number: int | None = None
    mesh_check: bool = False
    speed_map: bool = False
    operating: Band | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class CriticalSpeeds(Parts):
    """Modes, what was asked for beside them, and whether there may be more above the last one."""

    modes: Modes
    mesh: MeshCheck | None
    chart: SpeedMap | None
    operating: tuple[float, float] | None
    more: bool

    @property
    def parts(self) -> Mapping[str, Any]:
        """The modes, and what was asked for beside them."""
        from fem.api684_separation import Separation, unsearched

        speeds = self.modes.frequencies.tolist()
        doubt = unsearched(0.0, max(speeds, default=0.0), self.operating) if self.more else ""
        apart = self.operating and Separation(speeds, self.operating, doubt and f"{doubt} (-n)")
        return {"": self.modes, "operating": apart, "mesh_check": self.mesh, "map": self.chart}

    def tables(self) -> tuple[Table, ...]:
        """The critical speeds and the shapes; and those of the map."""
        return (*self.modes.tables(), *(self.chart.tables() if self.chart else ()))

    def to_frame(self) -> pd.DataFrame:
        """The modes, or the map."""
        return frame(self._main)

    def table_file(self, path: Path) -> bytes:
        """The modes, or the map, as `.csv` or `.xlsx`."""
        return file_bytes(path, self._main)

    @property
    def _main(self) -> Table:
        """The shapes, or the map."""
        return self.modes.tables()[1] if self.chart is None else self.chart.tables()[0]

    def figure(self) -> Figure:
        """The mode shapes, or the map."""
        from fem.plots import draw_modes, draw_speed_map
        from rotorid.base.plot_style import on_figure

        if self.chart is None:
            return on_figure(lambda ax: draw_modes(self.modes, ax))
        chart = self.chart
        return on_figure(lambda ax: draw_speed_map(chart, ax, self.operating), height=5.0)

    def sheet(self) -> bytes:
        """To print: one HTML file."""
        from rotorid.report.rotor import critical_report

        return critical_report(
            self.to_dict(),
            self.modes,
            provenance=self.provenance,
            chart=self.chart,
            operating=self.operating,
        )


@workflow
def critical(rotor: Rotor | Path | str, options: CriticalOptions | None = None) -> CriticalSpeeds:
    """Compute critical speeds with their whirl directions, and mode shapes, of the rotor without damping.

    Parameters
    ----------
    rotor
        A rotor, a rotor table or a rotor file.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be.
    """
    import fem
    from fem.critical import critical_speeds_near
    from fem.parameter_bands import band as error_band

    options = options or CriticalOptions()
    operating = band(options.operating)
    model, files = rotor_source(rotor)
    with phase("critical speeds"):
        modes = fem.critical_speeds(model, options.number)
        n = options.number or sum(frequency > 0 for frequency in modes.frequencies.tolist()) or 1
        mesh = fem.mesh_check(model, n) if options.mesh_check else None
        chart, left_out = _map(model, n) if options.speed_map else (None, [])

    def speeds(other: Rotor) -> FloatArray:
        found = modes.frequencies
        return found if other is model else critical_speeds_near(other, found)

    std, said = error_band(model, "the critical speeds", speeds)
    left_out += _stubby(model, modes)
    log_rotor(model)
    return CriticalSpeeds(
        modes=dataclasses.replace(modes, std=std, warnings=(*modes.warnings, *left_out, *said)),
        mesh=mesh,
        chart=chart,
        operating=operating,
        more=int((modes.frequencies > 0).sum()) >= (options.number or 3),
        provenance=provenance(files, options),
    )


def _stubby(model: Rotor, modes: Modes) -> list[str]:
    """What shear and rotary inertia of the shaft, where left out, would change by more than 1 %."""
    import fem

    missing = [key for key in ("shear", "rotary_inertia") if not getattr(model.model, key)]
    counted_in = dataclasses.replace(model.model, **dict.fromkeys(missing, True))
    discs = model.discs
    if "rotary_inertia" in missing:  # of discs it has a warning of its own
        discs = tuple(dataclasses.replace(disc, diametral_inertia=0.0) for disc in discs)
    with suppress(ValueError):  # none is left in the bearing tables
        other = dataclasses.replace(model, model=counted_in, discs=discs)
        full = fem.critical_speeds(other, modes.frequencies.size) if missing else modes
        high, low = (each.frequencies[each.frequencies > 0] for each in (modes, full))
        first = 1 + modes.frequencies.size - high.size
        excess = [(k, 100 * (f / g - 1)) for k, (f, g) in enumerate(zip(high, low, strict=False), first)]
        large = [f"mode {k} by {percent:.1f} %" for k, percent in excess if percent > 1]
        if large:
            keys = ", ".join(f"{key} = true" for key in missing)
            return [f"these speeds are too high, {listing(large, 'and')}: [model] {keys} in a rotor file"]
    return []


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
    return chart, said
