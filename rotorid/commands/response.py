"""`response`: vibration of a rotor model under a given unbalance, bearing forces and peaks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

from rotorid.base.json import cell
from rotorid.base.rpm import RPM, range_text, rpm_text
from rotorid.base.tables import Column, Table
from rotorid.base.text import counted, error_figures, figures, listing
from rotorid.commands.moving import moving
from rotorid.commands.quantities import (
    Band,
    Sensor,
    Speeds,
    band,
    nodes,
    number,
    one_of,
    one_speed,
    rising_speeds,
    sensors,
)
from rotorid.report.options import file_of
from rotorid.report.outcome import Outcome, command, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fem import Peak, Peaks, Response, Rotor, SensorLike, Unbalance
    from rotorid.base.arrays import AnyArray, FloatArray
    from rotorid.reduction import SmallModel

STANDARD_GRAVITY = 9.80665  # m/s²
View = Literal["bode", "polar", "orbits", "shape"]
"""What a picture shows."""
_KEYS = (
    *("speed_rpm", "speed_rad_s", "amplitude", "amplification_factor"),
    *("separation_margin_percent", "required_margin_percent", ""),
)
"""Of the columns of peaks, in the document."""


@dataclass(frozen=True)
class ResponseOptions:
    """Options of `response`.

    Attributes
    ----------
    speeds : SPEEDS
        FIRST:LAST:STEP or a list, rad/s; or with a unit: 500:15000:20rpm.
    sensors : LIST
        Nodes or stations with angles from x in degrees, 2:45,22:45; default: all stations, or else all
        supports, in x.
    operating : A:B
        Operating speeds, such as 5300:6500rpm.
    view
        What --plot draws; shape: the deflected rotor.
    at : SPEED
        Speed of the orbits or of the shape that are drawn, 5800rpm; default: at the largest reading.
    """

    speeds: Speeds
    sensors: str | Sequence[Sensor] | None = None
    operating: Band | None = None
    view: View = "bode"
    at: str | float | None = None
    panels: ClassVar[Mapping[str, str]] = {"Output": "view at"}


@dataclass(frozen=True, eq=False, kw_only=True)
class Vibration:
    """Vibration at the speeds asked for, and the peaks between them.

    Attributes
    ----------
    response, finer
        At the speeds asked for; with speeds between them, around the peaks.
    sensors, peaks
        Where it is read, and the peaks there; none where too few speeds were asked for.
    operating
        Operating range, rad/s.
    std
        Of the amplitudes of `finer` from the rotor's calibration, m, shape (S, C); None without.
    """

    response: Response
    finer: Response
    sensors: Sequence[SensorLike]
    peaks: Sequence[Peaks]
    operating: tuple[float, float] | None
    std: FloatArray | None = None

    def to_dict(self) -> dict[str, Any]:
        """As JSON types: what is largest, and the peaks, with the speeds between."""
        document = self.response.to_dict(self.sensors)
        warnings = document.pop("warnings")
        at_support = self._largest(self.finer.bearing_forces().largest)
        readings = self._largest(self.finer.readings(self.sensors))
        errors = {} if self.std is None else {"amplitude_std_m": cell(self._asked(self.std).T)}
        limit = self.limit()
        return {
            **document,
            **errors,
            "orbits": self._orbits(),
            "largest": [
                {"sensor": name, "amplitude_m": size, "speed_rad_s": speed} | std
                for name, (size, speed), std in zip(
                    self.labels, readings, self._std_of(readings), strict=True
                )
            ],
            "bearing_forces": {
                **self.response.bearing_forces().to_dict(),
                "largest_N": [size for size, _ in at_support],
                "largest_at_rad_s": [speed for _, speed in at_support],
            },
            "peaks": [
                {"sensor": name, **peak}
                for name, each in zip(self.labels, self.peaks, strict=False)
                for peak in each.to_dict()["peaks"]
            ],
            **({"vibration_limit": limit} if limit else {}),
            "warnings": warnings,
        }

    def sentences(self, chief: Sequence[Peak]) -> list[str]:
        """Whether it runs steadily, whether the margins are as required, what is largest, and the limit."""
        first, limit = [*self._judgement(chief).splitlines(), self.finer.highest], self.limit()
        if not limit:
            return first
        largest, allowed = (1e6 * limit[key] for key in ("largest_peak_to_peak_m", "allowed_peak_to_peak_m"))
        return [
            *first,
            f"In the operating range readings reach {figures(largest)} µm peak-to-peak; API 617 allows "
            f"{allowed:.3g} µm peak-to-peak at {rpm_text(limit['speed_rad_s'])}.",
        ]

    def limit(self) -> dict[str, float]:
        """The largest reading in the operating range beside the limit of API 617; empty without either."""
        import numpy as np

        import fem

        low, high = self.operating or (np.inf, np.inf)
        there = self.finer.steady & (self.finer.speeds >= low) & (self.finer.speeds <= high)
        if not there.any():
            return {}
        largest = 2 * float(np.abs(self.finer.readings(self.sensors)[there]).max())
        allowed = fem.api617_limit(high)
        return {
            "speed_rad_s": high,
            "allowed_peak_to_peak_m": allowed,
            "largest_peak_to_peak_m": largest,
        }

    def named(self) -> list[tuple[str, Peak]]:
        """All peaks, each with its sensor."""
        pairs = zip(self.labels, self.peaks, strict=False)
        return [(name, peak) for name, peaks in pairs for peak in peaks.peaks]

    def largest(self) -> Table:
        """The largest reading of each sensor."""
        where = self._largest(self.finer.readings(self.sensors))
        sizes = [None if size is None else 1e6 * size for size, _ in where]
        key = "amplitude_std_m"
        stds = [1e6 * std[key] for std in self._std_of(where) if std]
        columns = (
            Column("sensor", self.labels),
            Column("largest reading, µm peak", sizes, figures, "largest.*.amplitude_m", 1e6),
            *([Column("±", stds, error_figures, f"largest.*.{key}", 1e6)] if stds else []),
            Column("µm peak-to-peak", sizes, lambda size: figures(2 * size), "largest.*.amplitude_m", 2e6),
            Column("at rpm", _rpm(where), "{:.1f}".format, "largest.*.speed_rad_s", RPM),
        )
        return Table("largest readings", columns)

    def _std_of(self, largest: Sequence[tuple[float | None, float | None]]) -> list[dict[str, float]]:
        """Deviation of the largest amplitude of each sensor by its key in the document; empty if unknown."""
        if self.std is None:
            return [{}] * len(largest)
        rows = [None if speed is None else self.finer.speeds.searchsorted(speed) for _, speed in largest]
        return [
            {} if row is None else {"amplitude_std_m": float(self.std[row, k])} for k, row in enumerate(rows)
        ]

    def forces(self) -> tuple[Table, ...]:
        """The largest force on each support."""
        supports = self.response.rotor.supports
        where = self._largest(self.finer.bearing_forces().largest)
        columns = (
            Column("support", [support.name or f"node {support.node}" for support in supports]),
            Column(
                "largest force, N peak", [size for size, _ in where], figures, "bearing_forces.largest_N.*"
            ),
            Column("at rpm", _rpm(where), "{:.1f}".format, "bearing_forces.largest_at_rad_s.*", RPM),
        )
        return (Table("forces on the supports", columns),) if supports else ()

    def file(self) -> Table:
        """One row per speed and sensor."""
        import numpy as np

        from rotorid.base.rpm import phase_deg

        Z = self.response.readings(self.sensors)
        S, C = Z.shape
        std = () if self.std is None else (Column("amplitude_std_m", self._asked(self.std).ravel()),)
        columns = (
            Column("speed_rad_s", self.response.speeds.repeat(C)),
            Column("sensor", self.labels * S),
            Column("amplitude_m", np.abs(Z).ravel()),
            Column("phase_deg", phase_deg(Z).ravel()),
            *std,
        )
        return Table("readings", columns)

    def pictures(self, view: View, at: int | None) -> dict[str, Callable[[], Figure]]:
        """What draws amplitude and phase over speed, polar curves, or orbits."""
        from fem.plots import bode_figure, orbits_figure, polar_figure

        one_of(view, "view", get_args(View))
        finer, places = self.finer, self.sensors
        draw: dict[str, tuple[str, Callable[[], Figure]]] = {
            "bode": (
                "Amplitude and phase over speed; a positive phase leads. Marks: peaks of each reading.",
                lambda: bode_figure(finer, places, self.peaks, operating=self.operating),
            ),
            "polar": ("Readings in the plane.", lambda: polar_figure(finer, places)),
            "orbits": ("Orbits.", lambda: orbits_figure(finer, places, self._speed_of(at))),
            "shape": ("Deflected shape.", lambda: self.shape_figure(at)),
        }
        others = ("bode", "shape") if finer.steady.any() and self.drawn else ("bode",)
        return dict(draw[name] for name in (view, *others))

    def shape_figure(self, at: int | None) -> Figure:
        """The deflected rotor at a speed."""
        from fem.plots import draw_deflected_shape
        from rotorid.base.plot_style import on_figure

        shape = self._deflected(at)
        return on_figure(lambda ax: draw_deflected_shape(shape, 0, ax))

    def shape(self, at: int | None) -> tuple[Table, ...]:
        """The orbit of each node at a speed; nothing without a steady response."""
        if not self.finer.steady.any():
            return ()
        from rotorid.base.rpm import phase_deg

        shape = self._deflected(at)
        columns = (
            Column("node", shape.nodes),
            Column("position, m", shape.rotor.positions, "{:.4f}".format),
            Column("µm peak", 1e6 * shape.major[0], figures),
            Column("minor axis", 1e6 * shape.minor[0], figures),
            Column("phase in x, °", phase_deg(shape.x[0]), "{:.1f}".format),
        )
        return (Table(f"deflected shape at {rpm_text(shape.speeds[0])}", columns),)

    def _judgement(self, chief: Sequence[Peak]) -> str:
        """Whether it runs steadily, whether margins are as required, and what to do where that is unknown."""
        unstable = listing([window.where() for window in self.response.windows], "and")
        first = f"UNSTABLE {unstable}: there is no steady response there.\n" if unstable else ""
        low, high = self.operating or (0.0, 0.0)
        speeds, near = self.finer.speeds, [rpm_text(peak.speed) for peak in chief if peak.enough is False]
        from rotorid.commands.operating_range import open_question

        question = open_question(chief, speeds[0], speeds[-1], (low, high)) if self.operating else ""
        if self.operating is None or not (chief or question):
            asked = (
                f"at {counted(self.response.speeds.size, 'speed')} from {range_text(speeds[0], speeds[-1])}, "
                f"{counted(len(self.sensors), 'reading')}"
            )
            few = "" if self.response.steady.any() else "No steady response"
            few = few or ("No peak" if self.response.speeds.size > 2 else "Too few speeds to find a peak:")
            return f"{first}{counted(len(chief), 'critical speed') if chief else few} {asked}."
        beside = f"from the operating range, {low * RPM:.6g} to {rpm_text(high)} (API 684)"
        if near:
            many = "s" * (len(near) > 1)
            return f"{first}NOT far enough {beside}: critical speed{many} {listing(near, 'and')}."
        if question:
            return f"{first}NOT KNOWN whether all are far enough {beside}: {question}."
        return f"{first}{counted(len(chief), 'critical speed')} far enough {beside}."

    @property
    def drawn(self) -> bool:
        """Whether it is a rotor's, not a small model's."""
        from fem import Rotor

        return isinstance(self.response.rotor, Rotor)

    @property
    def labels(self) -> list[str]:
        """Names of the sensors."""
        from fem import label

        return [str(label(place)) for place in self.sensors]

    def _asked(self, finer: FloatArray) -> FloatArray:
        """Of values at the speeds of `finer` those at the speeds asked for."""
        return finer[self.finer.speeds.searchsorted(self.response.speeds)]

    def _largest(self, values: AnyArray) -> list[tuple[float | None, float | None]]:
        """The largest size in each column of values where a steady response exists, and its speed, rad/s."""
        steady, speeds = self.finer.steady, self.finer.speeds
        if not steady.any():
            return [(None, None)] * values.shape[1]
        sizes = abs(values) * steady[:, None]
        return [
            (float(size[k]), float(speeds[k])) for size, k in zip(sizes.T, sizes.argmax(axis=0), strict=True)
        ]

    def _deflected(self, at: int | None) -> Response:
        """The response of all nodes at a speed."""
        import fem

        finer = self.finer
        return fem.unbalance_response(finer.rotor, finer.unbalance, finer.speeds[self._speed_of(at)])

    def _speed_of(self, at: int | None) -> int:
        steady = self.finer.steady
        if not steady.any():
            raise ValueError("there is no steady response at any of these speeds, so no orbit to draw")
        sizes = abs(self.finer.readings(self.sensors)).max(axis=1)
        return int((sizes * steady).argmax()) if at is None else at

    def _orbits(self) -> dict[str, Any]:
        """Ellipses of the sensors' nodes, one list over speed for each sensor."""
        import numpy as np

        import fem
        from fem import as_sensor

        result = self.response
        nodes = [result.rotor.node(as_sensor(place, result.rotor).node) for place in self.sensors]
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


