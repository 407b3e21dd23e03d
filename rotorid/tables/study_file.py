"""Study files (.toml): what is drawn of a machine, what it is read with, and the limit that it is to meet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import ReadingErrors
from fem import Sensor
from fem.parameters import expand, numbers_of, parameter_value
from rotorid.files import units, value_kinds
from rotorid.files.problems import InputError, Problems
from rotorid.files.rotor import read_rotor, rotor_files
from rotorid.files.settings_keys import Key, Kind, Said, take
from rotorid.files.toml_file import Section, read_toml
from rotorid.files.value_kinds import ABOVE_ZERO, FLAG, TEXT, TURN, named, number, whole

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.base.arrays import ComplexArray, FloatArray

MOST_SAMPLES, MOST_CORRECTIONS = 10**9, 20
NODE = Kind(
    lambda section, key: section.take(key), {"type": ["integer", "string"], "minimum": 1}, "a node or station"
)
_KIND = value_kinds.choice(("balance", "calibrate"))
_CORRECTIONS = whole("corrections", 0, MOST_CORRECTIONS)
_PERCENT = number(0.0, 100.0)
_SPEEDS = value_kinds.numbers("speeds, such as speeds_rpm = [1500, 3000]", "1500; 3000", above_zero=True)
_SCATTER = 'percent by number of the rotor, such as "bearing[*].stiffness.scale" = 20'
_TRIAL = "trial unbalance; default: what moves a reading by half of the largest"
_SIZE = "size, drawn by Rayleigh: x and y are normal, any angle is as likely"
_NODE = Key("node", NODE, "the node, a number from 1, or a station", required="a node of the rotor")


def _texts(section: Section, key: str) -> tuple[str, ...] | None:
    value = section.take(key)
    if isinstance(value, list) and value and all(isinstance(one, str) for one in value):
        return tuple(value)
    section.complain(key, 'a list of files, such as data = ["job.toml"]', value=False)
    return None


PLANE = (
    _NODE,
    Key("trial_g_mm", ABOVE_ZERO, _TRIAL, units.UNBALANCE),
)
SENSOR = (
    _NODE,
    Key("angle_deg", TURN, "direction, with the rotation from x", default=0.0),
    Key(
        "limit_um_pp limit_mm_s_rms",
        ABOVE_ZERO,
        "largest amplitude allowed",
        units.VIBRATION,
        required="the limit of the sensor",
    ),
)
UNBALANCE = (
    Key("rms_g_mm median_g_mm", ABOVE_ZERO, _SIZE, units.UNBALANCE, required="how large the unbalance is"),
)
READINGS = (
    Key("amplitude_percent", _PERCENT, "standard deviation of a reading's amplitude", default=0.0),
    Key("phase_deg", number(0.0, 180.0), "standard deviation of its phase", default=0.0),
    Key("floor_percent", _PERCENT, "besides in each direction, percent of the sensor's limit", default=0.0),
    Key("run_percent", _PERCENT, "from run to run; half of its variance common to a run", default=0.0),
)
CALIBRATE = (
    Key("data", Kind(_texts, {"type": "array", "items": TEXT.schema}), "as of the command", required="data"),
    Key("estimate", TEXT, "as `--estimate`", required="the unknown numbers, as --estimate has them"),
    Key("prior", TEXT, "as `--prior`", default=""),
    Key("bounds", TEXT, "as `--bounds`", default=""),
    Key("exact", FLAG, "as `--exact`", default=False),
    Key("unbalance_at", TEXT, "as `--unbalance-at`"),
    Key("bow", whole("shapes of a bow", 0, 20), "as `--bow`", default=0),
)
STUDY = (
    Key("kind", _KIND, "what a sample is", required="balance or calibrate"),
    Key("rotor", TEXT, "rotor table or file, relative to this file", required="the rotor's file"),
    Key("samples", whole("samples", 1, MOST_SAMPLES), "how many, default 1000", default=1000),
    Key("seed", whole("the seed", 0, 2**31), "of all that is drawn, default 1", default=1),
    Key("speeds_rpm", _SPEEDS, "speeds at which limits hold and runs are made", units.SPEED),
    Key("corrections", _CORRECTIONS, "most corrections, default none", default=0),
    Key("planes", named(PLANE), "correction planes", default={}),
    Key("sensors", named(SENSOR), "sensors with their limits", default={}),
    Key("unbalance", named(UNBALANCE), "drawn unbalance, by node or station", default={}),
    Key("scatter", value_kinds.by_name(_SCATTER, "disc.scale: 2"), f"log-normal, {_SCATTER}", default={}),
    Key("readings", value_kinds.table(READINGS), "errors of readings, which are stated, too"),
    Key("calibrate", value_kinds.table(CALIBRATE), "the calibration whose starts are drawn", default={}),
)
_OF_MACHINES = ("speeds_rpm", "corrections", "planes", "sensors", "unbalance", "scatter", "readings")


@dataclass(frozen=True, eq=False)
class MachineStudy:
    """What is drawn of a machine, in SI; readings are in shares of their limits.

    Attributes
    ----------
    rotor, speeds
        As built, and rad/s, (S,).
    planes, sensors
        Nodes and places by name.
    trials
        Unbalance of each plane's trial run, kg·m, (P,); 0: by the rule.
    gains
        Shares of the limits per metre of deflection, (S, C).
    unbalance
        Standard deviation of x and y by node, kg·m.
    scatter
        Numbers of the rotor by path, and standard deviations of their logarithms.
    errors, run_error, corrections
        Of readings, None where they have none; from run to run, relative; at most so many.
    """

    rotor: Rotor
    speeds: FloatArray
    planes: Mapping[str, int]
    sensors: Mapping[str, Sensor]
    trials: FloatArray
    gains: ComplexArray
    unbalance: Mapping[int, float]
    scatter: Mapping[str, tuple[float, float]]
    errors: ReadingErrors | None
    run_error: float
    corrections: int


@dataclass(frozen=True, eq=False)
class StudyFile:
    """A study as it is read: of machines, or of the starts of a calibration (options of `calibrate`)."""

    samples: int
    seed: int
    rotor_file: Path
    files: tuple[Path, ...]
    machine: MachineStudy | None
    calibrate: Mapping[str, Any]


def read_study(path: str | Path) -> StudyFile:
    """Read a study file with its rotor.

    Raises
    ------
    InputError
        With all problems of both.
    """
    path, problems = Path(path), Problems()
    said = take(Section(str(path), problems.need(read_toml(path, problems)), problems), STUDY)
    problems.stop()
    balance = said["kind"] == "balance"
    for key in ("speeds_rpm", "sensors", "unbalance") if balance else ("calibrate",):
        if not said[key]:
            said.section.missing(key, f"what is needed where kind is {said['kind']}")
    for key in ("calibrate",) if balance else _OF_MACHINES:
        if said[key]:
            said.section.complain(key, f"nothing, where kind is {said['kind']}", value=False)
    if balance and said["corrections"] and not said["planes"]:
        said.section.missing("planes", "the planes of the corrections; corrections = 0: as built only")
    file = path.parent / said["rotor"]
    try:
        rotor = read_rotor(file)
    except InputError as error:
        problems.extend(error.problems)
    problems.stop()
    machine = _machine(said, rotor) if balance else None
    problems.stop()
    files = (path, *rotor_files(file))
    return StudyFile(said["samples"], said["seed"], file, files, machine, said["calibrate"])


def _machine(said: Said, rotor: Rotor) -> MachineStudy:
    """What is drawn; problems are noted with the sections."""
    top, speeds = said.section, np.array(said["speeds_rpm"].unit.to_si(np.array(said["speeds_rpm"].value)))

    def node(section: Section, key: str, place: int | str) -> int:
        try:
            return rotor.node(place)
        except ValueError as error:
            section.complain(key, f"a node or station of the rotor: {error}", value=False)
            return 0

    if len({*speeds.tolist()}) < speeds.size:
        top.complain(said["speeds_rpm"].key, "each speed once")
    planes = {name: node(plane.section, "node", plane["node"]) for name, plane in said["planes"].items()}
    sensors = {
        name: Sensor(node(sensor.section, "node", sensor["node"]), sensor["angle_deg"])
        for name, sensor in said["sensors"].items()
    }
    trials = [plane["trial_g_mm"] for plane in said["planes"].values()]
    limits = [sensor["limit_um_pp"] for sensor in said["sensors"].values()]
    velocity = [limit.unit.kind == "velocity" for limit in limits]
    gains = np.where(velocity, 1j * speeds[:, None], 1.0) / np.array([limit.si for limit in limits])
    unbalance: dict[int, float] = {}
    for place, size in said["unbalance"].items():
        rayleigh = np.sqrt(2 * np.log(2) if size["rms_g_mm"].key.startswith("median") else 2)
        at = node(top, "unbalance", place)
        unbalance[at] = float(np.hypot(unbalance.get(at, 0.0), size["rms_g_mm"].si / rayleigh))
    scatter: dict[str, tuple[float, float]] = {}
    taken: set[object] = set()
    for pattern, share in said["scatter"].items():
        try:
            paths = expand(rotor, pattern)
            for path in paths:
                own = numbers_of(rotor, path)
                if not own or own & taken:
                    raise ValueError(f"{pattern}: each number of the rotor once")
                scatter[path] = parameter_value(rotor, path), float(np.sqrt(np.log1p((share / 100) ** 2)))
                taken |= own
            if not any(scatter[path][0] for path in paths):
                raise ValueError(f"{pattern} is 0, and so is any share of it")
        except ValueError as error:
            top.complain("scatter", f"numbers of the rotor: {error}", value=False)
    errors = said["readings"] or {key.name: 0.0 for key in READINGS}
    sizes = errors["amplitude_percent"] / 100, np.radians(errors["phase_deg"]), errors["floor_percent"] / 100
    return MachineStudy(
        rotor=rotor,
        speeds=speeds,
        planes=planes,
        sensors=sensors,
        trials=np.array([trial.si if trial else 0.0 for trial in trials]),
        gains=gains,
        unbalance=unbalance,
        scatter=scatter,
        errors=ReadingErrors(*map(float, sizes)) if any(sizes) else None,
        run_error=errors["run_percent"] / 100,
        corrections=said["corrections"],
    )
