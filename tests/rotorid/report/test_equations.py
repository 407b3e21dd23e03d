"""`--show equations`: rows as derived by hand, numbers as they were solved."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import sympy

from rotorid.commands.balance import BalanceOptions, balance
from rotorid.commands.fit import FitOptions, fit
from rotorid.commands.identify import identify
from rotorid.commands.reduce import ReduceOptions, reduce
from rotorid.files import read_harmonic_model
from rotorid.identify.expressions import parse
from rotorid.identify.integrators import written_out
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.identify.second_order import second_order
from rotorid.identify.simulation import simulate
from rotorid.report.equations import BEHIND, Row
from rotorid.samples import sample_data

IDENTIFY, FIT = sample_data() / "identify", sample_data() / "fit"
TASK_9 = sample_data() / "book_task_9"
TASKS = sorted(path.parent.name for path in IDENTIFY.glob("*/model.toml"))


def files(task):
    return IDENTIFY / task / "model.toml", sorted((IDENTIFY / task).glob("data*.csv"))[0]


def plain(name):
    """The name that a hand-derived row has: X1r, X1i, w."""
    name = name.replace(BEHIND, "").replace("ω", "w")
    return re.sub(r"^(Re|Im) (\w+)$", lambda found: found[2] + found[1][0].lower(), name)


def side(terms):
    total = sympy.Add(*(sympy.sympify(c) * sympy.sympify(factor) for c, factor in terms))
    return total.xreplace({symbol: sympy.Symbol(plain(symbol.name)) for symbol in total.free_symbols})


def same(row, text):
    """Whether both sides are those of this text, multiplied out."""
    sides = (parse(part) for part in text.split(" = "))
    return all(sympy.expand(side(a) - b) == 0 for a, b in zip((row.left, row.right), sides, strict=True))


CHAIN_RIGHT = (
    "F + (m1*w**2 - (c1 + c2))*X1r + c2*X2r",
    "(m1*w**2 - (c1 + c2))*X1i + c2*X2i",
    "c2*X1r + (m2*w**2 - c2)*X2r",
    "c2*X1i + (m2*w**2 - c2)*X2i",
)
CHAIN_DAMPERS = (
    "-w*X1i*a1 + w*(X2i - X1i)*a12",
    "w*X1r*a1 + w*(X1r - X2r)*a12",
    "w*(X1i - X2i)*a12 - w*X2i*a2",
    "w*(X2r - X1r)*a12 + w*X2r*a2",
)
CHAIN_SPRINGS = (
    "X1r*c1 + (X1r - X2r)*c2",
    "X1i*c1 + (X1i - X2i)*c2",
    "(X2r - X1r)*c2",
    "(X2i - X1i)*c2",
)
CHAIN_INERTIA = ("F + m1*w**2*X1r", "m1*w**2*X1i", "m2*w**2*X2r", "m2*w**2*X2i")
DERIVED = {
    # task 1.1 prints a third row with −ω X2i in the place of a1 and 0 in that of a2
    "task_1_1": [f"{left} = {right}" for left, right in zip(CHAIN_DAMPERS, CHAIN_RIGHT, strict=True)],
    "task_1_2": [
        f"{a} + {b} = {c}" for a, b, c in zip(CHAIN_SPRINGS, CHAIN_DAMPERS, CHAIN_INERTIA, strict=True)
    ],
    "task_2_1": [
        "-w**2*Xr*a1 - w*Xi*a2 + Xr*a3 = F - w**3*Xi",
        "-w**2*Xi*a1 + w*Xr*a2 + Xi*a3 = w**3*Xr",
    ],
    # 2.2 and 2.3 print F T2 for ω² F T2
    "task_2_2": [
        "Sr*K + (-w**2*T2*Sr + w**3*T0*T2*Si + w**2*T2*F)*T1 = w**2*T0*T2*Sr + w*T2*Si",
        "Si*K - w**2*(w*T0*T2*Sr + T2*Si)*T1 = w*(-T2*Sr + w*T0*T2*Si + T2*F)",
    ],
    "task_2_3": [
        "Sr*K + T2*w**2*(F - Sr)*T1 - w**2*T2*Sr*T0 + w**3*T2*Si*T0*T1 = w*T2*Si",
        "Si*K - w**2*T2*Si*T1 - w**2*T2*Si*T0 - w**3*T2*Sr*T0*T1 = w*T2*(F - Sr)",
    ],
    "task_3_1": [
        "Sr*K + (-w**2*(T0 + T2)*Sr + w**2*T2*F + (w**3*T0*T2 - w)*Si)*T1"
        " = (w**2*T2*T0 - 1)*Sr + w*(T0 + T2)*Si + F",
        "Si*K + ((w - w**3*T0*T2)*Sr - w**2*(T0 + T2)*Si - w*F)*T1"
        " = -w*(T0 + T2)*Sr + (w**2*T2*T0 - 1)*Si + w*T2*F",
    ],
    # 3.2 prints + ω S(i) at T2 and ω² (1 + K) on the right
    "task_3_2": [
        "(w**2*(F - Sr) + w**3*T0*Si)*T1*T2 - w*(w*T0*Sr + Si)*(T1 + T2) = F - (1 + K)*Sr + w*T0*Si",
        "-(w*T0*Sr + Si)*w**2*T1*T2 + (w*Sr - w**2*T0*Si - w*F)*(T1 + T2) = -w*T0*Sr - (1 + K)*Si",
    ],
    "task_3_3": [
        "w**3*Si*T0*T1*T2 - w*Si*(T0 + T1 + T2) - w**2*Sr*T0*(T1 + T2) + w**2*(F - Sr)*T1*T2"
        " = F - (1 + K)*Sr",
        "-w**3*Sr*T0*T1*T2 + w*Sr*T0 + w*(Sr - F)*(T1 + T2) - w**2*Si*T0*(T1 + T2) - w**2*Si*T1*T2"
        " = -(1 + K)*Si",
    ],
    "task_4_1": [
        "Zr*c - w*Zi*b + w*Zi*delta*b = m*w**2*(e + Zr)",
        "Zi*c + w*Zr*b - w*Zr*delta*b = m*w**2*Zi",
    ],
    "task_4_2": [
        "-w*K*Si*T1 + (T0**2*w**3 - w)*Si*T2 - 2*T0*w*Si*zeta - 2*T0*w**2*Sr*zeta*T2"
        " = F - (1 + K - T0**2*w**2)*Sr",
        "w*K*Sr*T1 + ((w - T0**2*w**3)*Sr - F*w)*T2 + 2*T0*w*Sr*zeta - 2*T0*w**2*Si*zeta*T2"
        " = (w**2*T0**2 - (1 + K))*Si",
    ],
    # 4.3 prints − S(r) K in the first row, S(i) for S(r) at T2 in the second, and a sign on the right
    "task_4_3": [
        "(T0**2*w**2 - 1)*w*Si*T2 + Sr*K - 2*T0*w*Si*zeta - 2*T0*w**2*Sr*zeta*T2 - w*Si*K*T1"
        " = F + (T0**2*w**2 - 1)*Sr",
        "-((T0**2*w**2 - 1)*w*Sr + F*w)*T2 + Si*K + 2*T0*w*Sr*zeta - 2*T0*w**2*Si*zeta*T2 + w*Sr*K*T1"
        " = (T0**2*w**2 - 1)*Si",
    ],
}
UNKNOWNS = {
    "task_1_1": ["a1", "a12", "a2"],
    "task_2_3": ["K", "T1", "T0", "T0*T1"],
    "task_3_2": ["T1 + T2", "T1*T2"],
    "task_3_3": ["T0", "T1 + T2", "T0*(T1 + T2)", "T1*T2", "T0*T1*T2"],
    "task_4_1": ["c", "b*(1 - delta)"],
    "task_4_2": ["K*T1 + 2*T0*zeta", "T2", "T2*zeta"],
}


@pytest.mark.parametrize("task", DERIVED)
def test_the_rows_of_lessons_1_to_4(task):
    shown = identify(*files(task)).equations
    assert len(shown.symbolic) == len(DERIVED[task])
    wrong = [
        row.written() for row, text in zip(shown.symbolic, DERIVED[task], strict=True) if not same(row, text)
    ]
    assert wrong == []
    assert list(shown.columns) == UNKNOWNS.get(task, list(shown.columns))


@pytest.mark.parametrize("task", TASKS)
def test_symbols_with_numbers_put_in_are_the_matrix_that_gives_the_estimate(task):
    model, data = files(task)
    found = identify(model, data)
    shown, tests = found.equations, found.result.experiments
    file = read_harmonic_model(model)
    told = iter(zip(shown.rows, shown.matrix, shown.right, strict=True))
    for i, w in enumerate(tests.frequencies):
        values = {"w": w, **file.model.known, **{name: v[i] for name, v in tests.varying.items()}}
        for name, z in tests.signals.items():
            values |= {name: z[i].real, f"{name}r": z[i].real, f"{name}i": z[i].imag}
        put = {sympy.Symbol(name): float(value) for name, value in values.items()}
        for row in shown.symbolic:
            label, own, right = next(told)
            assert row.name in label
            assert f"ω = {w:.6g} rad/s" in label
            numbers = [float(side([(c, 1)]).subs(put)) for c, _ in row.left]
            np.testing.assert_allclose(numbers, own, rtol=1e-9, atol=1e-12 * np.abs(own).max())
            np.testing.assert_allclose(float(side(row.right).subs(put)), right, rtol=1e-9, atol=1e-12)
    assert next(told, None) is None
    solved = np.linalg.lstsq(shown.matrix, shown.right, rcond=None)[0]
    np.testing.assert_allclose(solved, shown.solution, rtol=1e-6)


# -- balancing

JOB = sample_data() / "turbo_job" / "job.toml"


def test_the_stretched_rows_give_the_weights():
    found = balance(JOB, BalanceOptions(method="least-squares"))
    shown, result = found.equations, found.result
    N, P = result.before.size, len(result.planes)
    assert shown.matrix.shape == (2 * N, 2 * P)
    D = np.linalg.lstsq(shown.matrix, shown.right, rcond=None)[0]
    np.testing.assert_allclose(D, shown.solution, rtol=1e-9)
    size, angle = result.labels.weight(result.weights)  # as the sheet says them
    assert result.labels.angle_sign == 1
    np.testing.assert_allclose(D[::2] + 1j * D[1::2], size * np.exp(1j * np.radians(angle)), rtol=1e-9)
    left = shown.right - shown.matrix @ D
    rms = np.sqrt(np.sum(left**2) / N)
    np.testing.assert_allclose(
        rms, np.sqrt(np.mean(result.labels.vibration(result.after)[0] ** 2)), rtol=1e-9
    )
    assert not any("another way" in note for note in shown.notes)


# -- formula (50)


def test_the_printed_matrices_of_formula_50_with_a_seal():
    options = ReduceOptions(
        compliance=TASK_9 / "compliance.csv", measured=TASK_9 / "modes.csv", modes=2, seals="12=2e6"
    )
    found = reduce(None, options)
    shown = found.equations
    m = np.linalg.lstsq(shown.matrix, shown.right, rcond=None)[0]
    np.testing.assert_allclose(m, found.result.masses.values, rtol=1e-9)
    result = found.result
    U = result.rotor_shapes / result.rotor_shapes[0]
    values = {f"α{i + 1}{j + 1}": result.compliance[i, j] for i in range(3) for j in range(i, 3)}
    values |= {f"U{i + 1}{k + 1}": U[i, k] for i in range(3) for k in range(2)}
    values |= {f"λ{k + 1}": result.rotor_frequencies[k] ** -2 for k in range(2)} | {"c2": 2e6}
    right = ["λ{k}*(1 + α12*c2*U2{k})", "λ{k}*U2{k}*(1 + α22*c2)", "λ{k}*(U3{k} + α23*c2*U2{k})"]
    rows = [(k, i) for k in (1, 2) for i in (1, 2, 3)]
    assert shown.rows == [f"mass at {result.nodes[i - 1]}, mode {k}" for k, i in rows]
    for (k, i), own, D in zip(rows, shown.matrix, shown.right, strict=True):
        left = [f"α{min(i, j)}{max(i, j)}*U{j}{k}" for j in (1, 2, 3)]
        numbers = [float(sympy.sympify(text).subs(values)) for text in (*left, right[i - 1].format(k=k))]
        np.testing.assert_allclose([*own, D], numbers, rtol=1e-12)


# -- sensitivities


def written(shown, name):
    return [row.written() for row in shown.symbolic if row.name == name]


def test_symbols_are_what_is_integrated():
    model = ode_model(
        {"x": "v", "v": "-k*x**3 - d*v*abs(v) + g*sin(2*t)"},
        estimate={"k": 2.0, "d": 0.1, "x0": 0.5},
        initial={"x": "x0", "v": "3*x0**2"},
        outputs={"a": "x + k*v", "x": "x"},
        known={"g": 0.7},
    )
    record = simulated(model)
    shown = fit(model, [record]).equations
    theta, t, x = np.array([2.0, 0.1, 0.5]), 0.3, np.array([0.4, -0.6])
    S = np.arange(1.0, 7.0).reshape(2, 3)
    values = {"t": t, "x": x[0], "v": x[1], "g": 0.7} | dict(zip(model.parameters, theta, strict=True))
    values |= {
        f"∂{name}/∂{p}": S[i, j]
        for i, name in enumerate(model.states)
        for j, p in enumerate(model.parameters)
    }
    numbers = {sympy.Symbol(name): value for name, value in values.items()}
    assert any("d·sign(v)" in text or "abs(v)" in text for text in written(shown, "rate"))
    assert not any("Real" in row.written() for row in shown.symbolic)

    def value(row):
        total = side(row.right).subs(numbers)
        return float(total.replace(lambda f: f.is_Function, known_functions))

    rates = [value(row) for row in shown.symbolic if row.name == "rate"]
    augmented = written_out(model, 3).one([t, *np.column_stack((x, S)).ravel(), *theta])[:, 1:]
    np.testing.assert_allclose(np.reshape(rates, (3, 2)).T, augmented, rtol=1e-9)
    starts = [value(row) for row in shown.symbolic if row.name == "start"]
    np.testing.assert_allclose(np.reshape(starts, (3, 2)).T, model.x0(theta)[:, 1:], rtol=1e-9)
    outputs = [value(row) for row in shown.symbolic if row.name == "output"]
    wanted = model.h(np.array([t]), np.column_stack((x, S))[None], theta, x[None, :0])[0, 0, 1:]
    np.testing.assert_allclose(outputs, wanted, rtol=1e-9)  # the other one is a state


def known_functions(f):
    name, x = f.func.__name__, float(f.args[0])
    return {"RealAbs": abs, "RealSign": np.sign, "sin": np.sin, "cos": np.cos}[name](x)


def simulated(model, n=60):
    t = np.linspace(0, 3, n)
    found = simulate(model, model.start, t)
    return Record(t, dict(zip(model.outputs, found.y.T, strict=True)))


def test_quasilinearization_shows_its_own_equations():
    """f_x, f_θ, G and D of [Q] (2.17) to (2.22) in symbols, and M θ = Y, (2.28), of the last iteration."""
    paths = (FIT / "quasilinearization" / name for name in ("model.toml", "record.csv"))
    options = FitOptions(method="quasilinearization", integrator="sequential-heun")
    found = fit(*paths, options)
    shown = found.equations
    assert "∂f1/∂x2 = theta1" in written(shown, "f_x")
    assert "∂f2/∂theta3 = x2" in written(shown, "f_θ")
    assert "dG23/dt = theta2·G13 + theta3·G23 + x2" in written(shown, "G")
    x, theta = sympy.symbols("x1 x2"), sympy.symbols("theta1:4")
    D1, D2 = sympy.symbols("D1 D2")
    f = theta[1] * x[0] + theta[2] * x[1] + sympy.cos(sympy.Symbol("t"))
    (row,) = [row for row in shown.symbolic if row.name == "D" and "dD2" in row.written()]
    expected = f + theta[1] * (D1 - x[0]) + theta[2] * (D2 - x[1]) - theta[1] * x[0] - theta[2] * x[1]
    assert sympy.simplify(side(row.right) - expected) == 0
    np.testing.assert_allclose(np.linalg.solve(shown.matrix, shown.right), found.result.values, rtol=1e-6)


def test_a_model_of_matrices_keeps_its_masses_on_the_left():
    model = second_order(
        [["m", 0.0], [0.0, 2.0]],
        [[0.2, 0.0], [0.0, 0.3]],
        [[4.0, -1.0], [-1.0, "k"]],
        estimate={"m": 1.5, "k": 3.0},
        initial={"y1": 1.0},
    )
    shown = fit(model, [simulated(model)]).equations
    told = written(shown, "rate")
    assert "m·d(∂v_y1/∂m)/dt = -4·∂y1/∂m - 1/5·∂v_y1/∂m + ∂y2/∂m - dv_y1/dt" in told
    assert "2·d(∂v_y2/∂k)/dt = ∂y1/∂k - k·∂y2/∂k - 3/10·∂v_y2/∂k - y2" in told


# -- text and JSON


def test_terms_keep_their_signs_and_brackets():
    a, b, x = sympy.symbols("a b x")
    row = Row("", [(-1, x), (a - b, a * x), (0, b)], [(1, a + b), (-1, a - b), (-a, x)])
    assert row.written() == "-x + (a - b)·(a·x) = a + b - (a - b) - a·x"
    assert Row("", [(1, 1)], [(-1, 1)]).written() == "1 = -1"
    assert Row("", [(a**2, x)], [(a**-2, 1)]).written() == "a²·x = a**(-2)"
    long = sympy.Rational(12345678, 10**7)
    assert Row("", [(long * a, x)], [(sympy.Rational(3, 10), x)]).written() == "1.23457·a·x = 3/10·x"


def test_a_sum_with_a_long_fraction_before_it_keeps_its_brackets():
    x, y, z = sympy.symbols("x y z")
    sum_of_two = sympy.factor_terms(sympy.Rational(14, 5) * x - sympy.Rational(1277, 250) * y**2)
    assert sum_of_two.is_Mul  # sympy multiplies it out once its fraction is a decimal
    row = Row("", [(sum_of_two, z)], [(1, z)])
    assert row.written() == "(2.8·x - 5.108·y²)·z = z"


def test_the_document_and_the_text_have_what_was_solved():
    outcome = identify(*files("task_4_2"))
    shown, text = outcome.equations, outcome.equations.answer(outcome.answer).whole()
    document = json.loads(json.dumps(shown.to_dict(), allow_nan=False, ensure_ascii=False))
    assert document["matrix"] == shown.matrix.tolist()
    assert document["right"] == shown.right.tolist()
    assert document["solution"] == shown.solution.tolist()
    assert BEHIND not in json.dumps(document, ensure_ascii=False)
    for label, numbers in zip(shown.rows, np.column_stack((shown.matrix, shown.right)), strict=True):
        line = next(line for line in text.splitlines() if line.strip().startswith(label))
        np.testing.assert_allclose([float(x) for x in line.split(label)[1].split()], numbers, rtol=1e-5)
    nothing = replace(shown, solution=np.full(len(shown.columns), np.nan))
    assert f"θ: {shown.columns[0]} not determined" in nothing.answer(outcome.answer).whole()
    assert nothing.to_dict()["solution"] == [None] * len(shown.columns)