def _rpm(where: Iterable[tuple[float | None, float | None]]) -> list[float | None]:
    return [None if speed is None else speed * RPM for _, speed in where]


def _peak_table(name: str, named: Sequence[tuple[str, Peak]], place: str = "") -> tuple[Table, ...]:
    """The peaks, at this place of the document; none without any."""
    import fem

    if not named:
        return ()
    sensors, peaks = zip(*named, strict=True)
    columns = (
        replace(column, key=place and key and f"{place}.*.{key}", scale=scale)
        for column, key, scale in zip(
            fem.peak_columns(peaks, "µm", 1e6), _KEYS, (1, 1, 1e6, 1, 1, 1, 1), strict=True
        )
    )
    return (Table(name, (Column("peak at", sensors), *columns)),)


def _api_unbalance(rotor: Rotor, given: str, speeds: Sequence[float], highest: float) -> dict[int, complex]:
    """Read "api", "api:2", "api:2@8,-16": planes (- for 180°) with 4 W / N each, rad/s.

    W is the static load of the next journal; without planes that of all, at the mid span.
    """
    import numpy as np

    import fem
    from rotorid.commands.cross_coupling import mid_span

    head, _, planes = given.partition("@")
    times = number(head.partition(":")[2] or "1")
    journals = [support.node for support in rotor.supports if support.kind == "bearing"]
    if not times > 0 or not journals:
        raise ValueError(f"--unbalance {given}: a number above 0 stands behind api:, and bearings are needed")
    static = fem.static_deflection(rotor, speeds[0])
    forces = np.hypot(static.reaction_x, static.reaction_y) / STANDARD_GRAVITY
    loads = dict(zip([support.node for support in rotor.supports], forces.tolist(), strict=True))
    if not planes:
        total = sum(loads[node] for node in journals)
        return {mid_span(rotor): times * fem.api_unbalance(total, highest)}
    mounted: dict[int, complex] = {}
    for plane in planes.split(","):
        (name,) = nodes(plane.strip().removeprefix("-"), "--unbalance")
        node = rotor.node(name)
        apart = [abs(rotor.positions[node - 1] - rotor.positions[each - 1]) for each in journals]
        sign = -1 if plane.strip().startswith("-") else 1
        load = loads[journals[int(np.argmin(apart))]]
        mounted[node] = sign * times * fem.api_unbalance(load, highest)
    return mounted


