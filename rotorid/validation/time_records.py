"""Identification from time records, [Q] tables 2.1 to 2.3 with its text, and the three masses of [F].

The tables of [Q] are its record, and the states and parameters of each step of its quasilinearization with
the integrator "sequential-heun"; its text has the normal equations of each step. Of [F] the intact part of
the printed record is compared, and what a fit finds from it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.regression import solution
from rotorid.samples import sample_data
from rotorid.tables import read_ode_model
from rotorid.timedomain import OdeModel, Record, Trajectory, ode_model, simulate
from rotorid.timedomain.fit import fit
from rotorid.timedomain.methods.least_squares_problem import RTOL, Problem
from rotorid.timedomain.methods.quasilinearization import linear_solutions
from rotorid.validation.row import Kind, Printed, Row, half_unit, number, printed_table, row

TRUTH_Q = (1.0, -1.0, -1.0)
TRUTH_F = (0.14, 12.0, 28.0)
PARAMETERS_Q = ("theta1", "theta2", "theta3")
PARAMETERS_F = ("c1, N/m", "m1, kg", "m2, kg")
OUTPUTS = np.array([[1.0, 2.0], [2.0, 1.0]])
"""[Q] (2.25): y = C x."""
BOOK = Printed("q_iterations.csv")
RESTORED = ", sign restored"

GIVEN = re.compile(r"[tu]\(\d+\)|x\d\(1\), .*|x1.*, iteration 0|theta\d, iteration 0|.*\(0\.0 s\).*")
"""Times, inputs and starting values: quantities that are computed from nothing."""

EXACT = "tighter than half a unit: the record is exact to ten digits, and so is the estimate"
ZEROS = "the print drops trailing zeros: half a unit of the fifth significant digit"
ROUNDED = "three standard errors that the rounding of the printed values leaves"
FROM_PRINT = {"c1, N/m": 3e-6, "m1, kg": 6e-5, "m2, kg": 1.2e-5}
BY_STEPS = {"c1, N/m": 5e-6, "m1, kg": 1.1e-4, "m2, kg": 9e-5}


def rows() -> list[Row]:
    """All rows of [Q] and [F].

    Returns
    -------
    list of Row
        90 of table 2.1, 372 of table 2.2, 21 of table 2.3, 65 of the normal equations, 3 of differences and 3
        of the parameters of the record of [Q]; 383 of the record of [F], 6 of its estimates.
    """
    model = _book_model()
    truth = simulate(model, TRUTH_Q, np.linspace(0.0, math.pi, 31), sensitivities=False)
    record = Record(truth.t, {"y1": truth.y[:, 0], "y2": truth.y[:, 1]})
    chain = read_ode_model(sample_data() / "fit" / "three_masses" / "model.toml")
    made = [
        *_table_2_1(truth),
        *_iterations(model, record),
        *_differences(truth),
        *_parameters_of_the_record(model, record),
        *_printed_record(chain),
        *_estimates(chain),
    ]
    return [replace(r, kind=_kind(r)) for r in made]


def _kind(r: Row) -> Kind:
    """Given, or selected: of [F] only what agrees is known to be intact."""
    return "given" if GIVEN.fullmatch(r.quantity) else "selected" if r.source.startswith("[F]") else r.kind


def _book_model() -> OdeModel:
    """[Q] (2.2), (2.5), (2.6), with the input u = cos t as a third output."""
    return ode_model(
        {"x1": "theta1*x2", "x2": "theta2*x1 + theta3*x2 + cos(t)"},
        initial={"x1": 1.5, "x2": 1.0},
        outputs={"y1": "x1 + 2*x2", "y2": "2*x1 + x2", "u": "cos(t)"},
        estimate=dict.fromkeys(PARAMETERS_Q, 0.0),
    )


def _table_2_1(truth: Trajectory) -> list[Row]:
    """The record: times, states, outputs and input at the true parameters."""
    columns = {
        "t": truth.t,
        "x1": truth.x[:, 0],
        "x2": truth.x[:, 1],
        "y1": truth.y[:, 0],
        "y2": truth.y[:, 1],
        "u": truth.y[:, 2],
    }
    return [
        row("[Q] table 2.1", f"{name}({line['j']})", line[name], float(values[int(line["j"]) - 1]))
        for line in printed_table("q_table_2_1.csv")
        for name, values in columns.items()
    ]


def _iterations(model: OdeModel, record: Record) -> list[Row]:
    """States, parameters and normal equations of each iteration; the first trajectory is that of θ = 0."""
    found = fit(model, record, method="quasilinearization", integrator="sequential-heun")
    problem = Problem(model, (record,), "sequential-heun", RTOL)
    steps = list(zip(found.history[:7], (x for (x,) in found.trajectories), strict=False))
    states = {
        f"x{i + 1}({j + 1}), iteration {k}": float(value)
        for k, (_, x) in enumerate(steps[:6])
        for (j, i), value in np.ndenumerate(x)
    }
    parameters = {
        f"{name}, iteration {k}": value
        for k, (theta, _) in enumerate(steps)
        for name, value in zip(PARAMETERS_Q, theta.tolist(), strict=True)
    }
    made = [*_beside("[Q] table 2.2", states), *_beside("[Q] table 2.3", parameters)]
    for s, (theta, x) in enumerate(steps):
        made += _beside(f"[Q] (2.{29 + s})", _normal_equations(problem, theta, x))
    return made


def _normal_equations(problem: Problem, theta: FloatArray, x: FloatArray) -> dict[str, float]:
    """[Q] (2.25) to (2.28): M and Y of M θ = Y, from the equations linearised about a trajectory (31, 2)."""
    table, _ = linear_solutions(problem, theta, lambda _: x, 0)
    seen = OUTPUTS @ table
    F = seen[..., 1:].reshape(-1, 3)
    y = np.column_stack(list(problem.records[0].outputs.values())) - seen[..., 0]
    Y = F.T @ (y.ravel() + F @ theta)
    return {
        **{f"M({i + 1},{j + 1})": float(value) for (i, j), value in np.ndenumerate(F.T @ F)},
        **{f"Y({i + 1})": value for i, value in enumerate(Y.tolist())},
    }


def _differences(truth: Trajectory) -> list[Row]:
    """[Q] (2.36): the parameters among the coefficients of the differences of table 2.1, all of them free.

    The print does not say how they were computed. With the states and the input as table 2.1 has them, to
    four digits, these regressions of the forward differences on both states and the input repeat all three.
    """
    printed = [
        [float(f"{value:.3e}") for value in (*x, u)] for x, u in zip(truth.x, truth.y[:, 2], strict=True)
    ]
    table = np.array(printed)
    slopes = np.diff(table[:, :2], axis=0) / np.diff(truth.t)[:, None]
    on_x1, on_x2, _ = solution(table[:-1], slopes)
    values = (on_x2[0], on_x1[1], on_x2[1])
    return _beside(
        "[Q] (2.36), regression found by agreement", dict(zip(PARAMETERS_Q, map(float, values), strict=True))
    )


def _beside(source: str, computed: Mapping[str, float]) -> list[Row]:
    """Every printed number of a source; what was not computed is not finite."""
    quantities = [quantity for given, quantity in BOOK.lines if given == source]
    return BOOK.rows(source, {q: computed.get(q.removesuffix(RESTORED), math.nan) for q in quantities})


def _parameters_of_the_record(model: OdeModel, record: Record) -> list[Row]:
    """With error control the same method finds the parameters that made the record."""
    found = fit(model, record, method="quasilinearization")
    return [
        row("[Q] parameters of the record", name, f"{value:.0f}", estimate, 1e-8, EXACT)
        for name, value, estimate in zip(PARAMETERS_Q, TRUTH_Q, found.values.tolist(), strict=True)
    ]


def _printed_record(chain: OdeModel) -> list[Row]:
    """The intact part of the printed record at c1 = 0.14, m1 = 12, m2 = 28."""
    lines = printed_table("f_record.csv")
    trajectory = simulate(chain, TRUTH_F, _times(), sensitivities=False)
    made = []
    for line in lines:
        text, state = line["value"], line["state"]
        computed = trajectory.y[round(5 * float(line["t_s"])), chain.outputs.index(state)]
        sign = RESTORED if state == "y2" else ""
        fifth = fifth_digit(text)
        wide = (fifth, ZEROS) if fifth < half_unit(text) else (None, "")
        made.append(row("[F] record", f"{state}({line['t_s']} s){sign}", text, float(computed), *wide))
    return made


def _estimates(chain: OdeModel) -> list[Row]:
    """Estimates from the printed values alone; by the steps of [F] with y(t0) from the record, too."""
    started = read_ode_model(sample_data() / "fit" / "three_masses" / "from_record.toml")
    by_steps = fit(started, _intact(), method="gauss-newton", integrator="rk4")
    found = (
        ("[F] from the intact printed values", fit(chain, _intact()), FROM_PRINT),
        ("[F] the same, steps 1 to 5", by_steps, BY_STEPS),
    )
    return [
        row(source, name, f"{value:g}", estimate, wide[name], ROUNDED)
        for source, fitted, wide in found
        for name, value, estimate in zip(PARAMETERS_F, TRUTH_F, fitted.values[:3].tolist(), strict=True)
    ]


def _times() -> FloatArray:
    """0 to 50 s, step 0.2 s; shape (251,)."""
    return np.arange(251) / 5


def _intact() -> Record:
    """The intact printed values; the errors are those of rounding, uniform within half a unit."""
    t = _times()
    lines = printed_table("f_record.csv")
    names = dict.fromkeys(line["state"] for line in lines)
    values = {name: np.full(len(t), np.nan) for name in names}
    sigma = {name: np.ones(len(t)) for name in names}
    for line in lines:
        at = round(5 * float(line["t_s"]))
        values[line["state"]][at] = number(line["value"])
        sigma[line["state"]][at] = fifth_digit(line["value"]) / math.sqrt(3)
    return Record(t, values, sigma=sigma, name="f_record.csv")


def fifth_digit(text: str) -> float:
    """Half a unit of the fifth significant digit of a printed number other than 0.

    Examples
    --------
    >>> fifth_digit("0.3276"), fifth_digit("-0.0843")
    (5e-06, 5e-07)
    """
    return float(f"5e{math.floor(math.log10(abs(number(text)))) - 5}")
