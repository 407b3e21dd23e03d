"""Identification from time records, [Q] tables 2.1 to 2.3 and the three masses of [F].

The tables of [Q] are its record, and the states and parameters of each step of its quasilinearization with
Heun's scheme. Of [F] the intact part of the printed record is compared, and what a fit finds from it.
"""

from __future__ import annotations

import math

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.samples import sample_data
from rotorid.tables import read_ode_model
from rotorid.timedomain import OdeModel, Record, Trajectory, ode_model, simulate
from rotorid.timedomain.fit import fit
from rotorid.validation.row import Row, half_unit, number, printed_table, row

TRUTH_Q = (1.0, -1.0, -1.0)
TRUTH_F = (0.14, 12.0, 28.0)
PARAMETERS_Q = ("theta1", "theta2", "theta3")
PARAMETERS_F = ("c1, N/m", "m1, kg", "m2, kg")

SCHEME = (
    "the print recalculates x2 with the recalculated x1, Heun's scheme both from the first guess; they are "
    "one in the first iteration only, where the equations are not coupled yet"
)
STATES = {2: 1e-3, 3: 3e-3, 4: 1e-3, 5: 6e-4}
"""How far the two schemes are apart in table 2.2, by iteration."""
PARAMETERS = 3e-3
"""The same in table 2.3."""
EXACT = "tighter than half a unit: the record is exact to ten digits, and so is the estimate"
START = "the iteration starts there, exactly"
ZEROS = "the print drops trailing zeros: half a unit of the fifth significant digit"
ROUNDED = "three standard errors that the rounding of the printed values leaves"
FROM_PRINT = {"c1, N/m": 3e-6, "m1, kg": 6e-5, "m2, kg": 1.2e-5}
BY_STEPS = {"c1, N/m": 5e-6, "m1, kg": 1.1e-4, "m2, kg": 9e-5}


def rows() -> list[Row]:
    """All rows of [Q] and [F].

    Returns
    -------
    list of Row
        90 of table 2.1, 372 of table 2.2, 21 of table 2.3, 3 of the parameters of the record of [Q]; 164 of
        the record of [F], 6 of its estimates.
    """
    model = _book_model()
    truth = simulate(model, TRUTH_Q, np.linspace(0.0, math.pi, 31), sensitivities=False)
    record = Record(truth.t, {"y1": truth.y[:, 0], "y2": truth.y[:, 1]})
    chain = read_ode_model(sample_data() / "fit" / "three_masses" / "model.toml")
    return [
        *_table_2_1(truth),
        *_tables_2_2_and_2_3(model, record),
        *_parameters_of_the_record(model, record),
        *_printed_record(chain),
        *_estimates(chain),
    ]


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


def _tables_2_2_and_2_3(model: OdeModel, record: Record) -> list[Row]:
    """States and parameters of each iteration; the first trajectory is Heun's solution at θ = 0."""
    found = fit(model, record, method="quasilinearization", integrator="heun")
    made = []
    for line in printed_table("q_table_2_2.csv"):
        j = int(line["j"])
        for k in range(6):
            x = found.trajectories[k][0][j - 1] if k < len(found.trajectories) else np.full(2, math.nan)
            for name, value in zip(("x1", "x2"), x, strict=True):
                text, wide = line[f"{name}_iteration_{k}"], STATES.get(k) if j > 1 else None
                quantity = f"{name}({j}), iteration {k}"
                made.append(row("[Q] table 2.2", quantity, text, float(value), wide, SCHEME if wide else ""))
    for line in printed_table("q_table_2_3.csv"):
        k = int(line["iteration"])
        theta = found.history[k] if k < len(found.history) else np.full(3, math.nan)
        for name, value in zip(PARAMETERS_Q, theta, strict=True):
            tolerance, reason = {0: (1e-12, START), 1: (None, "")}.get(k, (PARAMETERS, SCHEME))
            quantity = f"{name}, iteration {k}"
            made.append(row("[Q] table 2.3", quantity, line[name], float(value), tolerance, reason))
    return made


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
        sign = ", sign restored" if state == "y2" else ""
        fifth = fifth_digit(text)
        short = fifth < half_unit(text)
        quantity = f"{state}({line['t_s']} s){sign}"
        made.append(
            row(
                "[F] record",
                quantity,
                text,
                float(computed),
                fifth if short else None,
                ZEROS if short else "",
            )
        )
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