@command
def response(
    rotor: Rotor | SmallModel | Path | str,
    unbalance: Unbalance | Path | str,
    options: ResponseOptions,
) -> Outcome:
    """Vibration under unbalance: readings, orbits, bearing forces, peaks after API 684.

    Example: rotorid response sample_data/compressor/rotor.toml
    --unbalance sample_data/compressor/unbalance.csv --speeds 1000:15000:20rpm
    --sensors "probe DE:45,probe NDE:45" --operating 5300:6500rpm --plot bode.png

    Parameters
    ----------
    rotor : MODEL
        Rotor table (.csv, .xlsx), rotor file (.toml) or small model (.toml).
    unbalance : FILE|api|own
        Table: plane, unbalance_g_mm (or mass_g and radius_mm), angle_deg. Or api: 4 W/N of API 617 (7th
        edition, 2002), 6350 g·mm·rpm/kg, at the mid span, W the load of the journals, N the highest operating
        speed (or speed); api:2 doubles it; api@8,-16 puts it at planes, - at 180°, W of the next journal. Or
        own: that in the file of a small model.
    options
        The speeds, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a rotor, an unbalance or an option that cannot be.
    """
    import fem
    from rotorid.commands.operating_range import critical_peaks
    from rotorid.tables import read_unbalance

    source = moving(rotor)
    model, files, operating = source.model, source.files, band(options.operating)
    speeds = rising_speeds(options.speeds)
    highest, asked, standard = operating[1] if operating else speeds[-1], {}, ""
    if isinstance(unbalance, str) and re.match("api(:|@|$)", unbalance):
        if not isinstance(model, fem.Rotor):
            raise ValueError(f"--unbalance {unbalance} follows from the journals of a rotor: give a table")
        asked, standard = {"unbalance": unbalance}, f"Unbalance after API 617 ({unbalance}): "
        unbalance = _api_unbalance(model, unbalance, speeds, highest)
        each = [f"{1e6 * abs(amount):.4g} g·mm at node {node}" for node, amount in unbalance.items()]
        standard += f"{listing(each, 'and')}, N = {rpm_text(highest)}."
    elif unbalance == "own":
        asked, unbalance = {"unbalance": unbalance}, getattr(model, "unbalance", {})
    elif not isinstance(unbalance, Iterable) or isinstance(unbalance, str):
        table = file_of(unbalance, "unbalance by node or station,")
        files = (*files, table)
        unbalance = read_unbalance(table, model)
    if not unbalance:
        raise ValueError(
            "no unbalance is given: a table with --unbalance, or own of a small model that has it"
        )
    places = _places(model, options.sensors)
    if options.view == "shape" and not isinstance(model, fem.Rotor):
        raise ValueError("--view shape draws a rotor; a small model has nodes alone")
    result = _solved(model, unbalance, speeds, places, operating)
    at = None if options.at is None else _nearest(result.finer, options.at)
    chief, every = critical_peaks(result.labels, result.peaks), result.named()
    mounted = _mounted(model, result.response.unbalance)
    return Outcome(
        result=result,
        sentences=(*result.sentences([peak for _, peak in chief]), *filter(None, [standard])),
        tables=(*_peak_table("peaks", chief), result.largest()),
        more=(
            mounted,
            *result.forces(),
            *_peak_table("peaks of every reading", every, "peaks"),
            *(result.shape(at) if options.view == "shape" else ()),
        ),
        file=result.file(),
        keys=result.to_dict(),
        warnings=result.response.warnings,
        notes=tuple(
            f"peak at {rpm_text(peak.speed)}, {name}: {peak.note}" for name, peak in every if peak.note
        ),
        pictures=result.pictures(options.view, at),
        title="Unbalance response",
        provenance=provenance(files, options, **asked),
    )


