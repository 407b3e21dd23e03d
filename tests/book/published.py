"""Balancing examples that others have published: influence coefficients, weights and angles.

The two-plane example of Brüel & Kjær's application note 17-227 and the weights left in of Feese and Grazier
are the jobs `sample_data/bk_two_plane` and `sample_data/left_in`. The numbers of example 6 of the note, of
Feese and Grazier, and of Foiles, Allaire and Gunter are those that the public tests of hsbalance quote.
"""

import cmath
import math

import numpy as np

from balancing import Gaussian, Influence, Limits, Trials, correct, estimate_influence
from book.printed import below, lines, read
from rotorid.files import read_job
from rotorid.samples import sample_data

NOTE = "Brüel & Kjær, application note 17-227"
FOILES = "Foiles, Allaire and Gunter 2000"
PLANES = tuple(f"plane_{p}" for p in range(1, 5))


def polar(text):
    """A complex amplitude from "amplitude@degrees"."""
    size, _, angle = text.partition("@")
    return cmath.rect(float(size), math.radians(float(angle)))


def balancing():
    """All published corrections, and the effects of the trial weights of example 6."""
    one = correct(
        estimate_influence(_trials([["3.4@116"], ["1.8@42"]], [[0.0], [2.0]])), method="least-squares"
    )
    goodman = np.array([[3, -2], [5, -2], [5, -3]], dtype=complex)
    weights = _correction(goodman, ["1@0", "1@180", "0@0"]).weights.real
    found = _weights(f"{NOTE}, two planes", "correction in plane {}, g", _job("bk_two_plane"))
    found |= _weights(f"{NOTE}, one plane", "correction, g", one.weights)
    found |= _example_6()
    found |= _weights("Feese and Grazier 2004, weights left in", "total in plane {}", _job("left_in"))
    found |= below("Goodman 1964", {f"weight {i}": weight for i, weight in enumerate(weights, 1)})
    found |= _weights(FOILES, "min-max weight in plane {}, kg", foiles().weights)
    return found | _weights(FOILES, "weight in plane {}, at most 3.402 kg each, kg", foiles(3.402).weights)


def _example_6():
    """Two planes, 1.15 g each: the effects of the trial weights, and the weights from the printed effects."""
    readings = [["170@112", "53@78"], ["235@94", "58@68"], ["185@115", "77@104"]]
    effects = estimate_influence(_trials(readings, [[0.0, 0.0], [1.15, 0.0], [0.0, 1.15]])).W[0] * 1.15
    printed = np.array([[polar("90@58"), polar("21@140")], [polar("10.9@10"), polar("37.9@142")]])
    found, source = {}, f"{NOTE}, example 6"
    for plane in (1, 2):
        name = f"effect of the trial weight in plane {plane} on sensor {{}}, mm/s"
        found |= _weights(source, name, effects[:, plane - 1])
    weights = _correction(printed / 1.15, ["170@112", "53@78"]).weights
    return found | _weights(source, "correction in plane {}, g", weights)


def foiles(limit=None):
    """Eleven readings, four planes: the smallest largest amplitude, each weight up to a limit."""
    table = lines("foiles_min_max.csv")
    coefficients = np.array([[polar(line[plane]) for plane in PLANES] for line in table])
    limits = None
    if limit is not None:
        most, free = np.full(len(PLANES), limit), np.full((1, len(table)), np.inf)
        limits = Limits(most, free, ((),) * len(PLANES))
    return _correction(coefficients, [line["initial"] for line in table], method="minmax", limits=limits)


def _job(folder):
    """Corrections of a sample job in grams; angles as the job counts them, with the rotation."""
    trials = read_job(sample_data() / folder / "job.toml").trials
    found = correct(estimate_influence(trials), method="least-squares").to_dict()["corrections"]
    return [cmath.rect(entry["mass"], math.radians(entry["angle_deg"])) for entry in found]


def _trials(readings, weights):
    """Runs at one speed: readings (R, C) as "amplitude@degrees", weights (R, P) at 0°."""
    values = np.array([[polar(text) for text in run] for run in readings])
    mounted = np.array(weights, dtype=complex)
    return Trials(
        runs=tuple(f"run {r}" for r in range(len(values))),
        speeds=np.array([100.0]),
        sensors=tuple(f"sensor {c + 1}" for c in range(values.shape[1])),
        planes=tuple(f"plane {p + 1}" for p in range(mounted.shape[1])),
        readings=values[:, None, :],
        weights=mounted,
    )


def _correction(coefficients, initial, *, method="least-squares", limits=None):
    """Correction of vibration (C) with stored coefficients (C, P) at one speed."""
    sensors, planes = coefficients.shape
    influence = Influence(
        np.array([100.0]),
        tuple(f"{c + 1}" for c in range(sensors)),
        PLANES[:planes],
        coefficients[None],
        np.full((1, sensors), np.nan),
        Gaussian.none(1, sensors, planes),
    )
    return correct(influence, np.array([[polar(text) for text in initial]]), method=method, limits=limits)


def _weights(source, quantity, values):
    """Sizes, and angles in degrees in the turn of the printed one."""
    book, found = read("balancing.csv"), {}
    for i, value in enumerate(values, 1):
        size = quantity.format(i)
        angle = f"{size.rpartition(',')[0] or size}, angle, deg"
        middle = float(book[source, angle].printed)
        turned = middle + (math.degrees(cmath.phase(value)) - middle + 180.0) % 360.0 - 180.0
        found |= {size: abs(value), angle: turned}
    return below(source, found)
