"""Stored influence coefficients: a table for people, or JSON that keeps all that is known of their errors.

Instruments and handbooks print the reciprocal for one plane and one sensor, S = 1/W: the weight, and its
angle, with which the reading is 1 at the phase 0. A vibration Y is corrected by −S Y.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from itertools import islice, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from balancing import Gaussian, Influence, Labels, Reading, ReadingErrors, RunErrors, Trials
from rotorid.base import tables
from rotorid.base.arrays import ComplexArray
from rotorid.base.json import SCHEMA_VERSION, plain
from rotorid.base.text import Angles, Phase
from rotorid.files import units
from rotorid.files.cells import Grid
from rotorid.files.check_and_slow_roll import outside
from rotorid.files.columns import UNCLEAR, Column, Source, Table, make_table, read_grid
from rotorid.files.disk import file_content, write_files
from rotorid.files.headings import read_headings, read_unit, readable
from rotorid.files.input_problems import MOST_LINES, Problems, refusal
from rotorid.files.runs import SPEED, nearest_speed, speed_words
from rotorid.files.table_layouts import vector_in
from rotorid.files.units import Unit, UnitError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_NAMED = re.compile(r"(?:influence|sensitivity|coefficient)s?[\s_]*[(\[]?(.+?)[)\]]?", re.IGNORECASE)
_PATTERN = (
    "influence_<vibration unit>_per_<weight unit>, such as influence_um_pp_per_g or influence_m_per_kg_m"
)


def _units(name: str) -> tuple[Unit, Unit, bool]:
    """Of vibration and weight, from `um_pp_per_g`; true: weight per vibration, `g_per_in_s` or `oz/mil`."""
    text = re.sub("[ _]per[ _]", "/", name)
    for sign in re.finditer("/", text):
        above, below = text[: sign.start()], text[sign.end() :].strip("()")
        if above and below and readable("mass", above) and readable("amplitude", below):
            weight, vibration = read_unit("mass", above)[0], read_unit("amplitude", below)[0]
            if vibration not in units.WEIGHT:
                return units.VIBRATION[vibration], units.WEIGHT[weight], True
    above, separator, below = name.rpartition("per_")
    if not separator or (above and not above.endswith("_")):
        raise UnitError(f"a name like {_PATTERN}")
    return units.vibration(above.rstrip("_")), units.weight(below), False


def _influence_unit(name: str) -> Unit:
    vibration, weight, reciprocal = _units(name)
    one, other = (weight, vibration) if reciprocal else (vibration, weight)
    kind = f"{one.kind} per {other.kind}"
    return Unit(name, kind, one.multiply * other.divide, one.divide * other.multiply)


def _phase_unit(name: str) -> Unit:
    return units.one_of(units.ANGLE)(read_unit("phase", name.replace("_", " "))[0])


COLUMNS = (
    SPEED,
    Column("sensor"),
    Column("plane"),
    Column("influence", _influence_unit, ("influence_um_pp_per_g", "influence_m_per_kg_m")),
    Column("phase", _phase_unit, ("phase_deg", "phase_lag_deg")),
    Column("std", _influence_unit, ("std_um_pp_per_g",), required=False),
)


def read_influence(
    path: str | Path, *, phase: Phase | None = None, angles: Angles | None = None
) -> Influence:
    """Read stored influence coefficients.

    The phase of a coefficient is the phase reading that a weight at angle 0 causes; whether it leads or lags
    says its heading (`phase_lag_deg`), or else `phase`. Weights per vibration of one plane and one sensor
    (`influence_g_per_in_s`, `Sensitivity (oz/mil)`, cells such as `45.9 @ 309°`) are the reciprocal:
    `phase_deg` is the angle of the weight with which the reading has phase 0.

    Parameters
    ----------
    path
        `.json`, which has all that `write_influence` knew of errors, `.csv` or `.xlsx` (sheet `influence`).
    phase, angles
        Conventions of the job: to print results in, and to read a table with that states none itself
        (default: its own, else lead and with rotation).

    Returns
    -------
    balancing.Influence
        In SI, phase lead, with labels to print in.

    Raises
    ------
    InputError
        With all problems of the file.
    """
    return load_influence(Path(path), phase, angles)[0]


def load_influence(
    source: Source, phase: Phase | None, angles: Angles | None
) -> tuple[Influence, dict[str, Any]]:
    """As `read_influence`, from a file or from the cells of a sheet, and the conventions that it states."""
    if isinstance(source, Path) and source.suffix.lower() == ".json":
        influence = _from_json(source)
        stated = {key: getattr(influence.labels, key) for key in ("phase", "angles")}
    else:
        problems = Problems()
        grid = read_grid(source, "influence", problems)
        table = problems.need(make_table(_tidied(grid), COLUMNS, problems))
        if table.unit("influence") == UNCLEAR:
            problems.stop()
        heading = re.search("lag|lead", table.fields["phase"].name)
        stated = {"phase": heading[0]} if heading else {}
        usual = {"phase": phase or "lead", "angles": angles or "with rotation"}
        influence = _from_table(table, Labels(**{**usual, **stated}))
    its = influence.labels
    labels = replace(its, phase=phase or its.phase, angles=angles or its.angles)
    return replace(influence, labels=labels), stated


def _tidied(grid: Grid) -> Grid:
    """The table with weights per vibration in influence_<unit> and phase_deg."""
    header, columns = [*grid.header], [*grid.columns]
    for at, name in enumerate(grid.header):
        match = _NAMED.fullmatch(name)
        try:
            vibration, weight, reciprocal = _units(match[1] if match else "")
            headings = read_headings(header)
            units_of = [read_unit("phase", h.unit)[0] or "deg" if h.stem == "phase" else "" for h in headings]
        except UnitError:
            continue
        if not reciprocal:
            continue
        header = [f"phase_{unit}" if unit else h.name for unit, h in zip(units_of, headings, strict=True)]
        header[at] = f"influence_{weight.name}_per_{vibration.name}"
        vectors = [*map(vector_in, columns[at])]
        if not any(units_of) and None not in vectors:
            header.append("phase_deg")
            columns[at] = [vector[0] for vector in vectors if vector]
            columns.append([vector[1].rstrip("° ") for vector in vectors if vector])
    return replace(grid, header=tuple(header), columns=columns)


def _from_table(table: Table, labels: Labels) -> Influence:
    """The coefficients with these conventions; InputError with all problems of the table."""
    size, angle, std = table.numbers("influence"), table.numbers("phase"), "std" in table
    unit = table.unit("influence")
    vibration, weight, reciprocal = _units(unit.name)
    keys = [*zip(table.numbers("speed").tolist(), table.texts("sensor"), table.texts("plane"), strict=True)]
    least = "a weight above 0" if reciprocal else "a coefficient of 0 or more"
    table.complain_where((size < 0) | (size == 0) & reciprocal, "influence", least)
    table.complain_where(table.numbers("speed") <= 0, "speed", "a speed above 0")
    table.complain_where(table.numbers("std") < 0, "std", "a standard deviation of 0 or more")
    if reciprocal and (std or len({key[1:] for key in keys}) > 1):
        alone = "one sensor, one plane and no errors: a weight per vibration is of one alone"
        table.in_header("influence", alone)
    elif std and table.unit("std") != unit:
        table.in_header("std", f"the unit of the coefficients, std_{unit.name}")
    table.once("plane", keys, "one coefficient per speed, sensor and plane (row {} has the same)")
    table.problems.stop()
    speeds, sensors, planes = ([*dict.fromkeys(each)] for each in zip(*keys, strict=True))
    speeds.sort()
    row, shown = {key: k for k, key in enumerate(keys)}, speed_words(table)
    for place in islice((key for key in product(speeds, sensors, planes) if key not in row), MOST_LINES):
        words = f"sensor {place[1]!r} and plane {place[2]!r} at {shown(place[0])}"
        table.as_whole("plane", f"a coefficient of {words}")
    table.problems.stop()
    S, C, P = len(speeds), len(sensors), len(planes)
    at = np.reshape([row[key] for key in product(speeds, sensors, planes)], (S, C, P))
    values = 1.0 / labels.weight_from(size, angle) if reciprocal else labels.vibration_from(size, angle)
    errors = Gaussian.none(S, C, P)
    if std:
        variance = np.zeros((S, C, 2 * P + 2))
        variance[..., 2:] = np.repeat(table.numbers("std")[at] ** 2, 2, axis=-1)
        covariance = variance[..., None] * np.eye(2 * P + 2)
        errors = Gaussian(covariance, errors.noise.columns, errors.reading, errors.run)
    labels = replace(
        labels,
        vibration_unit=vibration.name,
        vibration_scale=vibration.scale,
        weight_unit=weight.name,
        weight_scale=weight.scale,
    )
    nothing = np.full((S, C), np.nan)
    return Influence(np.array(speeds), tuple(sensors), tuple(planes), values[at], nothing, errors, labels)


def _from_json(path: Path) -> Influence:
    """The coefficients of `_document`; InputError for anything else."""
    data, problems = file_content(path), Problems()
    try:
        whole = json.loads(data)
        problems.refuse_newer(str(path), whole["schema_version"])
        influence = _of_document(whole["influence"])
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        problems.add(f"coefficients as rotorid balance writes them (missing or wrong: {error})", path)
    problems.stop()
    return influence


def _of_document(stored: Mapping[str, Any]) -> Influence:
    """The coefficients of `_document`, as they were."""
    reading, run, labels = stored["reading"], stored["run_errors"], stored["labels"]
    sizes, chances, covariance = (
        np.array(part, dtype=float) for part in (run["sizes"], run["probability"], stored["covariance"])
    )
    if not (chances.sum() > 0 and min(chances.min(), sizes.min()) >= 0):
        raise ValueError("sizes of errors and probabilities must be 0 or more")
    stated = None if reading["errors"] is None else ReadingErrors(**reading["errors"])
    run = run | {"sizes": sizes.reshape(-1, 4), "probability": chances / chances.sum()}
    common = _complex(stored["common"]).reshape(-1, *covariance.shape[:2], covariance.shape[2] // 2)
    reading = Reading(stated, reading["source"], dof=reading["dof"] or np.inf)
    return Influence(
        speeds=np.array(stored["speeds_rad_s"], dtype=float),
        sensors=tuple(stored["sensors"]),
        planes=tuple(stored["planes"]),
        W=_complex(stored["W"]),
        baseline=_complex(stored["baseline"]),
        errors=Gaussian(covariance, common, reading, RunErrors(**run)),
        labels=Labels(**labels | {"assumed": tuple(labels["assumed"])}),
    )


def _complex(parts: Any) -> ComplexArray:  # noqa: ANN401  a part of a JSON document
    """From real and imaginary parts."""
    real, imaginary = np.array(parts, dtype=float)
    return np.asarray(real + 1j * imaginary)


def _document(influence: Influence) -> dict[str, Any]:
    """All that is known of coefficients and their errors, SI and phase lead: (2, …) real, imaginary parts."""
    covariance, common = influence.errors.noise.at(influence.errors.sizes)
    reading = influence.reading
    stored = {
        "speeds_rad_s": influence.speeds,
        "sensors": influence.sensors,
        "planes": influence.planes,
        "W": (influence.W.real, influence.W.imag),
        "baseline": (influence.baseline.real, influence.baseline.imag),
        "covariance": covariance,
        "common": (common.real, common.imag),
        "reading": {
            "errors": reading.errors and vars(reading.errors),
            "source": reading.source,
            "dof": reading.dof,
        },
        "run_errors": vars(influence.run_errors),
        "labels": vars(influence.labels),
    }
    return plain({"schema_version": SCHEMA_VERSION, "influence": stored})


def influence_table(influence: Influence) -> tables.Table:
    """Influence coefficients as the table that `read_influence` reads, in their units and conventions.

    Parameters
    ----------
    influence
        Coefficients of S speeds, C sensors and P planes.

    Returns
    -------
    rotorid.base.tables.Table
        `speed_<unit>`, `sensor`, `plane`, `influence_<unit>`, `phase_lead_deg` or `phase_lag_deg`; where
        their errors are known, `std_<unit>`: one standard deviation, the same in every direction.
    """
    labels = influence.labels
    S, C, P = influence.W.shape
    speed = units.SPEED[labels.speed_unit]
    unit = "_".join(filter(None, (labels.vibration_unit, "per", labels.weight_unit)))
    size, phase = labels.vibration(influence.W / labels.weight_scale)
    columns = {
        f"speed_{speed.name}": np.repeat(influence.speeds * speed.scale, C * P),
        "sensor": [name for _ in range(S) for name in influence.sensors for _ in range(P)],
        "plane": influence.planes * (S * C),
        f"influence_{unit}": size.ravel(),
        f"phase_{labels.phase}_deg": phase.ravel(),
    }
    if influence.known_errors:
        variance = np.einsum("scii->sci", influence.channels())[..., 2:].reshape(S, C, P, 2).mean(axis=-1)
        columns[f"std_{unit}"] = (np.sqrt(variance) * labels.vibration_scale / labels.weight_scale).ravel()
    return tables.Table("influence", tuple(tables.Column(name, cells) for name, cells in columns.items()))


def write_influence(path: str | Path, influence: Influence) -> None:
    """Write influence coefficients: a table for people to `.csv` or `.xlsx`, without loss to `.json`.

    JSON keeps the covariance of the coefficients, what sensors and speeds have in common, the errors of a
    reading and between runs, and the readings of the bare rotor, with which the errors are correlated. A
    later job with readings of its own has errors of its own; the same readings have the same as before.

    Parameters
    ----------
    path
        An existing file is replaced.
    influence
        The coefficients.

    Raises
    ------
    InputError
        If the file cannot be written; nothing half written is left.
    """
    write_files({Path(path): influence_bytes(path, influence)})


def influence_bytes(path: str | Path, influence: Influence) -> bytes:
    """What `write_influence` writes."""
    kind = Path(path).suffix.lower()
    if kind == ".json":
        return json.dumps(_document(influence), ensure_ascii=False).encode()
    if kind not in (".csv", ".xlsx"):
        raise refusal(path, "a name that ends in .csv, .xlsx or .json")
    table = influence_table(influence)
    return tables.csv(table) if kind == ".csv" else tables.excel(table)


def fit_to_readings(
    influence: Influence,
    trials: Trials,
    planes: Sequence[str],
    tolerance_percent: float,
    source: str,
    problems: Problems,
) -> Influence | None:
    """The part of stored coefficients that belongs to the readings, in their order, or None and problems.

    Every speed and sensor of the readings must be there, and their planes among these; further ones are left
    out.
    """
    before = len(problems)
    for column, shown, there in outside(trials, influence, planes, tolerance_percent):
        expected = f"coefficients for {column} {shown!r}, which the readings have; there are {there}"
        column = "influence" if column in ("amplitude", "weight") else column
        problems.add(expected, source, None, column)
    if len(problems) > before:
        return None
    rows = [nearest_speed(influence.speeds, v, tolerance_percent) or 0 for v in trials.speeds.tolist()]
    columns = [influence.sensors.index(name) for name in trials.sensors]
    unit = units.weight((trials if trials.planes else influence).labels.weight_unit)
    if not trials.planes and unit.name == "kg_m":
        unit = units.UNBALANCE["g_mm"]  # a model speaks SI; nobody weighs a correction in kg·m
    labels = replace(trials.labels, weight_unit=unit.name, weight_scale=unit.scale)
    return replace(influence.part(rows, columns), speeds=trials.speeds, labels=labels)
