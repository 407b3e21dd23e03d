"""Coefficients from amplitudes, frequencies and shapes, [S] section 1.8 and tasks 2.3 to 8.2.

Models and data are those of `sample_data/identify`. The direct problems, whose rounded results are the
data, are computed with the parameters that the book states.
"""

import math
import tomllib
from functools import cache

import numpy as np
import sympy

import fem
from book.printed import below, lines, parts, read
from rotorid.files import read_harmonic_model, read_measurements
from rotorid.identify import Experiments, harmonic_model
from rotorid.identify.expressions import parse_equation
from rotorid.identify.linear_start import build_rows, linear_fit
from rotorid.identify.operator_model import natural_modes
from rotorid.samples import sample_data

SINGULAR = ("2_3", "3_2", "3_3", "4_1", "4_2", "4_3")
"""Exercises whose unknowns the book counts; in most of them no data determine all."""
FEEDBACK = {"T1": 0.5, "T2": 0.8, "F": 1.0}
EQUATIONS = "[S] misprinted equations"


@cache
def exercise(folder, data="data.csv"):
    """Model, readings and true parameters of an exercise."""
    path = sample_data() / "identify" / folder
    file = read_harmonic_model(path / "model.toml")
    truth = tomllib.loads((path / "expected.toml").read_text(encoding="utf-8"))["truth"]
    return file.model, read_measurements(path / data, file), truth


def _estimates(folder, units, data="data.csv", words="estimate of {}"):
    """What K θ = Y gives, and the largest error of some parameters in percent of the direct problem's."""
    model, readings, truth = exercise(folder, data)
    fit = linear_fit(model, build_rows(model, readings))
    values = dict(zip(fit.words, fit.system.values, strict=True))
    values |= dict(zip(model.parameters, fit.recovery.values, strict=True))
    numbers = {words.format(f"{n}{units.get(n, '')}"): value for n, value in values.items()}
    return numbers, lambda *names: 100 * max(abs(values[n] / truth[n] - 1) for n in names)


def _predicted(folder, truth, w):
    """Amplitude of the only output for the force F."""
    model = exercise(folder)[0]
    values = np.array([truth[name] for name in model.parameters])
    inputs = {name: np.full(len(w), truth["F"], dtype=complex) for name in model.inputs}
    return model.predict(values, np.array(w, dtype=float), inputs)[model.outputs[0]]


def _amplitudes(name, w, Z):
    found = {}
    for omega, z in zip(w, Z.tolist(), strict=True):
        found |= {f"Re {name} at omega = {omega:g}": z.real, f"Im {name} at omega = {omega:g}": z.imag}
    return found


def _rounding(folder, name, exact):
    """Largest error of real and imaginary parts of the data, percent; parts that are 0 are exact."""
    data = exercise(folder)[1].signals[name].view(float)
    return 100 * np.abs(data[data != 0] / exact.view(float)[data != 0] - 1).max()


def section_1_8():
    """K and Y from the printed amplitudes, T2 and T1 T2 from the printed K and Y."""
    source, book = "[S] section 1.8", read("s_lessons.csv")
    amplitudes = _amplitudes("S", (1.0, 2.0), _predicted("task_6_1", FEEDBACK, (1.0, 2.0)))
    re_1, im_1, re_2, im_2 = (float(book[source, quantity].printed) for quantity in amplitudes)
    signals = {"S": np.array([complex(re_1, im_1), complex(re_2, im_2)]), "F": np.ones(2, dtype=complex)}
    tests = Experiments(("1", "2"), np.array([1.0, 2.0]), signals, np.zeros(2, dtype=bool))
    K, Y, *_ = build_rows(exercise("task_6_1")[0], tests)
    numbers = {f"K({i + 1},{j + 1})": x for (i, j), x in np.ndenumerate(K)} | parts("Y({})", Y)
    found, worst = _estimates("section_1_8", {})
    return below(source, amplitudes | numbers | found | {"largest error, %": worst("T1", "T2")})


