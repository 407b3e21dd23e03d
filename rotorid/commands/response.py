"""`response`: vibration of a rotor model under a given unbalance, bearing forces and peaks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, get_args

from rotorid.base.json import cell
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, error_figures, figures, listing, range_text, rpm_text
from rotorid.commands.motion_inputs import moving
from rotorid.commands.option_values import (
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
from rotorid.files.units import STANDARD_GRAVITY
from rotorid.report.options import file_of
from rotorid.report.outcome import Outcome, command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fem import Peak, Peaks, Response, Rotor, SensorLike, UnbalanceLike
    from rotorid.base.arrays import AnyArray, FloatArray
    from rotorid.reduction import SmallModel

View = Literal["bode", "polar", "orbits", "shape"]
"""What a picture shows."""
_KEYS = (
    "speed_rpm",
    "speed_rad_s",
    "amplitude",
    "amplification_factor",
    "separation_margin_percent",
    "required_margin_percent",
    "",
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
        warnings, limit, forces = document.pop("warnings"), self.limit(), self._largest_forces()
        errors = {} if self.std is None else {"amplitude_std_m": cell(self._asked(self.std).T)}
        return {
            **document,
            **errors,
            "orbits": self._orbits(),
            "largest": self._largest_readings(),
            "bearing_forces": {
                **self.response.bearing_forces().to_dict(),
                "largest_N": [size for size, *_ in forces],
                "largest_at_rad_s": [speed for _, speed, _ in forces],
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
        unstable = listing([window.where() for window in self.response.windows], "and")
        first = [f"UNSTABLE {unstable}: there is no steady response there."] if unstable else []
        first += [self._margins(chief), self.finer.highest]
        if limit := self.limit():
            largest, allowed = (1e6 * limit[f"{key}_peak_to_peak_m"] for key in ("largest", "allowed"))
            first.append(
                f"In the operating range readings reach {figures(largest)} µm peak-to-peak; API 617 allows "
                f"{allowed:.3g} µm peak-to-peak at {rpm_text(limit['speed_rad_s'])}."
            )
        return first

    def limit(self) -> dict[str, float]:
        """The largest reading in the operating range beside the limit of API 617; empty without either."""
        import numpy as np

        import fem

        low, high = self.operating or (np.inf, np.inf)
        there = self.finer.steady & (self.finer.speeds >= low) & (self.finer.speeds <= high)
        if not there.any():
            return {}
        largest = 2 * float(abs(self.finer.readings(self.sensors)[there]).max())
        return {
            "speed_rad_s": high,
            "allowed_peak_to_peak_m": fem.api617_limit(high),
            "largest_peak_to_peak_m": largest,
        }

    def largest(self) -> Table:
        """The largest reading of each sensor."""
        rows = self._largest_readings()
        sizes = [row["amplitude_m"] and 1e6 * row["amplitude_m"] for row in rows]
        stds = [1e6 * row["amplitude_std_m"] for row in rows if "amplitude_std_m" in row]
        key = "largest.*.amplitude_m"
        columns = (
            Column("sensor", self.labels),
            Column("largest reading, µm peak", sizes, figures, key, 1e6),
            *([Column("±", stds, error_figures, "largest.*.amplitude_std_m", 1e6)] if stds else []),
            Column("µm peak-to-peak", sizes, lambda size: figures(2 * size), key, 2e6),
            _rpm([row["speed_rad_s"] for row in rows], "largest.*.speed_rad_s"),
        )
        return Table("largest readings", columns)

    def forces(self) -> tuple[Table, ...]:
        """The largest force on each support."""
        supports, largest, key = (
            self.response.rotor.supports,
            self._largest_forces(),
            "bearing_forces.largest_",
        )
        columns = (
            Column("support", [support.name or f"node {support.node}" for support in supports]),
            Column("largest force, N peak", [size for size, *_ in largest], figures, f"{key}N.*"),
            _rpm([speed for _, speed, _ in largest], f"{key}at_rad_s.*"),
        )
        return (Table("forces on the supports", columns),) if supports else ()

    def file(self) -> Table:
        """One row per speed and sensor."""
        from rotorid.base.text import phase_deg

        Z = self.response.readings(self.sensors)
        S, C = Z.shape
        std = () if self.std is None else (Column("amplitude_std_m", self._asked(self.std).ravel()),)
        columns = (
            Column("speed_rad_s", self.response.speeds.repeat(C)),
            Column("sensor", self.labels * S),
            Column("amplitude_m", abs(Z).ravel()),
            Column("phase_deg", phase_deg(Z).ravel()),
            *std,
        )
        return Table("readings", columns)

    def pictures(self, view: View, at: int | None) -> dict[str, Callable[[], Figure]]:
        """What draws amplitude and phase over speed, polar curves, orbits, or the deflected rotor."""
        from fem.plots import bode_figure, draw_deflected_shape, orbits_figure, polar_figure
        from rotorid.base.plot_style import on_figure

        finer, places = self.finer, self.sensors
        draw: dict[str, tuple[str, Callable[[], Figure]]] = {
            "bode": (
                "Amplitude and phase over speed; a positive phase leads. Marks: peaks of each reading.",
                lambda: bode_figure(finer, places, self.peaks, operating=self.operating),
            ),
            "polar": ("Readings in the plane.", lambda: polar_figure(finer, places)),
            "orbits": ("Orbits.", lambda: orbits_figure(finer, places, self._speed_of(at))),
            "shape": (
                "Deflected shape.",
                lambda: on_figure(lambda ax: draw_deflected_shape(self._deflected(at), 0, ax)),
            ),
        }
        others = ("bode", "shape") if finer.steady.any() and self.drawn else ("bode",)
        return dict(draw[name] for name in (one_of(view, "view", get_args(View)), *others))

    def _margins(self, chief: Sequence[Peak]) -> str:
        """Whether margins are as required, and what to do where that is unknown."""
        from rotorid.commands.operating_range import open_question

        low, high = self.operating or (0.0, 0.0)
        speeds, near = self.finer.speeds, [rpm_text(peak.speed) for peak in chief if peak.enough is False]
        question = open_question(chief, speeds[0], speeds[-1], (low, high)) if self.operating else ""
        many = counted(len(chief), "critical speed")
        if self.operating is None or not (chief or question):
            few = "No peak" if self.response.speeds.size > 2 else "Too few speeds to find a peak:"
            few = few if self.response.steady.any() else "No steady response"
            return (
                f"{many if chief else few} at {counted(self.response.speeds.size, 'speed')} from "
                f"{range_text(speeds[0], speeds[-1])}, {counted(len(self.sensors), 'reading')}."
            )
        beside = f"from the operating range, {low * RPM:.6g} to {rpm_text(high)} (API 684)"
        if near:
            return f"NOT far enough {beside}: critical speed{'s' * (len(near) > 1)} {listing(near, 'and')}."
        if question:
            return f"NOT KNOWN whether all are far enough {beside}: {question}."
        return f"{many} far enough {beside}."

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

    def _largest(self, values: AnyArray) -> list[tuple[float | None, float | None, int]]:
        """The largest size in each column where a steady response exists, its speed, rad/s, and its row."""
        steady, speeds = self.finer.steady, self.finer.speeds
        if not steady.any():
            return [(None, None, 0)] * values.shape[1]
        sizes = abs(values) * steady[:, None]
        return [(float(sizes[row, k]), float(speeds[row]), row) for k, row in enumerate(sizes.argmax(axis=0))]

    def _largest_forces(self) -> list[tuple[float | None, float | None, int]]:
        return self._largest(self.finer.bearing_forces().largest)

    def _largest_readings(self) -> list[dict[str, Any]]:
        """The largest amplitude of each sensor, m, its speed, and its deviation where that is known."""
        rows = []
        largest = self._largest(self.finer.readings(self.sensors))
        for k, (name, (size, speed, row)) in enumerate(zip(self.labels, largest, strict=True)):
            rows.append({"sensor": name, "amplitude_m": size, "speed_rad_s": speed})
            if self.std is not None and speed is not None:
                rows[-1]["amplitude_std_m"] = float(self.std[row, k])
        return rows

    def _deflected(self, at: int | None) -> Response:
        """The response of all nodes at a speed."""
        import fem

        finer = self.finer
        return fem.unbalance_response(finer.rotor, finer.unbalance, finer.speeds[self._speed_of(at)])

    def _speed_of(self, at: int | None) -> int:
        if at is not None:
            return at
        if not self.finer.steady.any():
            raise ValueError("there is no steady response at any of these speeds, so no orbit to draw")
        return int((abs(self.finer.readings(self.sensors)).max(axis=1) * self.finer.steady).argmax())

    def _orbits(self) -> dict[str, Any]:
        """Ellipses of the sensors' nodes, one list over speed for each sensor."""
        import numpy as np

        import fem

        result = self.response
        nodes = [result.rotor.node(fem.as_sensor(place, result.rotor).node) for place in self.sensors]
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


