"""Study files (.toml): what is drawn of a machine, what it is read with, and the limit that it is to meet.

A machine is drawn, read as built, and balanced until its readings meet the limit. The first runs are the bare
rotor and a trial in each plane; each check run joins them in the next fit, as in `balancing.refine`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

from balancing import (
    ReadingErrors,
    RunScatter,
    Trials,
    UndeterminedError,
    correct,
    estimate_influence,
)
from fem import InfluenceCoefficients, Rotor, Sensor, influence
from fem.parameters import expand, parameter_value, with_parameters
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.files import units
from rotorid.files.bearings_and_seals import Place
from rotorid.files.input_problems import Problems
from rotorid.files.rotor import read_rotor, rotor_files
from rotorid.files.settings import (
    NotNegative,
    Positive,
    Settings,
    Text,
    Turn,
    Whole,
    by_name,
    key,
    listed,
    of,
    read_settings,
    read_toml,
)
from rotorid.files.units import Quantity

TRIAL = 0.5
"""By how much a trial moves one reading, by the rotor as its file has it: a share of the largest as built."""
UNDETERMINED = "the readings do not determine a correction"
UNSTABLE = "the drawn rotor is unstable, and has no steady response"
_Scatter = dict[str, tuple[float, float]]


class SensorKeys(Place):
    """A sensor with its limit: `[sensors.NAME]`."""

    angle_deg: Turn = key("direction, with the rotation from x", default=0.0)
    limit: Annotated[Quantity, of(Positive)] = key(
        "largest amplitude allowed",
        "limit_um_pp limit_mm_s_rms",
        units=units.VIBRATION,
    )


class UnbalanceKeys(Settings):
    """What is drawn at a node: `[unbalance.STATION]`."""

    rms: Positive = key(
        "root mean square of the size; x and y are normal, any angle is as likely",
        "rms_g_mm",
        units=units.UNBALANCE,
    )


class ReadingKeys(Settings):
    """Errors of readings, one standard deviation: `[readings]`."""

    amplitude_percent: NotNegative = key("standard deviation of a reading's amplitude", default=0.0)
    phase_deg: NotNegative = key("standard deviation of its phase", default=0.0)
    floor_percent: NotNegative = key("besides in each direction, percent of the sensor's limit", default=0.0)
    run_percent: NotNegative = key("from run to run; half of its variance common to a run", default=0.0)


class StudyKeys(Settings):
    """A study file."""

    kind: Literal["balance"] = key("what a sample is", default="balance")
    rotor: Text = key("rotor table or file, relative to this file")
    samples: Whole = key("how many, default 1000", default=1000, ge=1)
    seed: Whole = key("of all that is drawn, default 1", default=1, ge=0)
    speeds: listed(Positive) = key(  # type: ignore[valid-type]
        "speeds at which limits hold and runs are made",
        "speeds_rpm",
        units=units.SPEED,
        example="speeds_rpm = [1500, 3000]",
    )
    corrections: Whole = key("most corrections, default none", default=0, ge=0)
    planes: dict[str, Place] = key("correction planes", default={})
    sensors: dict[str, SensorKeys] = key("sensors with their limits", min_length=1)
    unbalance: dict[str, UnbalanceKeys] = key("drawn unbalance, by node or station", min_length=1)
    scatter: by_name(NotNegative) = key(  # type: ignore[valid-type]
        "log-normal, percent by number of the rotor", default={}, example='"bearing[*].stiffness" = 20'
    )
    readings: ReadingKeys = key("errors of readings, which are stated, too", default=ReadingKeys())

    def wrong(self) -> Iterator[tuple[str, str]]:
        """Corrections without planes."""
        if self.corrections and not self.planes:
            yield "planes", "the planes of the corrections; corrections = 0: as built only"


class Study(NamedTuple):
    """What is drawn of a machine, in SI; readings are in shares of their limits.

    Attributes
    ----------
    samples, seed, corrections
        How many, of what, and at most so many corrections.
    files, rotor, speeds
        What was read; as built; rad/s, (S,).
    planes, sensors
        Nodes and places by name.
    gains
        Shares of the limits per metre of deflection, (S, C).
    nodes, unbalance
        Where unbalance is drawn, and standard deviations of x and y, kg·m, (U,).
    scatter
        Numbers of the rotor by path, and standard deviations of their logarithms.
    errors, run_errors
        Of readings and from run to run, None where there are none.
    """

    samples: int
    seed: int
    corrections: int
    files: tuple[Path, ...]
    rotor: Rotor
    speeds: FloatArray
    planes: Mapping[str, int]
    sensors: Mapping[str, Sensor]
    gains: ComplexArray
    nodes: tuple[int, ...]
    unbalance: FloatArray
    scatter: Mapping[str, tuple[float, float]]
    errors: ReadingErrors | None
    run_errors: RunScatter | None


def read_study(path: str | Path) -> Study:
    """Read a study file with its rotor.

    Raises
    ------
    InputError
        With all problems of the study file, or of the rotor.
    """
    path, problems = Path(path), Problems()
    keys = read_settings(StudyKeys, read_toml(path), str(path))
    file = path.parent / keys.rotor
    rotor = read_rotor(file)

    def node(section: Settings, field: str, place: int | str) -> int:
        try:
            return rotor.node(place)
        except ValueError as error:
            section.complain(problems, field, f"a node or station of the rotor: {error}")
            return 1

    planes = {name: node(plane, "node", plane.node) for name, plane in keys.planes.items()}
    sensors = {
        name: Sensor(node(sensor, "node", sensor.node), sensor.angle_deg)
        for name, sensor in keys.sensors.items()
    }
    nodes, scatter = tuple(node(keys, "unbalance", place) for place in keys.unbalance), _Scatter()
    try:
        for pattern, percent in keys.scatter.items():
            spread = float(np.sqrt(np.log1p((percent / 100) ** 2)))
            scatter |= {path: (parameter_value(rotor, path), spread) for path in expand(rotor, pattern)}
        with_parameters(rotor, {path: value for path, (value, _) in scatter.items()})  # each number once
    except ValueError as error:
        keys.complain(problems, "scatter", f"numbers of the rotor: {error}")
    problems.stop()
    speeds, errors = np.array(keys.speeds), keys.readings
    limits = [sensor.limit for sensor in keys.sensors.values()]
    sizes = errors.amplitude_percent / 100, np.radians(errors.phase_deg), errors.floor_percent / 100
    return Study(
        keys.samples,
        keys.seed,
        keys.corrections,
        (path, *rotor_files(file)),
        rotor,
        speeds,
        planes,
        sensors,
        np.where([limit.unit.kind == "velocity" for limit in limits], 1j * speeds[:, None], 1)
        / np.array([limit.si for limit in limits]),
        nodes,
        np.array([drawn.rms for drawn in keys.unbalance.values()]) / np.sqrt(2),
        scatter,
        ReadingErrors(*sizes) if any(sizes) else None,
        RunScatter(errors.run_percent / 100) if errors.run_percent else None,
    )


def influence_of(study: Study, rotor: Rotor) -> InfluenceCoefficients:
    """Coefficients (S, C, P + U) of the planes and of the drawn unbalance, in shares of the limits."""
    places = [*study.planes.values(), *study.nodes]
    model = influence(rotor, places, list(study.sensors.values()), study.speeds)
    return replace(model, W=model.W * study.gains[..., None])


def draw_machine(study: Study, W: ComplexArray, rng: np.random.Generator) -> dict[str, Any]:
    """Largest readings over the limit, as built and after each correction; `runs_needed` to meet it.

    `W` is that of the rotor as built. `held`: the 95 % region of the first weights holds the true ones, those
    of the same weighing of readings without errors; `warned`: this correction had a warning.
    """
    P = len(study.planes)
    trial = TRIAL / np.abs(W[..., :P]).max(axis=(0, 1))
    values = {
        path: value * float(np.exp(spread * rng.standard_normal()))
        for path, (value, spread) in study.scatter.items()
    }
    unbalance = study.unbalance * _normal(rng, len(study.nodes))
    if values:
        model = influence_of(study, with_parameters(study.rotor, values))
        if model.windows:
            return {"why": UNSTABLE}
        W = model.W
    W, bare = W[..., :P], W[..., P:] @ unbalance
    row, mounted, readings = dict[str, Any](), [np.zeros(P, complex)], list[ComplexArray]()
    for k in range(study.corrections + 1):
        readings.append(_read_sensors(study, bare + W @ mounted[-1], rng))
        row[f"ratio_{k}"] = ratio = float(np.abs(readings[-1]).max())
        if ratio <= 1:
            return row | {"runs_needed": len(readings)}
        if k == study.corrections:
            break
        if k == 0:
            mounted += [*np.diag(ratio * trial)]
            readings += [_read_sensors(study, bare + W @ weights, rng) for weights in mounted[1:]]
        trials = Trials(
            tuple(map(str, range(len(readings)))),
            study.speeds,
            tuple(study.sensors),
            tuple(study.planes),
            np.array(readings),
            np.array(mounted),
            errors=study.errors,
            run_errors=study.run_errors,
        )
        try:
            estimate = estimate_influence(trials)
            correction = correct(estimate)
            if k == 0 and (study.errors or study.run_errors):
                true = correct(replace(estimate, W=W, baseline=bare)).weights
                held = bool(correction.region().holds(true)) if correction.region_known else None
                row |= {"held": held, "warned": bool(correction.warnings)}
        except UndeterminedError:
            return row | {"why": UNDETERMINED}
        mounted.append(correction.weights)
    return row


def _read_sensors(study: Study, Y: ComplexArray, rng: np.random.Generator) -> ComplexArray:
    """What the sensors of a run say of (S, C), with the errors of the run and of the readings."""
    if study.run_errors:
        common, single = _normal(rng), _normal(rng, *Y.shape)
        Y = Y * (1 + study.run_errors.relative * (common + single) / np.sqrt(2))
    if study.errors:
        a, b = rng.standard_normal((2, *Y.shape))
        Y = Y * (1 + study.errors.amplitude * a) * np.exp(1j * study.errors.phase * b)
        Y = Y + study.errors.floor * _normal(rng, *Y.shape)
    return Y


def _normal(rng: np.random.Generator, *shape: int) -> ComplexArray:
    """Complex, of variance 1 in each direction."""
    return np.asarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
