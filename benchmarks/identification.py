"""A 20-mass chain with 60 unknowns from 40 frequencies, against calls of `numpy.linalg.lstsq`."""

from __future__ import annotations

import numpy as np

from benchmarks.timing import Row, against_numpy, best_of, relative_difference
from rotorid.identify import HarmonicModel, harmonic_model, identify
from rotorid.identify.amplitudes import Experiments, experiments

MASSES = 20


def equations() -> list[str]:
    rows = []
    for i in range(1, MASSES + 1):
        right = f" + (b{i + 1}*p + c{i + 1})*(X{i} - X{i + 1})" if i < MASSES else ""
        left = f"(b{i}*p + c{i})*(X{i} - X{i - 1})" if i > 1 else "(b1*p + c1)*X1"
        rows.append(f"m{i}*p**2*X{i} + {left}{right} = {'F' if i == 1 else '0'}")
    return rows


def read() -> HarmonicModel:
    model = harmonic_model(
        equations(), estimate=[f"{kind}{i}" for kind in "mcb" for i in range(1, MASSES + 1)]
    )
    assert len(model.combinations.words) == 3 * MASSES
    return model


def problem() -> tuple[HarmonicModel, np.ndarray, Experiments]:
    model, i = read(), np.arange(MASSES)
    truth = np.concatenate((10 + np.sin(i), 1e5 * (1 + 0.3 * np.cos(i)), 200 + 50 * np.sin(2 * i)))
    frequencies = np.linspace(5.0, 190.0, 40)
    load = {"F": np.full(40, 1000.0 + 0j)}
    return model, truth, experiments(model, frequencies, {**load, **model.predict(truth, frequencies, load)})


def run() -> list[Row]:
    model, truth, data = problem()
    difference = relative_difference(identify(model, data).values, truth)
    reading = best_of(lambda: None, lambda _: read(), 3)
    seconds = best_of(lambda: None, lambda _: identify(model, data), 5)
    return [
        against_numpy("reading a model of 20 masses, 60 unknowns", reading, 1000, 0.0, 0.0),
        against_numpy("60 unknowns from 40 frequencies", seconds, 500, difference, 1e-6),
    ]
