"""Parameters from time records: [Q] tables 2.1 to 2.3 with its normal equations, and the three masses of [F].

The tables of [Q] are its record, and the states and parameters of each step of its quasilinearization with
the integrator "sequential-heun". Of [F] every number is compared whose time is known.
"""

import math

import numpy as np

from book.printed import below, read
from rotorid.files import read_ode_model, read_record
from rotorid.identify.fit_records import fit
from rotorid.identify.ode import ode_model
from rotorid.identify.quasilinearization import linear_solutions
from rotorid.identify.record_least_squares import RTOL, Problem
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate
from rotorid.regression import solution
from rotorid.samples import sample_data

THETA = ("theta1", "theta2", "theta3")
C = np.array([[1.0, 2.0], [2.0, 1.0]])
"""[Q] (2.25): y = C x."""
RESTORED = ", sign restored"
CHAIN = sample_data() / "fit" / "three_masses"
TIMES = np.arange(251) / 5
BETA = ("c1, N/m", "m1, kg", "m2, kg")


def quasilinearization():
    """[Q] (2.2), (2.5), (2.6), with the input u = cos t as a third output."""
    model = ode_model(
        {"x1": "theta1*x2", "x2": "theta2*x1 + theta3*x2 + cos(t)"},
        initial={"x1": 1.5, "x2": 1.0},
        outputs={"y1": "x1 + 2*x2", "y2": "2*x1 + x2", "u": "cos(t)"},
        estimate=dict.fromkeys(THETA, 0.0),
    )
    truth = simulate(model, (1.0, -1.0, -1.0), np.linspace(0.0, math.pi, 31), sensitivities=False)
    record = Record(truth.t, {"y1": truth.y[:, 0], "y2": truth.y[:, 1]})
    columns = dict(zip(("t", "x1", "x2", "y1", "y2", "u"), (truth.t, *truth.x.T, *truth.y.T), strict=True))
    found = below("[Q] table 2.1", {f"{n}({j + 1})": x[j] for n, x in columns.items() for j in range(16, 31)})
    found |= _iterations(model, record)
    found |= below("[Q] (2.36), regression found by agreement", _differences(truth))
    estimates = fit(model, record, method="quasilinearization").values
    return _signed(found | below("[Q] (2.11), from the record", dict(zip(THETA, estimates, strict=True))))


def _signed(computed):
    """By the quantities of the table, which say where a lost sign is restored."""
    names = {(source, q.removesuffix(RESTORED)): q for source, q in read("q_tables.csv")}
    upper = {
        key for key in computed if key not in names and "M(" in key[1]
    }  # printed by their upper triangle
    return {(key[0], names.get(key, key[1])): x for key, x in computed.items() if key not in upper}


def _iterations(model, record):
    """States, parameters and normal equations of each iteration; the first trajectory is that of θ = 0."""
    done = fit(model, record, method="quasilinearization", integrator="sequential-heun")
    problem = Problem(model, (record,), "sequential-heun", RTOL)
    found = {}
    for k, (theta, (x,)) in enumerate(zip(done.history[:7], done.trajectories[:7], strict=True)):
        if k < 6:
            states = {f"x{i + 1}({j + 1}), iteration {k}": value for (j, i), value in np.ndenumerate(x)}
            found |= below("[Q] table 2.2", states)
        values = {f"{name}, iteration {k}": value for name, value in zip(THETA, theta, strict=True)}
        found |= below("[Q] table 2.3", values)
        found |= below(f"[Q] (2.{29 + k})", _normal_equations(problem, theta, x))
    return found


def _normal_equations(problem, theta, x):
    """[Q] (2.25) to (2.28): M and Y of M θ = Y, from the equations linearised about a trajectory (31, 2)."""
    record = problem.records[0]
    table = linear_solutions(problem.model, theta, record, x, "sequential-heun")
    seen = C @ table
    F = seen[..., 1:].reshape(-1, 3)
    y = np.column_stack(list(record.outputs.values())) - seen[..., 0]
    M, Y = F.T @ F, F.T @ (y.ravel() + F @ theta)
    numbers = {f"M({i + 1},{j + 1})": value for (i, j), value in np.ndenumerate(M)}
    return numbers | {f"Y({i + 1})": value for i, value in enumerate(Y)}


def _differences(truth):
    """[Q] (2.36): the parameters among the coefficients of the differences of table 2.1, all of them free.

    The print does not say how they were computed. With the states and the input as table 2.1 has them, to
    four digits, these regressions of the forward differences on both states and the input repeat all three.
    """
    table = np.array([[float(f"{v:.3e}") for v in row] for row in np.column_stack((truth.x, truth.y[:, 2]))])
    on_x1, on_x2, _ = solution(table[:-1], np.diff(table[:, :2], axis=0) / np.diff(truth.t)[:, None])
    return dict(zip(THETA, (on_x2[0], on_x1[1], on_x2[1]), strict=True))


def three_masses():
    """The printed record at c1 = 0.14, m1 = 12, m2 = 28, and what fits find from it and the whole one."""
    chain = read_ode_model(CHAIN / "model.toml")
    started = read_ode_model(CHAIN / "from_record.toml")
    exact = simulate(chain, (0.14, 12.0, 28.0), TIMES, sensitivities=False)
    numbers = {row.quantity: exact.y[at, chain.outputs.index(state)] for row, state, at in _places()}
    intact = intact_record()
    fits = {
        "[F] from the intact printed values": fit(chain, intact),
        "[F] the same, steps 1 to 5": fit(started, intact, method="gauss-newton", integrator="rk4"),
        "[F] record of five digits, recomputed": fit(chain, read_record(CHAIN / "record.csv", chain)),
    }
    found = below("[F] record", numbers)
    for source, fitted in fits.items():
        found |= below(source, dict(zip(BETA, fitted.values[:3], strict=True)))
    errors = {f"standard error of {name}": s for name, s in zip(BETA, fitted.std, strict=True)}
    return found | below("[F] record of five digits, recomputed", errors)


def _places():
    """Rows of the record with state and sample, of "y1(0.6 s)", where they are known."""
    for (source, quantity), row in read("f_record.csv").items():
        if source == "[F] record" and row.kind != "not compared":
            state, _, time = quantity.partition("(")
            yield row, state, round(5 * float(time.partition(" ")[0]))


def intact_record():
    """The intact printed values; the errors are those of rounding, uniform within half a unit."""
    places = [place for place in _places() if not place[0].erratum]
    names = dict.fromkeys(state for _, state, _ in places)
    values = {name: np.full(len(TIMES), np.nan) for name in names}
    sigma = {name: np.ones(len(TIMES)) for name in names}
    for row, state, at in places:
        value = float(row.printed)
        values[state][at] = value
        sigma[state][at] = float(f"5e{math.floor(math.log10(abs(value))) - 5}") / math.sqrt(3)
    return Record(TIMES, values, sigma=sigma, name="f_record.csv")
