"""Influence tables: stored coefficients, one row per speed × sensor × plane.

Instruments and handbooks print the reciprocal for one plane and one sensor, S = 1/W: the weight, and its
angle, with which the reading is 1 at the phase 0. A vibration Y is corrected by −S Y.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from balancing import Gaussian, Influence, Labels, Trials
from fem import label
from rotorid.base.arrays import ComplexArray, FloatArray, IntArray
from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.files import units
from rotorid.files.columns import Column, Source, Table, make_table, read_grid
from rotorid.files.conventions import FULL_TURN, Angles, Phase, as_angles, as_phase
from rotorid.files.grid import Grid
from rotorid.files.headings import read_headings, read_unit, readable
from rotorid.files.layout import vector_in
from rotorid.files.problems import Problems
from rotorid.files.runs import PHASE, SPEED
from rotorid.files.speeds import nearest_speed, show_speed, show_speeds
from rotorid.files.table_writing import table_bytes, write_bytes
from rotorid.files.units import Unit, UnitError
from rotorid.tables.runs.influence_comments import (
    PHASE_MEANING,
    check_notes,
    error_comments,
    read_conventions,
    read_errors,
)
from rotorid.tables.runs.influence_errors import BASELINE, error_columns, error_values, read_covariance

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pandas as pd

    from fem import SensorLike

_GAPS_NAMED = 100
_NAMED = re.compile(r"(?:influence|sensitivity|coefficient)s?[\s_]*[(\[]?(.+?)[)\]]?", re.IGNORECASE)
_RECIPROCAL = "weight per vibration"
_PATTERN = (
    "influence_<vibration unit>_per_<weight unit>, such as influence_um_pp_per_g or influence_m_per_kg_m"
)


class Stored(NamedTuple):
    """Stored coefficients, and what their table itself says about its conventions (`phase`, `angles`)."""

    influence: Influence
    said: Mapping[str, str]


class Coefficients(Protocol):
    """What can be written as an influence table: results of `balancing` and of `fem`."""

    @property
    def speeds(self) -> FloatArray:
        """rad/s, shape (S,)."""

    @property
    def sensors(self) -> Sequence[SensorLike]:
        """Names or nodes, those of a rotor model with their angles, length C."""

    @property
    def planes(self) -> Sequence[str | int]:
        """Names or nodes, length P."""

    @property
    def W(self) -> ComplexArray:
        """Shape (S, C, P), SI."""


def _split(name: str) -> tuple[Unit, Unit]:
    """Units of the vibration and of the weight from `um_pp_per_g`."""
    above, separator, below = name.rpartition("per_")
    if not separator or (above and not above.endswith("_")):
        raise UnitError(f"a name like {_PATTERN}")
    return units.vibration(above.rstrip("_")), units.weight(below)


def _influence_unit(name: str) -> Unit:
    halves = _reciprocal(f"influence_{name}")
    one, other = _split(name) if halves is None else halves
    kind = "influence" if halves is None else _RECIPROCAL
    return Unit(name, kind, one.multiply * other.divide, one.divide * other.multiply)


def _reciprocal(name: str) -> tuple[Unit, Unit] | None:
    """Units of the weight and of the vibration from `influence_g_per_in_s` or `Sensitivity (oz/mil)`."""
    match = _NAMED.fullmatch(name)
    text = "" if match is None else re.sub("[ _]per[ _]", "/", match[1])
    for sign in re.finditer("/", text):
        above, below = text[: sign.start()], text[sign.end() :].strip("()")
        if above and below and readable("mass", above) and readable("amplitude", below):
            weight, vibration = read_unit("mass", above)[0], read_unit("amplitude", below)[0]
            if vibration not in units.WEIGHT:
                return units.WEIGHT[weight], units.VIBRATION[vibration]
    return None


def _tidied(grid: Grid) -> Grid:
    """A table of weights per vibration with the columns influence_<unit> and phase_deg."""
    named = {k: halves for k, name in enumerate(grid.header) if (halves := _reciprocal(name)) is not None}
    if len(named) != 1:
        return grid
    [(at, (weight, vibration))] = named.items()
    header = [("phase_deg" if h.stem == "phase" else h.name) for h in read_headings(grid.header)]
    header[at] = f"influence_{weight.name}_per_{vibration.name}"
    vectors = [vector_in(cells[at]) for _, cells in grid.rows]
    rows = grid.rows
    if "phase_deg" not in header and all(vectors):
        header.append("phase_deg")
        rows = tuple(
            (number, (*cells[:at], vector[0].strip(), *cells[at + 1 :], vector[1].rstrip("° ")))
            for (number, cells), vector in zip(rows, filter(None, vectors), strict=True)
        )
    return replace(grid, header=tuple(header), rows=rows)


COLUMNS = (
    SPEED,
    Column("sensor"),
    Column("plane"),
    Column("influence", _influence_unit, ("influence_um_pp_per_g", "influence_m_per_kg_m")),
    PHASE,
)


def read_influence(
    path: str | Path, *, phase: Phase | None = None, angles: Angles | None = None
) -> Influence:
    """Read stored influence coefficients.

    The phase of a coefficient is the phase reading that a weight at angle 0 causes; whether it leads or lags
    stands in a comment line `# phase = lag`, or else in `phase`. Weights per vibration of one plane and one
    sensor (`influence_g_per_in_s`, `Sensitivity (oz/mil)`, cells such as `45.9 @ 309°`) are the reciprocal:
    `phase_deg` is the angle of the weight with which the reading has phase 0.

    Parameters
    ----------
    path
        `.csv` or `.xlsx` (sheet `influence`).
    phase, angles
        Conventions of the job: to print results in, and to read the table with if it states none itself
        (default: its own, else lead and with rotation).

    Returns
    -------
    balancing.Influence
        In SI, phase lead, with labels to print in; with a baseline, the covariance of the coefficients and
        the errors of a reading where the table has them (`write_influence`).

    Raises
    ------
    InputError
        With all problems of the file.
    """
    problems = Problems()
    stored = load_influence(Path(path), phase, angles, problems)
    problems.stop()
    assert stored is not None
    return stored.influence


def load_influence(
    source: Source, phase: Phase | None, angles: Angles | None, problems: Problems
) -> Stored | None:
    """As `read_influence`, from a file or from the cells of a sheet, or None and problems."""
    before = len(problems)
    grid = read_grid(source, "influence", problems)
    grid = None if grid is None else _tidied(grid)
    columns = () if grid is None else (*COLUMNS, *error_columns(grid, _influence_unit))
    table = None if grid is None else make_table(grid, columns, problems)
    if table is None:
        return None
    said = read_conventions(table.source, table.comments, problems)
    where = _places(table, problems)
    if where is None or len(problems) > before:
        return None
    speeds, sensors, planes, places = where
    size, angle = table.numbers("influence"), table.numbers("phase")
    written = Labels(
        phase=as_phase(said.get("phase") or phase or "lead"),
        angles=as_angles(said.get("angles") or angles or "with rotation"),
    )
    name = table.unit("influence").name
    vibration, weight = (_reciprocal(f"influence_{name}") or ())[::-1] or _split(name)
    known = read_covariance(table, places, planes, written, problems)
    errors = read_errors(table, vibration, problems)
    if len(problems) > before:
        return None
    labels = Labels(
        vibration_unit=vibration.name,
        vibration_scale=vibration.scale,
        weight_unit=weight.name,
        weight_scale=weight.scale,
        phase=phase or as_phase(said.get("phase", "lead")),
        angles=angles or as_angles(said.get("angles", "with rotation")),
    )
    reciprocal = table.unit("influence").kind == _RECIPROCAL
    values = 1.0 / written.weight_from(size, angle) if reciprocal else written.vibration_from(size, angle)
    theta, own, common = _whole(values[places], known, planes, weight.scale)
    influence = Influence(
        speeds=np.array(speeds),
        sensors=sensors,
        planes=tuple(name for name in planes if name != BASELINE),
        W=theta[..., 1:],
        baseline=theta[..., 0],
        errors=Gaussian(own, common, errors.reading, errors.run),
        labels=labels,
    )
    return Stored(influence, said)


def _places(
    table: Table, problems: Problems
) -> tuple[list[float], tuple[str, ...], tuple[str, ...], IntArray] | None:
    """Speeds, sensors and planes, and the row of each coefficient (S, C, P); None and problems."""
    before = len(problems)
    speed, size, angle = (table.numbers(stem) for stem in ("speed", "influence", "phase"))
    table.must_be("speed", speed > 0, "a speed above 0")
    table.must_be("influence", size >= 0, "a coefficient of 0 or more")
    table.must_be("phase", np.abs(angle) <= FULL_TURN, "a phase from -360 to 360 degrees")
    sensor, plane = table.texts("sensor"), table.texts("plane")
    sensors = tuple(dict.fromkeys(name for name in sensor if name))
    planes = tuple(sorted({name: 0 for name in plane if name}, key=lambda name: name != BASELINE))
    speeds = sorted({float(value) for value in speed if value > 0})
    if table.unit("influence").kind == _RECIPROCAL:
        table.must_be("influence", size > 0, "a weight above 0")
        if len(sensors) > 1 or len(planes) > 1 or len(table.fields) > len(COLUMNS):
            expected = "one sensor, one plane and no errors: a weight per vibration is of one alone"
            table.in_header(table.fields["influence"].name, expected)
    at = [{value: k for k, value in enumerate(values)} for values in (speeds, sensors, planes)]
    seen: dict[tuple[int, int, int], int] = {}
    for i in range(len(table)):
        if not (sensor[i] and plane[i] and speed[i] > 0):
            continue
        key = (at[0][float(speed[i])], at[1][sensor[i]], at[2][plane[i]])
        if key in seen:
            expected = (
                f"one coefficient per speed, sensor and plane (row {table.rows[seen[key]]} has the same)"
            )
            table.complain(i, "plane", expected)
        seen.setdefault(key, i)
    if len(problems) > before:
        return None
    complete = len(seen) == len(speeds) * len(sensors) * len(planes)
    for s, c, p in () if complete else np.ndindex(len(speeds), len(sensors), len(planes)):
        if len(problems) > before + _GAPS_NAMED:
            break
        if (s, c, p) not in seen:
            shown = show_speed(speeds[s], table.unit("speed"))
            expected = f"a coefficient of sensor {sensors[c]!r} and plane {planes[p]!r} at {shown}"
            table.as_whole("plane", expected)
    if len(problems) > before:
        return None
    places = np.empty((len(speeds), len(sensors), len(planes)), dtype=np.intp)
    for key, i in seen.items():
        places[key] = i
    return speeds, sensors, planes, places


def _whole(
    values: ComplexArray, known: tuple[FloatArray, ComplexArray] | None, planes: Sequence[str], scale: float
) -> tuple[ComplexArray, FloatArray, ComplexArray]:
    """(Y₀, W), covariance and common columns; without rows of a baseline NaN and 0 there."""
    to = np.array([1 / scale if name == BASELINE else 1.0 for name in planes])
    first = 0 if BASELINE in planes else 1
    n = len(planes) + first
    theta = np.full((*values.shape[:2], n), np.nan, dtype=complex)
    theta[..., first:] = values * to
    covariance = np.zeros((*values.shape[:2], 2 * n, 2 * n))
    common = np.zeros((0 if known is None else len(known[1]), *theta.shape), dtype=complex)
    if known is not None:
        covariance[..., 2 * first :, 2 * first :] = known[0] * np.outer(np.repeat(to, 2), np.repeat(to, 2))
        common[..., first:] = known[1] * to
    return theta, covariance, common


def influence_frame(coefficients: Coefficients, labels: Labels | None = None) -> pd.DataFrame:
    """Influence coefficients as the table that `read_influence` reads.

    Parameters
    ----------
    coefficients
        Of `balancing` or of a rotor model (`fem`).
    labels
        Units and conventions to write; default: those of the coefficients, or m per kg·m and phase lead.

    Returns
    -------
    pandas.DataFrame
        `speed_rad_s`, `sensor`, `plane`, `influence_<unit>`, `phase_deg`; where their errors are known,
        also `std_re_<unit>`, `std_im_<unit>`, the correlations and what is common.
    """
    import pandas as pd

    labels = labels or labels_of(coefficients)
    values, rows = (
        np.asarray(coefficients.W) / labels.weight_scale,
        [str(name) for name in coefficients.planes],
    )
    own = coefficients if isinstance(coefficients, Influence) else None
    if own is not None and own.has_baseline and BASELINE not in rows:
        values, rows = np.concatenate((own.baseline[..., None], values), axis=-1), [BASELINE, *rows]
    S, C, n = values.shape
    above = f"{labels.vibration_unit}_" if labels.vibration_unit else ""
    size, phase = labels.vibration(values)
    return pd.DataFrame(
        {
            "speed_rad_s": np.repeat(np.asarray(coefficients.speeds, dtype=float), C * n),
            "sensor": [str(label(name)) for _ in range(S) for name in coefficients.sensors for _ in range(n)],
            "plane": rows * (S * C),
            f"influence_{above}per_{labels.weight_unit}": size.ravel(),
            "phase_deg": phase.ravel(),
            **({} if own is None else error_values(own, labels, rows)),
        }
    )


def labels_of(coefficients: Coefficients) -> Labels:
    """How the coefficients are labelled; SI and lead for a rotor model."""
    labels = getattr(coefficients, "labels", None)
    return labels if isinstance(labels, Labels) else Labels(weight_unit="kg_m")


def write_influence(path: str | Path, influence: Coefficients, notes: Sequence[str] = ()) -> None:
    """Write influence coefficients to `.csv` or `.xlsx`: with their conventions, and errors where known.

    What is stored of the errors: the covariance of the coefficients, what sensors and speeds have in common,
    the errors of a reading and between runs, their source and degrees of freedom; and the readings of the
    bare rotor, with which the errors are correlated. A later job with readings of its own has errors of its
    own; the same readings have the same errors as before.

    Parameters
    ----------
    path
        An existing file is replaced.
    influence
        Of `balancing` or of a rotor model.
    notes
        Conditions in words (machine, load, number of runs), written as comment lines.

    Raises
    ------
    InputError
        If the file cannot be written; nothing half written is left.
    ValueError
        For a note that a reader would take for a statement about conventions or errors.
    """
    write_bytes(Path(path), influence_bytes(path, influence, notes))


def influence_bytes(path: str | Path, influence: Coefficients, notes: Sequence[str] = ()) -> bytes:
    """What `write_influence` writes."""
    labels = labels_of(influence)
    check_notes(notes)
    comments = (
        f"phase = {labels.phase}",
        f"angles = {labels.angles}",
        *((f"assumed, stated nowhere: {' and '.join(labels.assumed)}",) if labels.assumed else ()),
        PHASE_MEANING,
        *(error_comments(influence, labels) if isinstance(influence, Influence) else ()),
        *notes,
    )
    return table_bytes(path, influence_frame(influence, labels), comments=comments, sheet="influence")


def fit_to_readings(
    influence: Influence, trials: Trials, tolerance_percent: float, source: str, problems: Problems
) -> Influence | None:
    """The part of stored coefficients that belongs to the readings, in their order, or None and problems.

    Every speed and sensor of the readings must be there; further ones are left out.
    """
    ours, theirs = trials.labels, influence.labels
    unlike = _kind(ours.vibration_unit) != _kind(theirs.vibration_unit)
    if unlike:
        expected = (
            f"coefficients for readings in {ours.vibration_unit or 'no unit'}, "
            f"as the runs table has, or in a unit that converts to it"
        )
        problems.add(source, None, "influence", theirs.vibration_unit or "no unit", expected)
    if trials.planes and units.weight(ours.weight_unit).kind != units.weight(theirs.weight_unit).kind:
        expected = (
            f"coefficients per {ours.weight_unit}, or a unit that converts to it, as the weights table has"
        )
        problems.add(source, None, "influence", theirs.weight_unit, expected)
    rows, columns = [], []
    rpm = units.SPEED["rpm"]
    for speed in trials.speeds:
        near = nearest_speed(influence.speeds, float(speed), tolerance_percent)
        if near is None:
            known = show_speeds(influence.speeds, rpm)
            expected = (
                f"coefficients at {show_speed(float(speed), rpm)}, as the runs table has; there are {known}"
            )
            problems.add(source, None, "speed", None, expected)
        else:
            rows.append(near)
    for sensor in trials.sensors:
        if sensor not in influence.sensors:
            known = listing(influence.sensors, "and")
            hint = did_you_mean(sensor, influence.sensors)
            expected = f"coefficients of sensor {sensor!r}, as the runs table has; there are {known}{hint}"
            problems.add(source, None, "sensor", None, expected)
            continue
        columns.append(influence.sensors.index(sensor))
    for plane in trials.planes:
        if plane not in influence.planes:
            known = listing(influence.planes, "and")
            expected = f"coefficients of plane {plane!r}, as the weights table has; there are {known}"
            problems.add(source, None, "plane", None, expected + did_you_mean(plane, influence.planes))
    if len(problems):
        return None
    unit = units.weight(ours.weight_unit if trials.planes else theirs.weight_unit)
    if not trials.planes and unit.name == "kg_m":
        unit = units.UNBALANCE["g_mm"]  # a model speaks SI; nobody weighs a correction in kg·m
    labels = replace(ours, weight_unit=unit.name, weight_scale=unit.scale)
    return replace(influence.part(rows, columns), speeds=trials.speeds, labels=labels)


def _kind(unit: str) -> str:
    return units.vibration(unit).kind
