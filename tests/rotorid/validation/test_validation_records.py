"""The proof table of time records and of published balancing: its rows, its reasons, and wrong formulas."""

import dataclasses
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import balancing.coefficients.influence
import balancing.correction.correct
import rotorid.timedomain.integration.matrix_exponential
import rotorid.timedomain.integration.simulate
import rotorid.timedomain.methods.quasilinearization
from rotorid.validation import balancing as published
from rotorid.validation import time_records
from rotorid.validation.row import half_unit, number, printed_table

DATA = Path(__file__).parents[2] / "data"
PARAMETERS = printed_table("q_table_2_3.csv")


@pytest.fixture(scope="module")
def records():
    return time_records.rows()


@pytest.fixture(scope="module")
def examples():
    return published.rows()


@pytest.fixture(scope="module")
def every(records, examples):
    return [*records, *examples]


def statuses(rows):
    return Counter(r.status for r in rows)


# the rows


def test_rows_of_time_records(records):
    assert Counter(r.source for r in records) == {
        "[Q] table 2.1": 90,
        "[Q] table 2.2": 372,
        "[Q] table 2.3": 21,
        "[Q] parameters of the record": 3,
        "[F] record": 164,
        "[F] from the intact printed values": 3,
        "[F] the same, steps 1 to 5": 3,
    }
    assert statuses(records) == {"agrees": 656}


def test_rows_of_published_balancing(examples):
    assert Counter(r.source for r in examples) == {
        f"{published.NOTE}, two planes": 4,
        f"{published.NOTE}, one plane": 2,
        published.SIX: 12,
        published.FEESE: 4,
        published.GOODMAN: 2,
        published.FOILES: 16,
    }
    assert statuses(examples) == {"agrees": 36, "erratum": 4}
    errata = {(r.text, r.corrected): r.note.split(",")[0] for r in examples if r.status == "erratum"}
    assert errata == {
        ("21", "17.6"): "the reading 185 @ 115",
        ("140", "145"): "the reading 185 @ 115",
        ("37.9", "37.4"): "77 @ 104 less 53 @ 78 is 37.4",
        ("305", "310"): "the angle of this one weight is off",
    }


def test_no_row_stands_twice(every):
    assert max(Counter((r.source, r.quantity) for r in every).values()) == 1


def test_every_other_tolerance_has_its_reason_and_none_is_wide(every):
    for r in every:
        assert (r.tolerance == half_unit(r.text)) == (r.reason == ""), r
        if r.printed and r.reason:
            assert r.tolerance < 0.1 * abs(r.printed), r
    # apart from the two schemes of [Q] only eleven rows of balancing are wider than half a unit
    wide = Counter(r.reason.split(",")[0] for r in every if r.tolerance > half_unit(r.text))
    assert wide == {
        time_records.SCHEME.split(",")[0]: 4 * 30 * 2 + 5 * 3,
        "the print goes on with effects of two or three digits": 1,
        "the printed weights": 8,
        "the printed weights are whole ounces": 3,
        "a whole degree of an angle on which the largest amplitude hardly depends": 1,
    }


def test_the_first_trajectory_and_the_first_iteration_agree_to_every_printed_digit(records):
    first = [r for r in records if r.quantity.endswith(("iteration 0", "iteration 1")) and r.printed]
    assert len(first) == 4 * 31 + 3
    assert all(r.tolerance == half_unit(r.text) and r.status == "agrees" for r in first)


@pytest.mark.parametrize("name", ["table_2_2", "table_2_3"])
def test_the_tables_are_those_of_the_other_tests(name):
    own = [list(line.values())[1:] for line in printed_table(f"q_{name}.csv")]
    other = np.loadtxt(DATA / f"quasilinearization_{name}.csv", delimiter=",", skiprows=1)[:, 1:]
    np.testing.assert_array_equal([[number(text) for text in line] for line in own], other)
    # four significant digits each, as Fortran writes them
    assert {len(text.lstrip("-")) for line in own for text in line} <= {3, 10}


def test_the_intact_values_are_those_of_the_other_tests_and_more():
    own = {(line["t_s"], line["state"]): number(line["value"]) for line in printed_table("f_record.csv")}
    lines = [line for line in (DATA / "f_printed.csv").read_text().splitlines() if not line.startswith("#")]
    for line in lines[1:]:
        t, state, value, half = line.split(",")
        assert own.pop((t, state)) == float(value)
        if float(value):
            assert time_records.fifth_digit(value) == pytest.approx(float(half), rel=1e-12)
    assert {state for _, state in own} == {"y1"}
    assert len(own) == 63


