"""The equations behind each result: K θ = Y of [S] (9), its (31)–(40) and (50), (3.6)–(3.7) of [F]."""

from __future__ import annotations

from collections.abc import Mapping
from functools import singledispatch

import numpy as np
from sympy import Add, I, Integer, Matrix, Symbol, collect, eye, factor_terms

from balancing import Correction
from rotorid.base.text import counted
from rotorid.identify import Experiments, HarmonicModel, Identification
from rotorid.identify.combinations import CONSTANT, ONE, Monomial, Polynomial, expression, times
from rotorid.identify.expression_functions import real, usual
from rotorid.identify.expressions import names, parse
from rotorid.identify.ode import OdeModel
from rotorid.identify.result_records import Fit
from rotorid.reduction import Reduction, design
from rotorid.regression.linear import stretch
from rotorid.report.equations import BEHIND, Equations, Expression, Row

PARTS = ("Re", "Im")
_START = "θ here is where the search begins: the answer predicts the amplitudes, which bias it less"


@singledispatch
def equations_of(result: object) -> Equations:
    """What was solved to get this result; ValueError where it has no such equations."""
    raise ValueError("--show equations needs one model and its data: there is nothing else that was solved")


@equations_of.register
def _(model: HarmonicModel) -> Equations:
    """K θ = Y of a model without data: in symbols alone."""
    words = model.combinations.words
    none = np.zeros((0, len(words)))
    title = f"K θ = Y, [S] (9), at p = iω: {counted(len(words), 'unknown')}"
    rows = _rows_in_symbols(model, None)
    return Equations(title, rows, ("K", "θ", "Y"), (), words, none, none[:, 0], none[:, 0])


@equations_of.register
def _(result: Identification) -> Equations:
    """K θ = Y of the linear regression: real and imaginary parts of the equations at p = iω."""
    fit, tests = result.linear, result.experiments
    if fit is None:
        raise ValueError("--show equations needs every amplitude of the equations: one is not measured")
    model, once = result.model, len({*tests.frequencies.tolist()}) == len(tests)
    at = [
        f"ω = {omega:.6g} rad/s" + ("" if once else f", experiment {name}")
        for omega, name in zip(tests.frequencies, tests.names, strict=True)
    ]
    labels = [f"{PARTS[k % 2]} eq. {k // 2 + 1}, {at[i]}" for i, k in np.argwhere(fit.rows.used)]
    notes = [_START] if result.method == "output-error" else []
    rows, solved = _rows_in_symbols(model, tests), fit.estimate
    title = f"K θ = Y, [S] (9): {counted(len(labels), 'real row')}, {counted(len(solved.names), 'unknown')}"
    names = "K", "θ", "Y"
    return Equations(title, rows, names, labels, solved.names, fit.rows.K, fit.rows.Y, solved.values, notes)


def _rows_in_symbols(model: HarmonicModel, tests: Experiments | None) -> list[Row]:
    """Parts of each equation; amplitudes that are real in all tests are one symbol.

    Without tests inputs are real, and a model that nothing excites vibrates freely.
    """
    combos = model.combinations
    free = bool(tests.free.all()) if tests else not (model.inputs or model.has_constant_terms)
    pivots = [combos.monomials[k] for k in combos.pivots]
    amplitude = {CONSTANT: Integer(1)}
    for name in model.signals:
        re, im, whole = (Symbol(f"{BEHIND}{BEHIND}{part}{name}") for part in ("Re ", "Im ", ""))
        turned = not free and name in model.outputs
        if tests:
            turned = bool(np.nan_to_num(tests.signals[name]).imag.any())
        amplitude[name] = re + I * im if turned else whole
    signals = {symbol for each in amplitude.values() for symbol in each.free_symbols}

    def total(e: int, part: int, monomial: Monomial) -> Expression:
        """What stands at a product of parameters."""
        terms = [Integer(0)]
        for f in model.features:
            if f.equation == e and monomial in f.symbolic:
                factor = (I * Symbol(f"{BEHIND}ω")) ** f.power * amplitude[f.signal]
                terms.append(expression(f.symbolic[monomial]) * expression({f.varying: Integer(1)}) * factor)
        return Add(*terms).expand().coeff(I, part)

    rows = []
    for e, part in np.ndindex(len(model.equations), 1 if free else 2):
        pairs = zip(pivots, combos.symbolic, strict=True)
        left = [factor_terms(total(e, part, m) / expression(by[m])) for m, by in pairs]
        right = collect((-total(e, part, ONE)).expand(), signals, evaluate=False)
        terms = [*zip(left, map(_unknown, combos.symbolic), strict=True)]
        name = f"eq. {e + 1}" if free else f"{PARTS[part]} eq. {e + 1}"
        given = [(factor_terms(right[signal]), signal) for signal in sorted(right, key=str)]
        rows.append(Row(name, terms, given))
    return rows