def _rpm(speeds: Sequence[float | None], key: str) -> Column:
    return Column("at rpm", [speed and speed * RPM for speed in speeds], "{:.1f}".format, key, RPM)


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
    journals = np.array([support.kind == "bearing" for support in rotor.supports])
    if not times > 0 or not journals.any():
        raise ValueError(f"--unbalance {given}: a number above 0 stands behind api:, and bearings are needed")
    static = fem.static_deflection(rotor, speeds[0])
    loads = np.hypot(static.reaction_x, static.reaction_y)[journals] / STANDARD_GRAVITY
    if not planes:
        return {mid_span(rotor): times * fem.api_unbalance(loads.sum(), highest)}
    places = rotor.positions[[support.node - 1 for support in rotor.supports]][journals]
    mounted: dict[int, complex] = {}
    for plane in map(str.strip, planes.split(",")):
        (name,) = nodes(plane.removeprefix("-"), "--unbalance")
        node = rotor.node(name)
        load = loads[abs(places - rotor.positions[node - 1]).argmin()]
        sign = -1 if plane.startswith("-") else 1
        mounted[node] = sign * times * fem.api_unbalance(float(load), highest)
    return mounted


@command
def response(
    rotor: Rotor | SmallModel | Path | str,
    unbalance: UnbalanceLike | Path | str,
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
    from rotorid.files import read_unbalance

    model, operating = moving(rotor).model, band(options.operating)
    speeds = rising_speeds(options.speeds)
    highest, standard = operating[1] if operating else speeds[-1], ""
    if isinstance(unbalance, str) and re.match("api(:|@|$)", unbalance):
        if not isinstance(model, fem.Rotor):
            raise ValueError(f"--unbalance {unbalance} follows from the journals of a rotor: give a table")
        standard = f"Unbalance after API 617 ({unbalance}): "
        unbalance = _api_unbalance(model, unbalance, speeds, highest)
        planes = [f"{1e6 * abs(amount):.4g} g·mm at node {node}" for node, amount in unbalance.items()]
        standard += f"{listing(planes, 'and')}, N = {rpm_text(highest)}."
    elif unbalance == "own":
        unbalance = getattr(model, "unbalance", {})
    elif not isinstance(unbalance, Iterable) or isinstance(unbalance, str):
        unbalance = read_unbalance(file_of(unbalance, "unbalance by node or station,"), model)
    if not unbalance:
        raise ValueError(
            "no unbalance is given: a table with --unbalance, or own of a small model that has it"
        )
    places = _places(model, options.sensors)
    if options.view == "shape" and not isinstance(model, fem.Rotor):
        raise ValueError("--view shape draws a rotor; a small model has nodes alone")
    result = _solved(model, unbalance, speeds, places, operating)
    at = None if options.at is None else _nearest(result.finer, options.at)
    chief, each = critical_peaks(result.labels, result.peaks), zip(result.labels, result.peaks, strict=False)
    every = [(name, peak) for name, peaks in each for peak in peaks.peaks]
    return Outcome(
        result=result,
        sentences=(*result.sentences([peak for _, peak in chief]), *filter(None, [standard])),
        tables=(*_peak_table("peaks", chief), result.largest()),
        more=(
            *result.forces(),
            *_peak_table("peaks of every reading", every, "peaks"),
        ),
        file=result.file(),
        keys=result.to_dict(),
        warnings=result.response.warnings,
        notes=tuple(
            f"peak at {rpm_text(peak.speed)}, {name}: {peak.note}" for name, peak in every if peak.note
        ),
        pictures=result.pictures(options.view, at),
        title="Unbalance response",
    )


def _solved(
    model: Rotor | SmallModel,
    unbalance: UnbalanceLike,
    speeds: Sequence[float],
    places: Sequence[SensorLike],
    operating: tuple[float, float] | None,
) -> Vibration:
    """The response, the peaks between the speeds asked for, and what a calibration leaves open."""
    import numpy as np

    import fem
    from fem.parameters import band as error_band

    if isinstance(model, fem.Rotor):
        kept = [model.node(fem.as_sensor(place, model).node) for place in places]
        kept = [*dict.fromkeys([*kept, *(support.node for support in model.supports)])]
        coarse, criticals = fem.unbalance_response(model, unbalance, speeds, nodes=kept), None
    else:
        coarse = model.response(speeds, {model.node(node): amount for node, amount in unbalance.items()})
        criticals = model.critical_speeds(speeds[0], speeds[-1])
    finer, peaks = fem.resolve_peaks(coarse, places, operating=operating, criticals=criticals)
    std, doubts = None, tuple[str, ...]()
    if isinstance(model, fem.Rotor):

        def amplitudes(other: Rotor) -> FloatArray:
            again = finer
            if other is not model:
                again = fem.unbalance_response(other, unbalance, finer.speeds, nodes=kept)
            return np.abs(again.readings(places))

        std, doubts = error_band(model, "the amplitudes", amplitudes)
    coarse = replace(coarse, windows=finer.windows, warnings=(*finer.warnings, *doubts))
    return Vibration(response=coarse, finer=finer, std=std, sensors=places, peaks=peaks, operating=operating)


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