def unknowns():
    """How many products of parameters a linear problem has, and how many of them data can determine."""
    found, book = {}, read("s_lessons.csv")
    for task in SINGULAR:
        model = exercise(f"task_{task}")[0]
        n, determined = len(model.monomials), len(model.combinations.pivots)
        counts = {"unknowns of the linear problem": n, "unknowns that can be estimated": determined}
        counts |= {"columns of K": n, "experiments that this takes": math.ceil(n / 2)}
        found |= below(f"[S] task {task.replace('_', '.')}", counts)
    return {key: count for key, count in found.items() if key in book}


def lesson_5():
    """One mass, and the rotor of a pump."""
    w = (10.0, 20.0, 30.0)
    X = _predicted("task_5_1", {**exercise("task_5_1")[2], "F": 10.0}, w)
    Z = _predicted("task_5_2", {**exercise("task_5_2")[2], "F": 0.0}, (80.0, 100.0))
    one, worst_1 = _estimates("task_5_1", {"c": ", N/m", "alpha": ", kg/s"})
    two, worst_2 = _estimates("task_5_2", {"c": ", N/m", "b": ", kg/s"})
    plain, _ = _estimates("task_5_2", {})
    c, b = plain.values()
    errors = {
        "rounding of the data, %": _rounding("task_5_1", "X", X),
        "largest error, %": worst_1("c", "alpha"),
    }
    said = {"Re Z at omega = 80, calculation": Z[0].real, "c, N/m, in the text": c, "b, kg/s, in the text": b}
    return {
        **below("[S] task 5.1", _amplitudes("X", w, X) | errors | one),
        **below(
            "[S] task 5.2",
            _amplitudes("Z", (80.0, 100.0), Z) | said | {"largest error, %": worst_2("c", "b")} | two,
        ),
        **below("[S] task 5.2 recomputed", plain),
    }


def lesson_6():
    """A feedback system, T0 = 1, T1 = 0.5, T2 = 0.8, K = 10, H = 1."""
    S = _predicted("task_6_1", FEEDBACK, (1.0, 2.0))
    one, worst_1 = _estimates("task_6_1", {"T1": ", s", "T2": ", s"})
    two, worst_2 = _estimates("task_6_2", {"T1": ", s"})
    said = {
        **_amplitudes("S", (1.0,), S[:1]),
        "Re S at omega = 2, table": S[1].real,
        "Re S at omega = 2, calculation": S[1].real,
        "Im S at omega = 2": S[1].imag,
        "rounding of the data, %": _rounding("task_6_1", "S", S),
    }
    return {
        **below("[S] task 6.1", said | one | {f"error of {n}, %": worst_1(n) for n in ("T1", "T2")}),
        **below(
            "[S] task 6.2",
            two
            | {"K, in the text": two["estimate of K"]}
            | {f"error of {n}, %": worst_2(n) for n in ("K", "T1")},
        ),
    }


def _direct(folder):
    """Squares of the natural frequencies at the true parameters."""
    model, _, truth = exercise(folder)
    return natural_modes(model.dynamic_stiffness(np.array([truth[n] for n in model.parameters]))[0])[0]


def _shapes(folder, equations, squares):
    """Amplitudes of the other masses where that of the first is 1, from some of the equations only.

    As the book does it: at rounded frequencies not all equations can hold.
    """
    model, _, truth = exercise(folder)
    texts = [model.equations[i] for i in equations]
    free = [name for name in model.parameters if any(name in text for text in texts)]
    known = model.known | {name: value for name, value in truth.items() if name not in free}
    part = harmonic_model(texts, known=known, estimate=free, inputs=["X1"])
    w = np.sqrt(np.array(squares))
    found = part.predict(np.array([truth[n] for n in free]), w, {"X1": np.ones(len(w), dtype=complex)})
    return [found[name].real for name in part.outputs]