def _unknown(symbolic: Mapping[Monomial, Polynomial]) -> Expression:
    """A combination of parameters, a common factor in front."""
    return factor_terms(expression({times(m, k): x for m, part in symbolic.items() for k, x in part.items()}))


@equations_of.register
def _(correction: Correction) -> Equations:
    """The stretched W D = −Y of all speeds and sensors, [S] (29)–(33), (40), in the units of the job."""
    result = (correction.unknowns and correction.parts) or correction
    labels, planes, factors = result.labels, result.planes, np.ones(result.before.size)
    W = result.influence.W.reshape(-1, len(planes))
    notes = [
        f"D in {labels.weight_in}, Y in {labels.vibration_in or 'the unit of the readings'}; phases lead and "
        "angles count with the rotation, whatever the job writes"
    ]
    if result.method == "weighted":
        notes.append("the rows are before weighting, which follows from the errors of W and Y, and from D")
    elif result.row_weights is not None:
        factors = result.row_weights
        notes.append("the rows are after weighting: times the weights of sensors and speeds")
    if result.method != "least-squares" or result.active:
        how = f"{result.method}, within limits" if result.active else result.method
        notes.append(f"D by another way ({how}): plain least squares of these rows may give other weights")
    speeds = map(labels.speed_words, result.speeds.tolist())
    places = [f"{sensor}, {speed}" for speed in speeds for sensor in result.sensors]
    stacked = [f"{part} {place}" for place in places for part in PARTS]
    unknowns = [f"{part} {plane}" for plane in planes for part in PARTS]
    matrix = stretch(factors[:, None] * W * labels.vibration_scale / labels.weight_scale)
    right = stretch(-factors * result.before.ravel() * labels.vibration_scale)
    title = f"W D = -Y of each reading, stretched, [S] (31)–(33), (40): {counted(len(stacked), 'real row')}"
    weights = stretch(result.weights * labels.weight_scale)
    return Equations(title, (), ("W", "D", "-Y"), stacked, unknowns, matrix, right, weights, notes)


@equations_of.register
def _(result: Reduction) -> Equations:
    """The rows B m = D of formula (50), mode by mode, as `design` makes them."""
    n, k, seals = len(result.nodes), result.modes, result.seal_stiffness
    modes = result.rotor_frequencies[:k], result.rotor_shapes[:, :k]
    normalise, rows = result.normalise, result.rows
    B, D = design(result.compliance, *modes, seal_stiffness=seals, normalise=normalise, rows=rows)
    notes = ["B in 1/kg, D without unit" if result.rows == "relative" else "B in m/N, D in s²"]
    if result.nonnegative:
        notes.append("no mass may be below 0: plain least squares of these rows may give another answer")
    labels = [f"mass at {node}, mode {mode + 1}" for mode in range(k) for node in result.nodes]
    title, m = f"B m = D, [S] (50): {counted(n * k, 'row')}, {counted(n, 'unknown')}", result.masses
    return Equations(title, (), ("B", "m", "D"), labels, m.names, B, D, m.solution, notes)


@equations_of.register
def _(result: Fit) -> Equations:
    """[F] (3.6), (3.7), or of quasilinearization (2.17) to (2.28) of [Q]."""
    return _sensitivities(result) if result.regression is None else _linear_about_last(result)


