"""Estimation of coefficients, [S] section 1.8 and tasks 5.1 to 8.2: direct problems and estimates.

The models, the data and the printed estimates are those of `sample_data/identify`, a folder each. The direct
problems, whose rounded results are the data, are computed with the parameters that the book states.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

import fem
from rotorid.base.arrays import ComplexArray, FloatArray
from rotorid.harmonic import Experiments, HarmonicModel, Identification, harmonic_model, identify
from rotorid.harmonic.natural import natural_modes
from rotorid.harmonic.rows import build_rows
from rotorid.samples import sample_data
from rotorid.tables import read_harmonic_model, read_measurements
from rotorid.validation.row import Row, number, row

SECTION = "[S] section 1.8"
TASKS = ("5_1", "5_2", "6_1", "6_2", "7_1", "7_2", "8_1", "8_2")
TWICE = "rounded twice: 0.1946 became 0.195, and that 0.20"
TABLE_6_1 = "the table prints -0.31, the calculation uses -0.37"
STIFFNESS = "the frequencies and shapes that the book computes from it are those of 5e3"
EI = "0.36*0.16/(3*1.03e6) is 0.1864e-7; the book goes on with 0.0187e-6"
CUT = "one unit of the last digit: 4.5817e7 is cut to 4.581e7, not rounded"
DIGITS = "20 digits are printed; double precision holds 15"
NAUGHT = "0 is exact at this frequency, and a half unit of it would be no test"


def rows() -> list[Row]:
    """All rows of the lessons."""
    found = {task: _identified(f"task_{task}") for task in TASKS}
    return [
        *_feedback_1_8(),
        *_one_mass(found["5_1"]),
        *_pump(found["5_2"]),
        *_feedback_6(found["6_1"], found["6_2"]),
        *_chain(found["7_1"], found["7_2"]),
        *_beam(found["8_1"], found["8_2"]),
    ]


def _identified(folder: str) -> tuple[Identification, Mapping[str, Any]]:
    """The exercise of a folder, identified, and what its `expected.toml` says."""
    path = sample_data() / "identify" / folder
    file = read_harmonic_model(path / "model.toml")
    expected = tomllib.loads((path / "expected.toml").read_text(encoding="utf-8"))
    return identify(file.model, read_measurements(path / "data.csv", file)), expected


def _estimates(
    source: str, task: tuple[Identification, Mapping[str, Any]], units: Sequence[str]
) -> list[Row]:
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


def _worst(task: tuple[Identification, Mapping[str, Any]], *names: str) -> float:
    """Largest error of the estimates, percent of the parameters of the direct problem."""
    result, expected = task
    return 100 * max(abs(result.value(name) / float(expected["truth"][name]) - 1) for name in names)


def _predicted(model: HarmonicModel, truth: Mapping[str, float], w: Sequence[float]) -> ComplexArray:
    """Amplitude of the only output for a force of 10 or 1, given in `truth` as "F"."""
    values = np.array([truth[name] for name in model.parameters])
    inputs = {name: np.full(len(w), truth["F"], dtype=complex) for name in model.inputs}
    return model.predict(values, np.array(w, dtype=float), inputs)[model.outputs[0]]


def _amplitudes(
    source: str, name: str, w: Sequence[float], found: ComplexArray, printed: Sequence[tuple[str, str]]
) -> list[Row]:
    """Real and imaginary parts of an amplitude at some frequencies; "" is left to the caller."""
    rows = []
    for omega, value, pair in zip(w, found, printed, strict=True):
        for part, computed, text in zip(("Re", "Im"), (value.real, value.imag), pair, strict=True):
            quantity = f"{part} {name} at omega = {omega:g}"
            if text == "0":
                rows.append(row(source, quantity, text, float(computed), 1e-12, NAUGHT))
            elif text:
                rows.append(row(source, quantity, text, float(computed)))
    return rows


# Section 1.8 and lesson 6: a feedback system, T0 = 1, T1 = 0.5, T2 = 0.8, K = 10, H = 1


def _feedback_1_8() -> list[Row]:
    model = _model("task_6_1")
    w = (1.0, 2.0)
    exact = _predicted(model, {"T1": 0.5, "T2": 0.8, "F": 1.0}, w)
    texts = (("-0.041", "0.093"), ("-0.368", "0.195"))
    found = _amplitudes(SECTION, "S", w, exact, texts)
    rounded = np.array([complex(number(re), number(im)) for re, im in texts])
    signals = {"S": rounded, "F": np.ones(2, dtype=complex)}
    tests = Experiments(("1", "2"), np.array(w), signals, np.zeros(2, dtype=bool))
    matrix, right, _ = build_rows(model, tests).real_rows()
    printed = (("-0.052", "1.1"), ("-1.1", "-0.052"), ("1.1", "7.0"), ("-3.5", "2.2"))
    for i, texts_of_row in enumerate(printed):
        for j, text in enumerate(texts_of_row):
            found.append(row(SECTION, f"K({i + 1},{j + 1})", text, float(matrix[i, j])))
    for i, text in enumerate((".41", "-.93", "3.7", "-2.0")):
        found.append(row(SECTION, f"Y({i + 1})", text, float(right[i])))
    task = _identified("section_1_8")
    found += _estimates(SECTION, task, ("", ""))
    found.append(row(SECTION, "largest error, %", "3", _worst(task, "T1", "T2")))
    return found


def _feedback_6(
    task_1: tuple[Identification, Mapping[str, Any]], task_2: tuple[Identification, Mapping[str, Any]]
) -> list[Row]:
    source = "[S] task 6.1"
    w = (1.0, 2.0)
    S = _predicted(_model("task_6_1"), {"T1": 0.5, "T2": 0.8, "F": 1.0}, w)
    found = _amplitudes(source, "S", w, S, (("-0.041", "0.093"), ("", "")))
    real, imaginary = float(S[1].real), float(S[1].imag)
    found += [
        row(source, "Re S at omega = 2, table", "-0.31", real, erratum=TABLE_6_1, corrected="-0.37"),
        row(source, "Re S at omega = 2, calculation", "-.37", real),
        row(source, "Im S at omega = 2", "0.20", imaginary, 0.0055, TWICE),
        *_estimates(source, task_1, (", s", ", s")),
        row(source, "error of T1, %", "1.2", _worst(task_1, "T1")),
        row(source, "error of T2, %", "1", _worst(task_1, "T2")),
    ]
    source = "[S] task 6.2"
    return [
        *found,
        *_estimates(source, task_2, ("", ", s")),
        row(source, "error of K, %", "1", _worst(task_2, "K")),
        row(source, "error of T1, %", "1.2", _worst(task_2, "T1")),
    ]


# Lesson 5: one mass, and the rotor of a pump


def _one_mass(task: tuple[Identification, Mapping[str, Any]]) -> list[Row]:
    source = "[S] task 5.1"
    w = (10.0, 20.0, 30.0)
    X = _predicted(task[0].model, {**task[1]["truth"], "F": 10.0}, w)
    texts = (("0", "-0.1"), ("-3.3e-3", "-2.2e-4"), ("-1.2e-3", "-4.7e-5"))
    return [
        *_amplitudes(source, "X", w, X, texts),
        *_estimates(source, task, (", N/m", ", kg/s")),
        row(source, "largest error, %", "0.01", _worst(task, "c", "alpha")),
    ]


def _pump(task: tuple[Identification, Mapping[str, Any]]) -> list[Row]:
    source = "[S] task 5.2"
    w = (80.0, 100.0)
    Z = _predicted(task[0].model, {**task[1]["truth"], "F": 0.0}, w)
    zero = "99790 is 9.979e4 with a zero for the digit that is not printed"
    return [
        *_amplitudes(source, "Z", w, Z, (("1.4e-6", "-16e-6"), ("0", "-20e-6"))),
        row(source, "Re Z at omega = 80, calculation", "1.43e-6", float(Z[0].real)),
        *_estimates(source, task, (", N/m", ", kg/s")),
        row(source, "c, N/m, in the text", "99790", task[0].value("c"), erratum=zero, corrected="99791"),
        row(source, "b, kg/s, in the text", "9977", task[0].value("b")),
        row(source, "largest error, %", "0.23", _worst(task, "c", "b")),
    ]


# Lesson 7: a chain of three masses


def _chain(
    task_1: tuple[Identification, Mapping[str, Any]], task_2: tuple[Identification, Mapping[str, Any]]
) -> list[Row]:
    source = "[S] task 7.1"
    result, expected = task_1
    truth = np.array([expected["truth"][name] for name in result.parameters])
    z = _squares(result.model, truth)
    found = [
        row(source, f"omega{i + 1}^2, 1/s^2", text, float(z[i]))
        for i, text in enumerate(("150.823", "687.236", "2.412e3"))
    ]
    shapes = _shapes(result.model, truth, (1, 2), (150.0, 690.0, 2400.0))
    texts = (("1.346", "0.821", "-0.922"), ("1.923", "-2.161", "0.243"))
    for name, line, values in zip(("A2", "A3"), texts, shapes, strict=True):
        found += [row(source, f"{name}, mode {k + 1}", line[k], float(values[k])) for k in range(3)]
    stiffness = (", N/m",) * 3
    return [
        *found,
        row(
            source,
            "c3 of the direct problem, N/m",
            "5e4",
            result.value("c3"),
            erratum=STIFFNESS,
            corrected="5.0e3",
        ),
        *_estimates(source, task_1, stiffness),
        row(source, "largest error, %", "0.5", _worst(task_1, "c1", "c2", "c3")),
        *_estimates("[S] task 7.2", task_2, (*stiffness, ", kg", ", kg")),
        row("[S] task 7.2", "largest error of a mass, %", "1", _worst(task_2, "m2", "m3")),
    ]


# Lesson 8: a beam with two masses in compliance form


def _beam(
    task_1: tuple[Identification, Mapping[str, Any]], task_2: tuple[Identification, Mapping[str, Any]]
) -> list[Row]:
    source = "[S] task 8.1"
    result, expected = task_1
    truth = np.array([expected["truth"][name] for name in result.parameters])
    z = _squares(result.model, truth)
    delta = _compliance()
    found = [
        row(source, "delta11, m/N", ".143e-7", float(delta[0, 0])),
        row(source, "delta22, m/N", ".187e-7", float(delta[1, 1]), erratum=EI, corrected=".186e-7"),
        row(source, "delta12, m/N", ".146e-7", float(delta[0, 1])),
    ]
    for i, text in enumerate(("2182641.1576268901752", "45817128.427626566046")):
        exact = 1e-11 * number(text)
        found.append(row(source, f"omega{i + 1}^2, 1/s^2", text, float(z[i]), exact, DIGITS))
    (A2,) = _shapes(result.model, truth, (1,), (2.183e6, 4.581e7))
    return [
        *found,
        row(source, "omega1^2 rounded, 1/s^2", "2.183e6", float(z[0])),
        row(source, "omega2^2 rounded, 1/s^2", "4.581e7", float(z[1]), 1e4, CUT),
        row(source, "A2, mode 1", "1.208", float(A2[0])),
        row(source, "A2, mode 2", "-.414", float(A2[1])),
        *_estimates(source, task_1, (", N/m", ", N/m")),
        row(source, "largest error, %", "8", _worst(task_1, "c1", "c2")),
        *_estimates("[S] task 8.2", task_2, (", kg", ", kg", ", N/m", ", N/m")),
        row("[S] task 8.2", "largest error of a mass, %", "0.06", _worst(task_2, "m1", "m2")),
        row("[S] task 8.2", "largest error of a stiffness, %", "12", _worst(task_2, "c1", "c2")),
    ]


def _model(folder: str) -> HarmonicModel:
    return read_harmonic_model(sample_data() / "identify" / folder / "model.toml").model


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


def _compliance() -> FloatArray:
    """Compliances of the steel beam of 1 m length and 0.1 m diameter on two supports at 0.3 and 0.6 m."""
    supports = [fem.Support(node, 1e14) for node in (1, 11)]
    return fem.compliance(fem.Rotor(np.full(10, 0.1), np.full(10, 0.1), supports=supports), (4, 7))