# the reasons


def in_place(sequential):
    """Tables 2.2 and 2.3 by plain NumPy; `sequential` takes the new x1 for the recalculation of x2."""
    t = np.linspace(0, np.pi, 31)
    h, w, u = t[1], np.sqrt(3) / 2, np.cos(t)
    decay, c, s = np.exp(-t / 2), np.cos(w * t), np.sin(w * t)
    exact = np.stack(
        [np.sin(t) + decay * (1.5 * c + w * s), u + decay * ((w**2 - 0.75) * c - 2 * w * s)], axis=-1
    )
    C = np.array([[1.0, 2.0], [2.0, 1.0]])
    y = exact @ C.T
    x = np.stack([np.full(31, 1.5), 1 + h * (np.cumsum(u) - (u + u[0]) / 2)], axis=-1)
    theta, states, history = np.zeros(3), [x], [np.zeros(3)]
    for _ in range(6):
        A = np.array([[0, theta[0]], [theta[1], theta[2]]])
        slopes = np.array([[[x2, 0, 0], [0, x1, x2]] for x1, x2 in x])
        constant = np.stack([0 * u, u], axis=-1) - slopes @ theta
        B = np.concatenate([constant[..., None], slopes], axis=-1)
        table = np.zeros((31, 2, 4))
        table[0, :, 0] = 1.5, 1.0
        for i in range(30):
            before = A @ table[i] + B[i]
            new = table[i] + h * before
            first = new.copy()
            for k in (0, 1):
                source = new if sequential else first
                new[k] = table[i, k] + h / 2 * (before[k] + A[k] @ source + B[i + 1, k])
            table[i + 1] = new
        F = (C @ table[..., 1:]).reshape(62, 3)
        theta = np.linalg.lstsq(F, (y - table[..., 0] @ C.T).ravel(), rcond=None)[0]
        x = table @ np.append(1, theta)
        states.append(x)
        history.append(theta)
    return np.stack(states[:6], axis=1).reshape(31, 12), np.array(history)


def test_why_table_2_2_and_2_3_differ_from_heun(records):
    """The print uses the new x1 for x2: so its numbers return, but for its ill-conditioned second step."""
    theirs, parameters = in_place(True)
    own, own_parameters = in_place(False)
    by = {(r.source, r.quantity): r for r in records}
    misses, computed = np.empty((2, 31, 12)), np.empty((31, 12))
    for j in range(31):
        for column in range(12):
            r = by["[Q] table 2.2", f"x{column % 2 + 1}({j + 1}), iteration {column // 2}"]
            misses[:, j, column] = theirs[j, column] - r.printed, own[j, column] - r.printed
            computed[j, column] = r.computed
    np.testing.assert_allclose(computed, own, rtol=0, atol=1e-8)
    late = np.abs(misses[..., 4:]).max(axis=(1, 2))
    assert late[0] < 6e-4 < 2e-3 < late[1]
    # from iteration 3 on, where the problem is well conditioned, the printed digits return
    printed = np.array([[number(line[name]) for name in time_records.PARAMETERS_Q] for line in PARAMETERS])
    half = np.array([[half_unit(line[name]) for name in time_records.PARAMETERS_Q] for line in PARAMETERS])
    assert (np.abs(parameters - printed)[3:] <= half[3:]).all()
    assert (np.abs(own_parameters - printed)[3:] > half[3:]).sum() >= 8


def largest(texts, limit=None):
    """Largest amplitude that weights leave in the example of Foiles, Allaire and Gunter."""
    lines = printed_table("foiles_min_max.csv")
    W = np.array([[published._polar(line[f"plane_{p}"]) for p in range(1, 5)] for line in lines])
    Y = np.array([published._polar(line["initial"]) for line in lines])
    weights = published._foiles(limit).weights if texts is None else [published._polar(t) for t in texts]
    return round(float(np.abs(Y + W @ np.array(weights)).max()), 1)


def test_what_the_reasons_of_the_min_max_example_say():
    assert largest(["4.42@88", "2.92@352", "1.588@322", "1.928@304"]) == 71.1
    assert largest(None) == 69.9
    limited = ["3.402@91", "2.325@354", "1.361@318"]
    assert [largest([*limited, f"1.786@{angle}"]) for angle in (305, 309)] == [75.8, 73.7]
    assert largest(None, 3.402) == 72.9
    ounce = 0.028349523125
    for text in (*limited, "1.786@305"):
        weight = float(text.partition("@")[0])
        assert abs(weight / ounce - round(weight / ounce)) < 0.02
    reason = "the printed weights are whole ounces"
    (half,) = {r.tolerance for r in published.rows() if r.reason == reason}
    assert half == pytest.approx(ounce / 2, rel=1e-3)