def lesson_7():
    """A chain of three masses."""
    squares = _direct("task_7_1")
    A2, A3 = _shapes("task_7_1", (1, 2), (150.0, 690.0, 2400.0))
    c = {f"c{i}": ", N/m" for i in (1, 2, 3)}
    one, worst_1 = _estimates("task_7_1", c)
    two, worst_2 = _estimates("task_7_2", c | {"m2": ", kg", "m3": ", kg"})
    direct = {
        **parts("omega{}^2, 1/s^2", squares),
        **parts("omega{}^2 rounded, 1/s^2", squares),
        "rounding of the data, %": 100 * np.abs(exercise("task_7_1")[1].frequencies ** 2 / squares - 1).max(),
        **parts("A2, mode {}", A2),
        **parts("A3, mode {}", A3),
        "c3 of the direct problem, N/m": one["estimate of c3, N/m"],
        "largest error, %": worst_1("c1", "c2", "c3"),
    }
    three, _ = _estimates(
        "task_7_2", {}, "data_three_digits.csv", "estimate of {} from shapes of three digits"
    )
    return {
        **below("[S] task 7.1", direct | one),
        **below("[S] task 7.2", two | {"largest error of a mass, %": worst_2("m2", "m3")}),
        **below("[S] task 7.1 recomputed", _estimates("task_7_1", {})[0]),
        **below("[S] task 7.2 recomputed", _estimates("task_7_2", {})[0] | three),
    }


def _beam():
    """The steel beam of 1 m length and 0.1 m diameter on rigid supports; the masses are at nodes 4 and 7."""
    supports = [fem.Support(node, 1e18) for node in (1, 11)]
    return fem.Rotor(np.full(10, 0.1), np.full(10, 0.1), supports=supports)


def lesson_8():
    """A beam with two masses in compliance form."""
    squares, beam = _direct("task_8_1"), _beam()
    delta = fem.compliance(beam, (4, 7))
    (A2,) = _shapes("task_8_1", (1,), (2.183e6, 4.581e7))
    c = {"c1": ", N/m", "c2": ", N/m"}
    one, worst_1 = _estimates("task_8_1", c)
    two, worst_2 = _estimates("task_8_2", c | {"m1": ", kg", "m2": ", kg"})
    direct = {
        "EI, N m^2": (beam.youngs_modulus * beam.second_moment)[0],
        "delta11, m/N": delta[0, 0],
        "delta22, m/N": delta[1, 1],
        "delta12, m/N": delta[0, 1],
        **parts("omega{}^2, 1/s^2", squares),
        **parts("omega{}^2 rounded, 1/s^2", squares),
        **parts("A2, mode {}", A2),
        "largest error, %": worst_1("c1", "c2"),
    }
    errors = {
        "largest error of a mass, %": worst_2("m1", "m2"),
        "largest error of a stiffness, %": worst_2("c1", "c2"),
    }
    return {**below("[S] task 8.1", direct | one), **below("[S] task 8.2", two | errors)}


def lessons():
    return section_1_8() | unknowns() | lesson_5() | lesson_6() | lesson_7() | lesson_8()


def equations():
    """Misprinted equations at the true solution: what they, and the right ones, leave of the larger side.

    Amplitudes are `X` with `X_r`, `X_i` and `X_phi`, the frequency `w` and `p = iw`; of free vibration `A1`,
    `A2` and `z`, and of the beam of task 8.1 `EI` and `delta12`.
    """
    found = {}
    for line in lines("s_equations.csv"):
        values = _solution(line["exercise"])
        for words, worst in (("printed", min), ("corrected", max)):
            left = worst(_residual(text, values) for text in line[words].split(";"))
            found[f"{line['quantity']}, left as {words}"] = left
    return below(EQUATIONS, found)


def _residual(text, values):
    names = [sympy.Symbol(name) for name in values]
    left, right = (sympy.lambdify(names, side, "numpy")(*values.values()) for side in parse_equation(text))
    return np.abs(left - right).max() / max(np.abs(left).max(), np.abs(right).max())


def _solution(folder):
    model, data, truth = exercise(folder)
    theta = np.array([truth[name] for name in model.parameters])
    values = {name: np.array(number) for name, number in (model.known | truth).items()}
    if data.free.all():
        beam = _beam()
        z, shapes = natural_modes(model.dynamic_stiffness(theta)[0])
        values |= {"z": z, "A1": np.ones(2), "A2": shapes[1] / shapes[0]}
        stiffness = beam.youngs_modulus * beam.second_moment
        return values | {"EI": stiffness[0], "delta12": fem.compliance(beam, (4, 7))[0, 1]}
    w, inputs = data.frequencies, {name: data.signals[name] for name in model.inputs}
    for name, Z in (inputs | model.predict(theta, w, inputs)).items():
        values |= {name: Z, f"{name}_r": Z.real, f"{name}_i": Z.imag, f"{name}_phi": np.angle(Z)}
    return values | {"w": w, "p": 1j * w}
