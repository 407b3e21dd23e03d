"""Estimation of coefficients, [S] section 1.8 and tasks 5.1 to 8.2: direct problems and estimates.

The models, the data and the printed estimates are those of `sample_data/identify`, a folder each. The direct
problems, whose rounded results are the data, are computed with the parameters that the book states.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import fem
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.harmonic import Experiments, HarmonicModel, Identification, harmonic_model, identify
from rotorid.harmonic.natural_frequencies import natural_modes
from rotorid.harmonic.regression_rows import build_rows
from rotorid.samples import sample_data
from rotorid.tables import HarmonicFile, read_harmonic_model, read_measurements
from rotorid.validation.row import Printed, Row, row

SECTION = "[S] section 1.8"
SINGULAR = ("2_3", "3_2", "3_3", "4_1", "4_2", "4_3")
"""Exercises whose unknowns the book counts; in most of them no data determine all."""
TASKS = ("5_1", "5_2", "6_1", "6_2", "7_1", "7_2", "8_1", "8_2")
BOOK = Printed("lessons.csv")
Task = tuple[Identification, Mapping[str, Any]]
"""An exercise, identified, and what its `expected.toml` says."""


def rows() -> list[Row]:
    """All rows of the lessons."""
    found = {task: _identified(f"task_{task}") for task in TASKS}
    return [
        *_feedback_1_8(),
        *_unknowns(),
        *_one_mass(found["5_1"]),
        *_pump(found["5_2"]),
        *_feedback_6(found["6_1"], found["6_2"]),
        *_chain(found["7_1"], found["7_2"]),
        *_beam(found["8_1"], found["8_2"]),
    ]


def exercise(folder: str) -> tuple[Path, HarmonicFile, dict[str, Any]]:
    """Folder, model and `expected.toml` of an exercise."""
    path = sample_data() / "identify" / folder
    expected = tomllib.loads((path / "expected.toml").read_text(encoding="utf-8"))
    return path, read_harmonic_model(path / "model.toml"), expected


def _identified(folder: str) -> Task:
    path, file, expected = exercise(folder)
    return identify(file.model, read_measurements(path / "data.csv", file)), expected


def _estimates(source: str, task: Task, units: Sequence[str]) -> list[Row]:
    """Printed estimates and combinations of an exercise."""
    result, expected = task
    combinations = {c.words: c.value for c in result.combinations}
    found = [
        row(source, f"estimate of {name}{unit}", text, result.value(name))
        for (name, text), unit in zip(expected["printed"].items(), units, strict=True)
    ]
    for words, text in expected.get("printed_combinations", {}).items():
        found.append(row(source, f"estimate of {words}", text, combinations.get(words, float("nan"))))
    return found


def _worst(task: Task, *names: str) -> float:
    """Largest error of the estimates, percent of the parameters of the direct problem."""
    result, expected = task
    return 100 * max(abs(result.value(name) / float(expected["truth"][name]) - 1) for name in names)


def _rounding(task: Task, name: str, exact: ComplexArray) -> float:
    """Largest error of real and imaginary parts of the data, percent; parts that are 0 are exact."""
    data = task[0].experiments.signals[name].view(float)
    return 100 * float(np.abs(data[data != 0] / exact.view(float)[data != 0] - 1).max())


def _unknowns() -> list[Row]:
    """How many products of parameters a linear problem has, and how many of them data can determine."""
    found = []
    for task in SINGULAR:
        model, source = _model(f"task_{task}"), f"[S] task {task.replace('_', '.')}"
        n, determined = len(model.monomials), len(model.combinations.pivots)
        counts = {"unknowns of the linear problem": n, "unknowns that can be estimated": determined}
        counts |= {"columns of K": n, "experiments that this takes": math.ceil(n / 2)}
        found += BOOK.rows(source, {q: count for q, count in counts.items() if (source, q) in BOOK.lines})
    return found


def _predicted(model: HarmonicModel, truth: Mapping[str, float], w: Sequence[float]) -> ComplexArray:
    """Amplitude of the only output for a force of 10 or 1, given in `truth` as "F"."""
    values = np.array([truth[name] for name in model.parameters])
    inputs = {name: np.full(len(w), truth["F"], dtype=complex) for name in model.inputs}
    return model.predict(values, np.array(w, dtype=float), inputs)[model.outputs[0]]


def _amplitudes(name: str, w: Sequence[float], found: ComplexArray) -> dict[str, float]:
    """Real and imaginary parts of an amplitude at some frequencies."""
    parts: dict[str, float] = {}
    for omega, value in zip(w, found.tolist(), strict=True):
        parts |= {
            f"Re {name} at omega = {omega:g}": value.real,
            f"Im {name} at omega = {omega:g}": value.imag,
        }
    return parts


# Section 1.8 and lesson 6: a feedback system, T0 = 1, T1 = 0.5, T2 = 0.8, K = 10, H = 1


def _feedback() -> ComplexArray:
    """The amplitude S at omega = 1 and 2."""
    return _predicted(_model("task_6_1"), {"T1": 0.5, "T2": 0.8, "F": 1.0}, (1.0, 2.0))


def _feedback_1_8() -> list[Row]:
    amplitudes = _amplitudes("S", (1.0, 2.0), _feedback())
    re_1, im_1, re_2, im_2 = (BOOK.number(SECTION, quantity) for quantity in amplitudes)
    signals = {"S": np.array([complex(re_1, im_1), complex(re_2, im_2)]), "F": np.ones(2, dtype=complex)}
    tests = Experiments(("1", "2"), np.array([1.0, 2.0]), signals, np.zeros(2, dtype=bool))
    matrix, right, _ = build_rows(_model("task_6_1"), tests).real_rows()
    numbers: dict[str, float] = {f"K({i + 1},{j + 1})": x for (i, j), x in np.ndenumerate(matrix)}
    numbers |= {f"Y({i + 1})": value for i, value in enumerate(right)}
    task = _identified("section_1_8")
    numbers["largest error, %"] = _worst(task, "T1", "T2")
    return [*BOOK.rows(SECTION, amplitudes | numbers), *_estimates(SECTION, task, ("", ""))]


def _feedback_6(task_1: Task, task_2: Task) -> list[Row]:
    first, second = "[S] task 6.1", "[S] task 6.2"
    S = _feedback()
    at_2 = complex(S[1])
    said = {
        **_amplitudes("S", (1.0,), S[:1]),
        "Re S at omega = 2, table": at_2.real,
        "Re S at omega = 2, calculation": at_2.real,
        "Im S at omega = 2": at_2.imag,
    }
    return [
        *BOOK.rows(first, said | {"rounding of the data, %": _rounding(task_1, "S", S)}),
        *_estimates(first, task_1, (", s", ", s")),
        *BOOK.rows(first, {f"error of {name}, %": _worst(task_1, name) for name in ("T1", "T2")}),
        *_estimates(second, task_2, ("", ", s")),
        *BOOK.rows(second, {"K, in the text": task_2[0].value("K")}),
        *BOOK.rows(second, {f"error of {name}, %": _worst(task_2, name) for name in ("K", "T1")}),
    ]


# Lesson 5: one mass, and the rotor of a pump


def _one_mass(task: Task) -> list[Row]:
    source = "[S] task 5.1"
    w = (10.0, 20.0, 30.0)
    X = _predicted(task[0].model, {**task[1]["truth"], "F": 10.0}, w)
    said = _amplitudes("X", w, X) | {"rounding of the data, %": _rounding(task, "X", X)}
    said["largest error, %"] = _worst(task, "c", "alpha")
    return [*BOOK.rows(source, said), *_estimates(source, task, (", N/m", ", kg/s"))]


def _pump(task: Task) -> list[Row]:
    source = "[S] task 5.2"
    w = (80.0, 100.0)
    Z = _predicted(task[0].model, {**task[1]["truth"], "F": 0.0}, w)
    said = _amplitudes("Z", w, Z) | {
        "Re Z at omega = 80, calculation": Z[0].real,
        "c, N/m, in the text": task[0].value("c"),
        "b, kg/s, in the text": task[0].value("b"),
        "largest error, %": _worst(task, "c", "b"),
    }
    return [*BOOK.rows(source, said), *_estimates(source, task, (", N/m", ", kg/s"))]


# Lesson 7: a chain of three masses


def _chain(task_1: Task, task_2: Task) -> list[Row]:
    first, second = "[S] task 7.1", "[S] task 7.2"
    result, expected = task_1
    truth = np.array([expected["truth"][name] for name in result.parameters])
    squares = _squares(result.model, truth)
    data = result.experiments.frequencies**2
    direct = {f"omega{i}^2, 1/s^2": z for i, z in enumerate(squares, start=1)}
    direct |= {f"omega{i}^2 rounded, 1/s^2": z for i, z in enumerate(squares, start=1)}
    direct["rounding of the data, %"] = 100 * np.abs(data / squares - 1).max()
    shapes = _shapes(result.model, truth, (1, 2), (150.0, 690.0, 2400.0))
    for name, values in zip(("A2", "A3"), shapes, strict=True):
        direct |= {f"{name}, mode {k}": value for k, value in enumerate(values, start=1)}
    direct["c3 of the direct problem, N/m"] = result.value("c3")
    stiffness = (", N/m",) * 3
    return [
        *BOOK.rows(first, direct),
        *_estimates(first, task_1, stiffness),
        *BOOK.rows(first, {"largest error, %": _worst(task_1, "c1", "c2", "c3")}),
        *_estimates(second, task_2, (*stiffness, ", kg", ", kg")),
        *BOOK.rows(second, {"largest error of a mass, %": _worst(task_2, "m2", "m3")}),
    ]


# Lesson 8: a beam with two masses in compliance form


def _beam(task_1: Task, task_2: Task) -> list[Row]:
    first, second = "[S] task 8.1", "[S] task 8.2"
    result, expected = task_1
    truth = np.array([expected["truth"][name] for name in result.parameters])
    z = _squares(result.model, truth)
    shaft = beam()
    delta = fem.compliance(shaft, (4, 7))
    (A2,) = _shapes(result.model, truth, (1,), (2.183e6, 4.581e7))
    direct = {
        "EI, N m^2": (shaft.youngs_modulus * shaft.second_moment)[0],
        "delta11, m/N": delta[0, 0],
        "delta22, m/N": delta[1, 1],
        "delta12, m/N": delta[0, 1],
        "omega1^2, 1/s^2": z[0],
        "omega2^2, 1/s^2": z[1],
        "omega1^2 rounded, 1/s^2": z[0],
        "omega2^2 rounded, 1/s^2": z[1],
        "A2, mode 1": A2[0],
        "A2, mode 2": A2[1],
    }
    errors = {
        "largest error of a mass, %": _worst(task_2, "m1", "m2"),
        "largest error of a stiffness, %": _worst(task_2, "c1", "c2"),
    }
    return [
        *BOOK.rows(first, direct),
        *_estimates(first, task_1, (", N/m", ", N/m")),
        *BOOK.rows(first, {"largest error, %": _worst(task_1, "c1", "c2")}),
        *_estimates(second, task_2, (", kg", ", kg", ", N/m", ", N/m")),
        *BOOK.rows(second, errors),
    ]


def _model(folder: str) -> HarmonicModel:
    return exercise(folder)[1].model


def _squares(model: HarmonicModel, values: FloatArray) -> FloatArray:
    """Squares of the natural frequencies."""
    return natural_modes(model.dynamic_stiffness(values)[0])[0]


def _shapes(
    model: HarmonicModel, values: FloatArray, equations: Sequence[int], squares: Sequence[float]
) -> list[FloatArray]:
    """Amplitudes of the other masses where that of the first is 1, from some of the equations only.

    As the book does it: at rounded frequencies not all equations can hold.
    """
    given = dict(zip(model.parameters, map(float, values), strict=True))
    texts = [model.equations[i] for i in equations]
    stand = [name for name in model.parameters if any(name in text for text in texts)]
    known = {**model.known, **{name: value for name, value in given.items() if name not in stand}}
    part = harmonic_model(texts, known=known, estimate=stand, inputs=["X1"])
    w = np.sqrt(np.array(squares))
    found = part.predict(np.array([given[name] for name in stand]), w, {"X1": np.ones(len(w), dtype=complex)})
    return [found[name].real for name in part.outputs]


def beam() -> fem.Rotor:
    """The steel beam of 1 m length and 0.1 m diameter on rigid supports; the masses are at nodes 4 and 7."""
    supports = [fem.Support(node, 1e18) for node in (1, 11)]
    return fem.Rotor(np.full(10, 0.1), np.full(10, 0.1), supports=supports)
