"""Keys of a job as typed models: of a job file, and of the sheets of a workbook."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import radians
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from balancing import Labels, Placement, ReadingErrors, RunScatter, Trials
from rotorid.base.text import Angles, Phase, Rotation, View, listing
from rotorid.files import units
from rotorid.files.cells import NotANumber, parse_number
from rotorid.files.columns import Source
from rotorid.files.input_problems import InputError, Problems, refusal
from rotorid.files.settings import (
    Count,
    Date,
    Label,
    NotNegative,
    Number,
    Place,
    Positive,
    Settings,
    Text,
    Turn,
    Whole,
    by_name,
    key,
    listed,
    of,
    optional,
    read_settings,
)
from rotorid.files.table_layouts import DEFAULT_TOLERANCE, LARGEST_TOLERANCE, ROTATIONS
from rotorid.files.units import Quantity

TABLES = ("runs", "weights", "influence", "check", "check_weights", "slow_roll")
"""Keys of a job file that name tables; the sheets of a workbook that are such tables."""
WEIGHTS = "weights"
"""In place of a table of `check_weights`: the weights were mounted, although there are holes for pieces."""
READINGS = ("runs", "check", "slow_roll")
"""Those that are runs tables."""
WEIGHT_TABLES = ("weights", "check_weights")
RADIUS = {name: units.LENGTH[name] for name in ("mm", "m", "in")}
MOST_HOLES = 1000
SAME_DEG = 1e-4
Pair = tuple[Turn, Turn]
_ANY_NUMBER = r"([+-]?[0-9]+(?:[.,][0-9]+)?)"
_PAIR = re.compile(rf"{_ANY_NUMBER}\s*(?:-|\N{{EN DASH}}|\.\.|:|to)\s*{_ANY_NUMBER}")


def named_tables(settings: Mapping[str, Any]) -> dict[str, str]:
    """The files of `TABLES` that a job names, by key; `WEIGHTS` is none."""
    named = {key: settings.get(key) for key in TABLES}
    return {
        key: name
        for key, name in named.items()
        if isinstance(name, str) and (key, name) != ("check_weights", WEIGHTS)
    }


def _printable(name: str) -> str:
    if not name.isprintable():
        raise ValueError(
            "the name of a file, without control characters: in double quotes TOML takes \\ for the "
            "beginning of one; write / in its place, or put the name in single quotes"
        )
    return name


def _pairs(value: object) -> object:
    """One pair, or a text of them, as pairs."""
    if isinstance(value, str):
        parts = [part.strip() for part in value.split(";") if part.strip()]
        return [list(pair.groups()) if (pair := _PAIR.fullmatch(part)) else part for part in parts]
    flat = isinstance(value, list) and not any(isinstance(one, list) for one in value)
    return [value] if flat and value else value


def _different(arcs: tuple[Pair, ...]) -> tuple[Pair, ...]:
    if any((last - first) % 360.0 == 0.0 for first, last in arcs):
        raise ValueError("different angles (use = false leaves a plane out)")
    return arcs


def _rising(boundaries: tuple[float, ...]) -> tuple[float, ...]:
    if len(boundaries) != 3 or not boundaries[0] < boundaries[1] < boundaries[2]:
        raise ValueError("three boundaries in rising order, A/B, B/C and C/D")
    return boundaries


def _or_one(value: object) -> object:
    """A number for all speeds, at the speed ""."""
    return value if isinstance(value, dict) or ":" in str(value) else {"": value}


def _one_or_all(names: tuple[str, ...]) -> str | tuple[str, ...]:
    return names[0] if len(names) == 1 else names


def _share(value: object) -> tuple[float, float]:
    """A ratio at an angle in degrees, "0.8@180"; without an angle at 0."""
    ratio, _, angle = str(value).partition("@")
    try:
        size, degrees = (parse_number(part.strip().removesuffix("°")) for part in (ratio, angle or "0"))
    except NotANumber:
        size, degrees = 0.0, 0.0
    if not (size and abs(degrees) <= 360.0):
        raise ValueError('a ratio other than 0 at an angle from -360 to 360 degrees, such as "1@180"')
    return size, degrees


Arcs = Annotated[
    tuple[Pair, ...],
    BeforeValidator(_pairs, json_schema_input_type=Annotated[list[Pair], Field(min_length=1)] | Pair | Text),
    AfterValidator(_different),
    Field(min_length=1),
]
Limits: Any = Annotated[
    by_name(Positive),
    BeforeValidator(_or_one, json_schema_input_type=Positive | by_name(Positive)),
]
Boundaries = Annotated[Quantity, of(listed(Positive, _rising))]
Weight = Annotated[Quantity, of(Positive)]
Share = Annotated[tuple[float, float], BeforeValidator(_share, json_schema_input_type=str | float)]
"""Ratio and angle, degrees."""
File = Annotated[Text, AfterValidator(_printable)]


class _Placed(Settings):
    """What may stand in the rotor model."""

    node: Count | None = optional("a node of the rotor model")
    station: Text | None = optional("or the name of a station of the rotor model")

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Both."""
        if self.node is not None and self.station is not None:
            yield "station", "either node or station, not both"