def _solved(
    model: Rotor | SmallModel,
    unbalance: Unbalance,
    speeds: Sequence[float],
    places: Sequence[SensorLike],
    operating: tuple[float, float] | None,
) -> Vibration:
    """The response, the peaks between the speeds asked for, and what a calibration leaves open."""
    import numpy as np

    import fem
    from fem import as_sensor
    from fem.parameters import band as error_band

    if isinstance(model, fem.Rotor):
        kept = [model.node(as_sensor(place, model).node) for place in places]
        kept = [*dict.fromkeys([*kept, *(support.node for support in model.supports)])]
        coarse, criticals = fem.unbalance_response(model, unbalance, speeds, nodes=kept), None
    else:
        coarse = model.response(speeds, {model.node(node): amount for node, amount in unbalance.items()})
        criticals = model.critical_speeds(speeds[0], speeds[-1])
    finer, peaks = fem.resolve_peaks(coarse, places, operating=operating, criticals=criticals)
    std, doubts = None, tuple[str, ...]()
    if isinstance(model, fem.Rotor):

        def amplitudes(other: Rotor) -> FloatArray:
            new = other is not model
            again = fem.unbalance_response(other, unbalance, finer.speeds, nodes=kept) if new else finer
            return np.abs(again.readings(places))

        std, doubts = error_band(model, "the amplitudes", amplitudes)
    coarse = replace(coarse, windows=finer.windows, warnings=(*finer.warnings, *doubts))
    return Vibration(response=coarse, finer=finer, std=std, sensors=places, peaks=peaks, operating=operating)


