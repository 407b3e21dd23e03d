"""Are the intervals of an identification honest? Simulated repetitions of tests whose truth is known.

Run `python tests/coverage/coverage_identify.py [repetitions]`. For each case, method and parameter it prints
the share of 95 % intervals that contain the truth, the bias in standard deviations, the relative standard
deviation, and the median width of the intervals over that by Cramér and Rao.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from rotorid.identify import AmplitudeErrors, Experiments, HarmonicModel, harmonic_model, identify
from rotorid.identify.amplitudes import experiments
from rotorid.identify.linear_start import build_rows, linear_fit

FloatArray = NDArray[np.float64]
TWO_MASSES = (
    "(m1*p**2 + a1*p + c1)*X1 + (a*p + c)*X2 = F1",
    "(a*p + c)*X1 + (m2*p**2 + a2*p + c2)*X2 = 0",
)
WAYS = ("equation-error", "output-error, errors stated", "output-error, errors not stated")
"""Methods; the linear start does not use stated errors."""
NUMBERS = {"m1": 10.0, "m2": 5.0, "c1": 15e3, "c": -5e3, "c2": 5e3, "a1": 40.0, "a": -15.0, "a2": 15.0}


@dataclass(frozen=True)
class Case:
    """A model, its true parameters, a test plan and the errors of its readings."""

    title: str
    model: HarmonicModel
    truth: Mapping[str, float]
    frequencies: FloatArray
    inputs: Mapping[str, float]
    errors: AmplitudeErrors


def task_5_1() -> Case:
    """[S] task 5.1: one mass; 2 % and 1°."""
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    errors = AmplitudeErrors(relative=0.02, phase=np.deg2rad(1.0))
    truth = {"c": 1000.0, "b": 10.0}
    return Case("task 5.1, 2 % and 1°", model, truth, np.array([10.0, 20.0, 30.0]), {"F": 10.0}, errors)


def two_masses() -> Case:
    """[S] 1.6: two masses, three dampers unknown; 2 % and 1°."""
    errors = AmplitudeErrors(relative=0.02, phase=np.deg2rad(1.0))
    frequencies = np.array([15.0, 20.0, 25.0, 40.0, 50.0])
    return _two_masses("two masses (1.6), 2 % and 1°", ("a1", "a2", "a"), frequencies, errors)


def near_resonance() -> Case:
    """Two masses, three stiffnesses unknown, read around the first resonance (22.4 rad/s); 5 % and 3°."""
    errors = AmplitudeErrors(relative=0.05, phase=np.deg2rad(3.0))
    frequencies = np.linspace(18.0, 27.0, 10)
    return _two_masses("two masses near a resonance, 5 % and 3°", ("c1", "c2", "c"), frequencies, errors)


def _two_masses(
    title: str, estimate: tuple[str, ...], frequencies: FloatArray, errors: AmplitudeErrors
) -> Case:
    known = {name: value for name, value in NUMBERS.items() if name not in estimate}
    model = harmonic_model(TWO_MASSES, known=known, estimate=estimate)
    truth = {name: NUMBERS[name] for name in estimate}
    return Case(title, model, truth, frequencies, {"F1": 100.0}, errors)


def simulate(case: Case, rng: np.random.Generator, *, stated: bool = True) -> Experiments:
    """One repetition."""
    given = case.model, list(case.truth.values()), case.frequencies, case.inputs, case.errors, rng
    return readings(*given, case.errors if stated else None)


def readings(
    model: HarmonicModel,
    truth: Sequence[float],
    frequencies: FloatArray,
    inputs: Mapping[str, float],
    errors: AmplitudeErrors | None = None,
    rng: np.random.Generator | None = None,
    stated: AmplitudeErrors | None = None,
) -> Experiments:
    """Amplitudes of a model, exact or with independent normal errors of size and phase."""
    n = len(frequencies)
    loads = {name: np.full(n, complex(value)) for name, value in inputs.items()}
    signals = dict(loads)
    for name, z in model.predict(np.array(truth), frequencies, loads).items():
        signals[name] = z
        if errors is not None and rng is not None:
            size = 1 + errors.relative * rng.standard_normal(n)
            signals[name] = z * size * np.exp(1j * errors.phase * rng.standard_normal(n))
    return experiments(model, frequencies, signals, errors=stated, free=False)


class Figures(NamedTuple):
    """Shares of intervals with the truth, bias in standard deviations, relative ones, widths."""

    coverage: FloatArray
    bias: FloatArray
    spread: FloatArray
    width: FloatArray


def repeat(case: Case, method: str, repetitions: int, *, stated: bool = True) -> Figures:
    """Identify many simulated repetitions, by output error or by the linear regression that it starts from.

    Output error begins at the truth, which changes nothing but the time: every start leads to the
    same minimum.
    """
    rng = np.random.default_rng(1)
    truth = np.array(list(case.truth.values()))
    values, reach = np.zeros((repetitions, len(truth))), np.zeros((repetitions, len(truth)))
    for i in range(repetitions):
        data = simulate(case, rng, stated=stated)
        if method == "output-error":
            found = identify(case.model, data, start=dict(case.truth))
            values[i], reach[i] = found.values, np.ptp(found.ci95, axis=1) / 2
        else:
            fit = linear_fit(case.model, build_rows(case.model, data))
            values[i] = fit.recovery.values
            std = np.sqrt(np.diag(fit.recovery.gain @ fit.system.covariance @ fit.recovery.gain.T))
            reach[i] = std * stdtrit(fit.estimate.dof, 0.975)  # by what the rows leave, whatever is stated
    exact = readings(case.model, truth.tolist(), case.frequencies, case.inputs, stated=case.errors)
    least = np.ptp(identify(case.model, exact, start=dict(case.truth)).ci95, axis=1) / 2
    std, inside = values.std(axis=0), abs(values - truth) <= reach
    bias = (values.mean(axis=0) - truth) / std
    return Figures(inside.mean(axis=0), bias, std / abs(truth), np.median(reach, axis=0) / least)


def main(repetitions: int = 2000) -> None:
    """Print the table."""
    print(f"{repetitions} repetitions; coverage of 95 % intervals, bias / std, std / |value|, ± / Cramér–Rao")
    for case in (task_5_1(), two_masses(), near_resonance()):
        print(f"\n{case.title}")
        for words in WAYS["near" not in case.title :]:
            stated = words.endswith(", errors stated")
            found = repeat(case, words.split(",")[0], repetitions, stated=stated)
            for name, share, bias, spread, width in zip(case.truth, *found, strict=True):
                print(
                    f"  {words:<34} {name:<3} {share:6.1%}  bias {bias:+6.3f}  std {spread:7.2%}"
                    f"  ±/C–R {width:.2f}"
                )
                words = ""


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