def _linear_about_last(result: Fit) -> Equations:
    """f_x, f_θ, dG/dt and dD/dt in symbols, [Q] (2.17)–(2.22), and M θ = Y of the last step, (2.28)."""
    model = result.model
    x, thetas = ([Symbol(name) for name in names] for names in (model.states, model.parameters))
    if model.inertia:
        raise ValueError("--show equations of quasilinearization needs a model that states its rates itself")
    rates, _, _ = _as_written(model)
    rows = []
    for i, f in enumerate(rates):
        for name, by in [*(("f_x", by) for by in x), *(("f_θ", by) for by in thetas)]:
            rows.append(Row(name, [(1, Symbol(f"∂f{i + 1}/∂{by}"))], [(usual(f.diff(by)), 1)]))
    for i, f in enumerate(rates):
        slopes = [usual(f.diff(by)) for by in x]
        for j, theta in enumerate(thetas):
            G = [Symbol(f"G{p + 1}{j + 1}") for p in range(len(x))]
            terms = [*zip(slopes, G, strict=True), (usual(f.diff(theta)), 1)]
            rows.append(Row("G", [(1, Symbol(f"dG{i + 1}{j + 1}/dt"))], terms))
        D = [Symbol(f"D{p + 1}") - by for p, by in enumerate(x)]
        constant = usual(f) - Add(*(usual(f.diff(theta)) * theta for theta in thetas))
        rows.append(Row("D", [(1, Symbol(f"dD{i + 1}/dt"))], [*zip(slopes, D, strict=True), (constant, 1)]))
    K, Y = result.regression or (np.zeros((0, 0)), np.zeros(0))
    values = result.estimate.values
    labels = [f"M{j + 1}" for j in range(len(thetas))]
    title = "x = G θ + D about the last trajectory x, θ, [Q] (2.17)–(2.24), and M θ = Y, (2.28)"
    notes = ["G and D begin with G θ + D = x(t0); M and Y are those of the last iteration"]
    return Equations(title, rows, ("M", "θ", "Y"), labels, model.parameters, K.T @ K, K.T @ Y, values, notes)


def _sensitivities(result: Fit) -> Equations:
    """Sensitivities ∂x/∂θ of the states and ∂y/∂θ of the outputs, [F] (3.6), (3.7), in symbols."""
    model, n = result.model, len(result.model.states)
    x, thetas = ([Symbol(name) for name in names] for names in (model.states, model.parameters))
    E = Matrix(n, n, model.inertia) if model.inertia else eye(n)
    velocities = [Symbol(f"d{state}/dt") for state in x]
    equations, starts, outputs = [], [], []

    def chain(f: Expression, by: Expression, S: list[Expression]) -> list[tuple[Expression, Expression]]:
        slopes = [usual(f.diff(symbol)) for symbol in (*x, by)]
        return [*zip(slopes, (*S, 1), strict=True)]

    rates, initial, observed = _as_written(model)
    for theta in thetas:
        S = [Symbol(f"∂{state}/∂{theta}") for state in x]
        for i, (s, f, start) in enumerate(zip(S, rates, initial, strict=True)):
            left = [(E[i, j], Symbol(f"d({other})/dt")) for j, other in enumerate(S)]
            moved = zip(-E[i, :].diff(theta), velocities, strict=True)
            equations.append(Row("rate", left, [*chain(f, theta, S), *moved]))
            starts.append(Row("start", [(1, s)], chain(start, theta, S)))
        for name, f in zip(model.outputs, observed, strict=True):
            if f != Symbol(name):  # an output that is no state as it is
                outputs.append(Row("output", [(1, Symbol(f"∂{name}/∂{theta}"))], chain(f, theta, S)))
    rows, none = [*equations, *starts, *outputs], np.zeros((0, len(thetas)))
    title = f"Sensitivities, [F] (3.6), (3.7), of {counted(n, 'state')}"
    notes = ["below these: the rows of [prior] or --ridge, (θ - value)/std = 0"] if result.prior else []
    return Equations(
        title, rows, ("U", "θ", "y"), (), model.parameters, none, none[:, 0], result.estimate.values, notes
    )


def _as_written(model: OdeModel) -> list[list[Expression]]:
    """Rates, initial values, outputs: with the names of the known where the model still has its own texts."""
    groups = {"state": model.states, "initial": model.states, "output": model.outputs}
    read = [[real(parse(model.texts[f"{kind} {name}"])) for name in of] for kind, of in groups.items()]
    written = {name for group in read for e in group for name in names(e)}
    if {*model.parameters} <= written and not model.inertia:
        return read
    return [[*model.rates], [*model.initial], [*model.observed]]