def _mounted(rotor: Rotor | SmallModel, unbalance: Mapping[int, complex]) -> Table:
    """What is mounted: kg·m printed in g·mm, angles in degrees with the rotation."""
    from fem import Rotor
    from rotorid.base.rpm import phase_deg

    each, along = sorted(unbalance.items()), list[Column]()
    names = [str(node) for node, _ in each]
    if isinstance(rotor, Rotor):
        stations = [[name for name, at in rotor.stations.items() if at == node] for node, _ in each]
        names = [f"{node} {', '.join(known)}".strip() for node, known in zip(names, stations, strict=True)]
        along = [Column("position, m", [rotor.positions[node - 1] for node, _ in each], "{:.6g}".format)]
    columns = (
        Column("node", names),
        *along,
        Column("unbalance, g·mm", [1e6 * abs(u) for _, u in each], "{:.6g}".format),
        Column("angle, ° with the rotation", [float(phase_deg(u)) for _, u in each], "{:.6g}".format),
    )
    return Table("what is mounted", columns)


def _places(rotor: Rotor | SmallModel, given: str | Sequence[Sensor] | None) -> Sequence[SensorLike]:
    """Where to read the vibration."""
    if given is not None:
        return sensors(given)
    from fem import Rotor

    if not isinstance(rotor, Rotor):
        return rotor.nodes
    held = dict.fromkeys(support.node for support in rotor.supports)
    return [*rotor.stations] or [*held] or [*range(1, rotor.n_nodes + 1)]


def _nearest(response: Response, at: str | float) -> int:
    """The speed nearest to one asked for, which must lie among them."""
    wanted = one_speed(at, "--at")
    low, high = response.speeds[0], response.speeds[-1]
    if not low * (1 - 1e-9) <= wanted <= high * (1 + 1e-9):
        raise ValueError(f"--at {at}: the response was asked for from {low:.6g} to {high:.6g} rad/s only")
    k = int(abs(response.speeds - wanted).argmin())
    if not response.steady[k]:
        raise ValueError(f"--at {at}: there is no steady response, so no orbit to draw; take another speed")
    return k