class Plane(_Placed):
    """`[planes.NAME]`."""

    max_weight: Weight | None = optional(
        "largest weight that may be mounted, in any unit of a mass or unbalance",
        "max_mass_g max_unbalance_g_mm",
        units=units.WEIGHT,
    )
    radius: Positive | None = optional(
        "radius of the corrections; converts masses and unbalances", "radius_mm", units=RADIUS
    )
    trial_radius: Positive | None = optional(
        "radius of the trial weights, where it is another", "trial_radius_mm", units=RADIUS
    )
    use: bool = key("whether the plane is used", default=True, example="false")
    remove: bool = key(
        "whether material is taken away (drilled, ground) instead of added", default=False, example="false"
    )
    forbidden: Arcs = key(
        "pairs [from, to] of different angles from -360 to 360 degrees, between which nothing may be mounted",
        "forbidden_deg",
        (),
        example="[[20, 60], [300, 340]]",
    )
    holes: Annotated[Whole, Field(ge=1, le=MOST_HOLES)] | None = optional(
        f"a number of equally spaced holes, up to {MOST_HOLES:,}",
    )
    first_hole: Turn = key("angle of the first of them, default 0", "first_hole_deg", 0.0)
    holes_at: listed(Number) | None = optional(  # type: ignore[valid-type]
        "angles of the holes in degrees, in place of `holes`",
        "holes_deg",
        example="holes_deg = [0, 30, 75]",
    )
    hole_names: listed(Label) | None = optional(  # type: ignore[valid-type]
        "a different name for each hole, in place of the numbers 1, 2, …",
        example='["A", "B", "C"]',
    )
    available: Annotated[Quantity, of(listed(Positive))] | None = optional(
        "weights, in any unit, of which each can be mounted",
        "available_g available_g_mm",
        units=units.WEIGHT,
        example="available_g = [5, 10, 20]",
    )
    step: Weight | None = optional("or any weight in such steps", "step_g step_g_mm", units=units.WEIGHT)
    per_hole: Annotated[Whole, Field(ge=1, le=100)] = key(
        "how many weights one hole takes, default 1", default=1
    )
    taken: by_name(Positive) = key(  # type: ignore[valid-type]
        "weights that are in holes already, by number or name of the hole",
        default={},
        example='{ "3" = 10 }',
    )
    stock: listed(Annotated[Whole, Field(ge=0)]) | None = optional(  # type: ignore[valid-type]
        "how many there are of each available weight, those of `check_weights` included",
        example="stock = [4, 4, 2]",
    )

    def hole_angles(self) -> dict[str, float]:
        """Angle of each hole by its name, degrees as the job counts; none where there are no holes."""
        degrees = self.holes_at or ()
        if self.holes is not None:
            degrees = tuple(self.first_hole + 360.0 * k / self.holes for k in range(self.holes))
        return dict(zip(self.hole_names or map(str, range(1, len(degrees) + 1)), degrees, strict=False))

    def open_holes(self) -> dict[str, float]:
        """Those outside the forbidden arcs, and those in which something is."""
        near, arcs = SAME_DEG, [(first, (last - first) % 360.0) for first, last in self.forbidden]
        return {
            name: angle
            for name, angle in self.hole_angles().items()
            if name in self.taken
            or not any(near < (angle - first) % 360.0 < width - near for first, width in arcs)
        }

    @property
    def angles(self) -> list[float]:
        """All that the job writes of it in degrees."""
        return [*self.hole_angles().values(), *(end for arc in self.forbidden for end in arc)]

    @property
    def lever(self) -> float:
        """What a trial weight counts at the correction radius, since mass × radius is what acts."""
        return 1.0 if self.radius is None else (self.trial_radius or self.radius) / self.radius

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Radii and keys of holes that do not fit together."""
        yield from super().wrong()
        if self.trial_radius is not None and self.radius is None:
            yield (
                "trial_radius",
                "the correction radius too, radius_mm, to which the trial weights are converted",
            )
        if self.holes is not None and self.holes_at is not None:
            yield "holes", "either holes, equally spaced, or holes_deg, their angles, not both"
            return
        if self.has("first_hole") and self.holes is None:
            yield "first_hole", "the number of equally spaced holes too, holes = 12"
        count, names = self.holes or len(self.holes_at or ()), tuple(self.hole_angles())
        if not count:
            wanted = "the holes of the plane too, holes = 12 or holes_deg = [0, 30, 75]"
            about_holes = ("hole_names", "available", "step", "per_hole", "taken", "stock")
            yield from ((one, wanted) for one in about_holes if self.has(one))
        elif self.hole_names is not None and len({*self.hole_names}) != count:
            yield "hole_names", f"a different name for each of the {count} holes"
        else:
            if self.has("per_hole") and self.available is None:
                yield "per_hole", "the weights that are available too, available_g = [5, 10]"
            for name in self.taken.keys() - names:
                yield "taken", f"holes of the plane, {names[0]} … {names[-1]}, not {name!r}"


class Group(Settings):
    """`[groups.NAME]`."""

    planes: by_name(Share) = key(  # type: ignore[valid-type]
        "the weights of its planes as ratio@angle, the angle in the job's direction",
        example='{ P1 = "1@0", P2 = "1@180" }',
    )


class Sensor(_Placed):
    """`[sensors.NAME]`."""

    limit: Annotated[Quantity, of(Limits)] | None = optional(
        "largest amplitude above 0, in the unit of the readings or with its own, `limit_mm_s_rms`, or a "
        "table by speed",
        "limit limit_um limit_mm_s limit_m_s2",
        units=units.VIBRATION,
        example='{ "3000" = 20, "4500" = 30 }',
    )
    zones: Boundaries | None = optional(
        "its own boundaries in place of those of `[zones]`",
        "zones zones_um zones_mm_s zones_m_s2",
        units=units.VIBRATION,
        example="zones_um_pp = [90, 120, 180]",
    )
    weight: NotNegative = key(
        "weight in the fit, default 1; 0: the sensor counts only for its limit", default=1.0
    )
    angle: Turn | None = optional(
        "where the sensor points, from the model's x, in the job's angle direction", "angle_deg"
    )


class Errors(Settings):
    """`[errors]`."""

    amplitude_percent: NotNegative = key("one standard deviation of an amplitude, percent of it", default=0.0)
    phase_deg: NotNegative = key("one standard deviation of a phase, degrees", default=0.0)
    floor: NotNegative = key(
        "one standard deviation at amplitude 0, in the unit of the readings", default=0.0
    )
    run_percent: NotNegative = key(
        "what changes from run to run, one standard deviation, percent", default=0.0
    )
    run_floor: NotNegative = key("the same at amplitude 0, in the unit of the readings", default=0.0)
    placement_deg: NotNegative = key(
        "one standard deviation of the angle of a mounted weight, degrees", default=0.0
    )
    placement_percent: NotNegative = key("one standard deviation of its mass, percent", default=0.0)
    drift_percent: NotNegative = key(
        "how far readings drift from the first run to the last, percent", default=0.0
    )

    @property
    def between_runs(self) -> bool:
        """Whether they say what changes from run to run; 0: nothing."""
        return self.has("run_percent") or self.has("run_floor")

    def stated_in(self, trials: Trials) -> Trials:
        """The runs with these errors: relative, in rad, and in the unit of the readings inside."""
        scale, reading, between = trials.labels.vibration_scale, None, None
        if self.amplitude_percent or self.phase_deg or self.floor:
            phase, floor = radians(self.phase_deg), self.floor / scale
            reading = ReadingErrors(self.amplitude_percent / 100.0, phase, floor)
        if self.between_runs:
            between = RunScatter(self.run_percent / 100.0, self.run_floor / scale)
        placement = Placement(self.placement_percent / 100.0, radians(self.placement_deg))
        drift = self.drift_percent / 100.0
        return replace(trials, errors=reading, run_errors=between, placement=placement, drift=drift)

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Nothing above 0."""
        if not self.between_runs and not any(value for _, value in self):
            yield "", "an error above 0 (amplitude_percent, phase_deg or floor), or no [errors] at all"