def test_what_the_reason_of_example_6_says():
    initial = published._polar("170@112")
    effect = published._polar("189@115") - initial
    assert round(abs(effect), 1) == 21.2
    assert round(np.degrees(np.angle(effect)), 1) == 139.8
    for reading in ("185@115", "186@115"):
        assert round(abs(published._polar(reading) - initial)) in (18, 19)


# tampering


def test_wrong_influence_coefficients_are_noticed(monkeypatch):
    """Coefficients 1 % too large, the readings of the bare rotor right."""
    right = balancing.coefficients.influence.gain

    def wrong(matrix):
        found = right(matrix)
        return np.concatenate((found[:1], 1.01 * found[1:]))

    monkeypatch.setattr(balancing.coefficients.influence, "gain", wrong)
    rows = published.rows()
    differs = {(r.source, r.text) for r in rows if r.status == "differs"}
    assert {text for source, text in differs if source.startswith(published.NOTE)} >= {
        "2.951", "2.844", "2.012", "90", "37.9"
    }  # fmt: skip
    assert (published.FEESE, "15.3") in differs


def test_wrong_weights_are_noticed(monkeypatch):
    """Weights on the wrong side: D = +W⁻¹Y; every angle differs."""
    right = balancing.correction.correct.fit_weights

    def wrong(*args, **options):
        fitted = right(*args, **options)
        object.__setattr__(fitted, "weights", -fitted.weights)
        return fitted

    monkeypatch.setattr(balancing.correction.correct, "fit_weights", wrong)
    rows = published.rows()
    angles = [r for r in rows if r.quantity.endswith("angle, deg") and "effect" not in r.quantity]
    assert len(angles) == 2 + 1 + 2 + 2 + 4 + 4
    assert statuses(angles) == {"differs": 15}


def test_a_wrong_step_of_quasilinearization_is_noticed(monkeypatch):
    """Euler's step in place of Heun's."""

    def euler(model, theta, x, record, first):
        t = record.t
        u = np.zeros((len(t), 0))
        A = model.f_x(t, x, theta, u)
        b = model.f(t, x, theta, u) - np.einsum("tij,tj->ti", A, x)
        B = np.concatenate((b[..., None], model.f_theta(t, x, theta, u)), axis=-1)
        table = np.empty((len(t), *first.shape))
        table[0] = first
        for i, h in enumerate(np.diff(t)):
            table[i + 1] = table[i] + h * (A[i] @ table[i] + B[i])
        return table

    monkeypatch.setattr(rotorid.timedomain.methods.quasilinearization, "_heun", euler)
    found = statuses(time_records.rows())
    assert found["differs"] > 250
    assert found["agrees"] > 300


def test_a_wrong_runge_kutta_is_noticed(monkeypatch):
    """k4 at the middle of the step, too."""
    find = rotorid.timedomain.integration.simulate.find

    def wrong(system, now, then, z):
        h, k1 = then - now, system(now, z)
        k2 = system(now + h / 2, z + h / 2 * k1)
        return z + h / 6 * (k1 + 4 * k2 + system(now + h / 2, z + h / 2 * k2))

    def finding(methods, name, what):
        found = find(methods, name, what)
        if name != "rk4":
            return found
        return dataclasses.replace(
            found, function=rotorid.timedomain.integration.simulate._stepwise(name, wrong)
        )

    monkeypatch.setattr(rotorid.timedomain.integration.simulate, "find", finding)
    found = [r for r in time_records.rows() if r.status == "differs"]
    assert {r.source for r in found} == {"[F] the same, steps 1 to 5"}
    assert len(found) >= 2


def test_a_wrong_solution_in_time_is_noticed(monkeypatch):
    """A matrix exponential with time running 0.1 % fast."""
    right = rotorid.timedomain.integration.matrix_exponential.expm_and_derivatives

    def fast(matrices, derivatives):
        return right(1.001 * matrices, 1.001 * derivatives)

    monkeypatch.setattr(rotorid.timedomain.integration.matrix_exponential, "expm_and_derivatives", fast)
    found = [r for r in time_records.rows() if r.source.startswith("[F]")]
    differs = [r for r in found if r.status == "differs"]
    assert len(differs) > 150
