"""Balancing examples that others have published: influence coefficients, weights and angles.

The two-plane example of Brüel & Kjær's application note 17-227 and the weights left in of Feese and Grazier
are the jobs `sample_data/bk_two_plane` and `sample_data/left_in`. The readings of the other examples are
given here and in `data/foiles_min_max.csv`. The numbers of example 6 of the note, of Feese and Grazier, and
of Foiles, Allaire and Gunter are those that the public tests of hsbalance quote.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

import numpy as np

from balancing import Correction, Influence, Labels, Limits, Trials, correct, estimate_influence
from rotorid.base.arrays import ComplexArray
from rotorid.samples import sample_data
from rotorid.tables import read_job
from rotorid.validation.row import Printed, Row, number, printed_table

NOTE = "Brüel & Kjær, application note 17-227"
SIX = f"{NOTE}, example 6"
FEESE = "Feese and Grazier 2004, weights left in"
GOODMAN = "Goodman 1964"
FOILES = "Foiles, Allaire and Gunter 2000"

BOOK = Printed("balancing.csv")


def rows() -> list[Row]:
    """All rows of the published balancing examples.

    Returns
    -------
    list of Row
        The computed weights are those of `balancing.correct`, the coefficients those of
        `balancing.estimate_influence`.
    """
    return [
        *_two_planes(),
        *_one_plane(),
        *_example_6(),
        *_left_in(),
        *_goodman(),
        *_min_max(None, "min-max weight in plane {}, kg"),
        *_min_max(3.402, "weight in plane {}, at most 3.402 kg each, kg"),
    ]


def _two_planes() -> list[Row]:
    """Two planes, two sensors, trial weights removed: an exact solution."""
    first, second = _job("bk_two_plane")
    source = f"{NOTE}, two planes"
    return [
        *_weight(source, "correction in plane 1, g", first),
        *_weight(source, "correction in plane 2, g", second),
    ]


def _one_plane() -> list[Row]:
    """One plane, one sensor, a trial weight of 2 g at 0°."""
    trials = _trials([["3.4@116"], ["1.8@42"]], [[0.0], [2.0]])
    (found,) = correct(estimate_influence(trials), method="least-squares").weights.tolist()
    return _weight(f"{NOTE}, one plane", "correction, g", found)


def _example_6() -> list[Row]:
    """Two planes, 1.15 g each: the effects of the trial weights, and the weights from the printed effects."""
    readings = [["170@112", "53@78"], ["235@94", "58@68"], ["185@115", "77@104"]]
    effect = estimate_influence(_trials(readings, [[0.0, 0.0], [1.15, 0.0], [0.0, 1.15]])).W[0] * 1.15
    texts = (("90@58", "21@140"), ("10.9@10", "37.9@142"))
    printed: ComplexArray = np.array([[_polar(text) for text in line] for line in texts], dtype=complex)
    first, second = _correction(printed / 1.15, ["170@112", "53@78"]).weights.tolist()
    found = []
    for plane in (1, 2):
        for sensor in (1, 2):
            name = f"effect of the trial weight in plane {plane} on sensor {sensor}, mm/s"
            found += _weight(SIX, name, effect[sensor - 1, plane - 1])
    return [
        *found,
        *_weight(SIX, "correction in plane 1, g", first),
        *_weight(SIX, "correction in plane 2, g", second),
    ]


def _left_in() -> list[Row]:
    """Two planes, four probes, the first trial weight left in; totals for the bare rotor."""
    first, second = _job("left_in")
    return [*_weight(FEESE, "total in plane 1", first), *_weight(FEESE, "total in plane 2", second)]


def _goodman() -> list[Row]:
    """Three readings, two planes, all numbers real: least squares."""
    coefficients = np.array([[3, -2], [5, -2], [5, -3]], dtype=complex)
    first, second = _correction(coefficients, ["1@0", "1@180", "0@0"]).weights.real.tolist()
    return BOOK.rows(GOODMAN, {"weight 1": first, "weight 2": second})


def _min_max(limit: float | None, quantity: str) -> list[Row]:
    """Eleven readings, four planes: the smallest largest amplitude, each weight up to a limit."""
    weights = _foiles(limit).weights.tolist()
    return [
        line
        for plane, weight in enumerate(weights, start=1)
        for line in _weight(FOILES, quantity.format(plane), weight)
    ]


def _foiles(limit: float | None) -> Correction:
    """The min-max correction, each weight up to a limit."""
    lines = printed_table("foiles_min_max.csv")
    planes = [f"plane_{p}" for p in range(1, 5)]
    coefficients = np.array([[_polar(line[plane]) for plane in planes] for line in lines], dtype=complex)
    limits = None
    if limit is not None:
        limits = Limits.of(
            1, [line["reading"] for line in lines], planes, max_weight=dict.fromkeys(planes, limit)
        )
    return _correction(coefficients, [line["initial"] for line in lines], method="minmax", limits=limits)


def _job(folder: str) -> list[complex]:
    """Corrections of a sample job in grams; angles as the job counts them, with the rotation."""
    job = read_job(sample_data() / folder / "job.toml")
    assert job.trials is not None
    found = correct(estimate_influence(job.trials), method="least-squares").to_dict()["corrections"]
    return [cmath.rect(entry["mass"], math.radians(entry["angle_deg"])) for entry in found]


def _trials(readings: Sequence[Sequence[str]], weights: Sequence[Sequence[float]]) -> Trials:
    """Runs at one speed: readings (R, C) as "amplitude@degrees", weights (R, P) at 0°."""
    values = np.array([[_polar(text) for text in run] for run in readings])
    mounted = np.array(weights, dtype=complex)
    return Trials(
        runs=tuple(f"run {r}" for r in range(len(values))),
        speeds=np.array([100.0]),
        sensors=tuple(f"sensor {c + 1}" for c in range(values.shape[1])),
        planes=tuple(f"plane {p + 1}" for p in range(mounted.shape[1])),
        readings=values[:, None, :],
        weights=mounted,
    )


def _correction(
    coefficients: ComplexArray,
    initial: Sequence[str],
    *,
    method: str = "least-squares",
    limits: Limits | None = None,
) -> Correction:
    """Correction of vibration (C) with stored coefficients (C, P) at one speed."""
    C, P = coefficients.shape
    influence = Influence(
        np.array([100.0]),
        tuple(f"{c + 1}" for c in range(C)),
        tuple(f"plane_{p + 1}" for p in range(P)),
        coefficients[None],
        labels=Labels(),
    )
    vibration = np.array([[_polar(text) for text in initial]])
    return correct(influence, vibration, method=method, limits=limits)


def _weight(source: str, quantity: str, value: complex) -> list[Row]:
    """Two rows of a complex amplitude: its size, and its angle in degrees in the turn of the printed one."""
    angle = f"{quantity.rpartition(',')[0] or quantity}, angle, deg"
    middle = BOOK.number(source, angle)
    turned = middle + (math.degrees(cmath.phase(value)) - middle + 180.0) % 360.0 - 180.0
    return BOOK.rows(source, {quantity: abs(value), angle: turned})


def _polar(text: str) -> complex:
    """A complex amplitude from "amplitude@degrees"."""
    size, _, angle = text.partition("@")
    return cmath.rect(number(size), math.radians(number(angle)))