class KeyPhasor(Settings):
    """`[key_phasor]`."""

    angle: Turn = key(
        "the direction of the key phasor from the model's x, in the job's angle direction",
        "angle_deg",
    )


class Zones(Settings):
    """`[zones]`."""

    boundaries: Boundaries = key(
        "the boundaries A/B, B/C and C/D of the machine's class, as ISO 20816 prints them, in the unit of "
        "the readings or with their own",
        "boundaries boundaries_um boundaries_mm_s boundaries_m_s2",
        units=units.VIBRATION,
        example="boundaries_mm_s_rms = [2.3, 4.5, 7.1]",
    )


class Sheet(Settings):
    """`[sheet]`."""

    place: Label = key("where it stands", default="")
    engineer: Label = key("who balanced it", default="")
    instrument: Label = key("with what, its number", default="")
    zero: Literal["right", "top"] = key(
        "where 0° stands in the polar plots of the sheet; default: right, analysers have it at the top",
        default="right",
    )


class JobSettings(Settings):
    """A job file."""

    runs: listed(File) | None = optional(  # type: ignore[valid-type]
        "the runs table, relative to the job file; or a folder, or a list of files, with one run each",
        expected='the runs table, or the files of the runs, runs = ["as found.csv", "trial.csv"]',
    )
    weights: File | None = optional("the weights table")
    influence: File | None = optional("stored coefficients instead of trial runs, or beside them")
    rotor: File | None = optional("a rotor table or file: coefficients are computed")
    check: File | None = optional("runs table of a check run, with the proposed weights mounted")
    check_weights: listed(File, _one_or_all) | None = optional(  # type: ignore[valid-type]
        "weights table of the check run, where others were mounted than proposed: the pieces of `--split` "
        "where there are holes, else the weights; or a list of tables whose weights add, as of the first "
        'pieces and of a trim; `"weights"`: the weights, although there are holes',
        expected='a weights table, or several that add, check_weights = ["pieces.csv", "trim.csv"]',
    )
    slow_roll: File | None = optional("a runs table of one run at slow speed, subtracted from every reading")
    key_phasor: KeyPhasor | None = optional("where the key phasor stands, see below")
    speed_weights: by_name(NotNegative) = key(  # type: ignore[valid-type]
        "a table of weights by speed in the fit, 0: only for the limits",
        default={},
        example='{ "3000" = 2, "4500" = 0.5 }',
    )
    phase: Phase | None = optional(
        "whether a positive phase leads or lags; most instruments show lag, the angle that the rotor turns "
        "from the pulse to the positive peak; unstated: lead, the answer says so and what lag gives",
    )
    angles: Literal[Angles, Rotation, "with", "against"] | None = optional(
        "how angles on the rotor count: with (rotation), against (rotation), or clockwise or "
        "counter-clockwise with `rotation`; unstated: with rotation, named so where an angle other than "
        "0° and 180° is written",
    )
    rotation: Rotation | None = optional("how the rotor turns, seen from the same end as the angles")
    view: View | None = optional("the end from which that is seen")
    speed_tolerance_percent: Annotated[NotNegative, Field(le=LARGEST_TOLERANCE)] = key(
        f"speeds of different runs that differ by less count as one, default {DEFAULT_TOLERANCE:g}",
        default=DEFAULT_TOLERANCE,
    )
    speed: Annotated[Quantity, of(Positive)] | None = optional(
        "the speed of runs tables without a column of speeds", "speed_rpm", units=units.SPEED
    )
    errors: Errors | None = optional(
        "one standard deviation of a reading, see below; unstated and unmeasured ones are assumed (2 % and "
        "2° of a reading, 2 % from run to run) and named so; the digits in which readings are written count",
    )
    exchanged: bool | None = optional(
        "whether the columns of amplitudes and phases of the runs tables hold each other's numbers; answers "
        "the question whether they do",
        example="true",
    )
    planes: dict[str, Plane] = key("see below", default={})
    sensors: dict[str, Sensor] = key("see below", default={})
    zones: Zones | None = optional("zones by which readings are judged, see below")
    groups: dict[str, Group] = key(
        "planes with weights of fixed ratios and angles, such as static and couple, see below",
        default={},
    )
    machine: Label = key("its name or serial number, for the balancing sheet and `rotorid fleet`", default="")
    machine_type: Label = key("its type, for `rotorid fleet`", default="")
    date: Date | None = optional("when it was balanced", example="2026-03-17")
    sheet: Sheet = key(
        "the head of the balancing sheet and its polar plots, see below", default=Sheet.model_construct()
    )

    def wrong(self) -> Iterator[tuple[str, str]]:
        """A direction without the rotation that is seen against it."""
        if self.rotation is None and (self.view or self.angles in ROTATIONS):
            yield "rotation", f"{listing(map(repr, ROTATIONS))}, how the rotor turns, seen from the same end"
        inside = {*self.planes, *(plane for group in self.groups.values() for plane in group.planes)}
        for name in self.groups.keys() & inside:
            yield "groups", f"names of groups that no plane has, not {name!r}"

    def shares(self, labels: Labels) -> dict[str, dict[str, complex]]:
        """The weight of each plane of each group where that of the group is 1."""
        return {
            name: {p: complex(labels.weight_from(size, radians(at))) for p, (size, at) in one.planes.items()}
            for name, one in self.groups.items()
        }


@dataclass(frozen=True, eq=False)
class WrittenJob:
    """A job as it is written: settings nested as in a job file, and the tables of a workbook.

    Attributes
    ----------
    path
        The job file or workbook, None without one.
    settings
        As a job file holds them.
    tables
        Tables that are there already, by `TABLES`: cells of sheets, or files.
    where
        Sheet, row and column of each setting, by its dotted key.
    """

    path: Path | None
    settings: dict[str, Any] = field(default_factory=dict)
    tables: dict[str, Source] = field(default_factory=dict)
    where: dict[str, Place] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """From which files are named."""
        return (self.path or Path()).parent

    def read(self, problems: Problems) -> JobSettings:
        """All settings; a file that is named in place of a sheet is a problem."""
        source = "" if self.path is None else str(self.path)
        if not self.tables and "runs" not in self.settings:
            raise refusal(source, 'a job, which names the runs table, runs = "runs.csv"', column="runs")
        try:
            settings = read_settings(JobSettings, self.settings, source, self.where)
        except InputError as error:
            raise InputError([*problems, *error.problems]) from None
        for name in filter(settings.has, self.tables):
            settings.complain(problems, name, f"the table in the sheet {name!r} of this workbook, not a file")
        return settings
