"""A model in time as operator equations of amplitudes: d/dt becomes p, so that one file serves both."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rotorid.identify import expressions
from rotorid.tables.models.matrix_form import Matrices

if TYPE_CHECKING:
    from rotorid.tables.models.ode_file import TimeForm

FORCE = "f_"
"""Before the name of a coordinate: the amplitude of the force on it, where the file names no forces."""

# numbers first: the e of 1e5 is no name
_TOKEN = re.compile(
    r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?|[A-Za-z\u0370-\u03ff][A-Za-z0-9_\u0370-\u03ff]*"
)


@dataclass(frozen=True)
class OperatorForm:
    """What `harmonic_model` takes.

    Attributes
    ----------
    equations
        "left = right" in p = d/dt.
    estimate
        Starting values of the parameters that stand in the equations.
    inputs
        Names of the exciting amplitudes.
    left_out
        Parameters of initial values alone: amplitudes of steady vibration do not depend on them.
    unseen
        Amplitudes that the outputs do not show, each with the number of the equation that goes with it.
    """

    equations: tuple[str, ...]
    estimate: Mapping[str, float]
    inputs: tuple[str, ...]
    left_out: tuple[str, ...]
    unseen: Mapping[str, int]


@dataclass(frozen=True)
class _Derivative:
    """A state that is the `order`-th time derivative of the state `base`."""

    base: str
    order: int

    def of(self, amplitude: str) -> str:
        return f"(p**{self.order}*{amplitude})" if self.order else amplitude


def operator_form(form: TimeForm) -> OperatorForm:
    """Operator equations of a linear model in time.

    From matrices come the rows of (M p² + C p + K) X = F, with amplitudes named like the coordinates; where
    the file names neither `inputs` nor `[force]`, F is the amplitude f_x7 on the coordinate x7, and so on.
    From `[states]` come p x = (rate of x); a state that is nothing but another one's rate, such as a
    velocity, is written as p times that one and needs not be measured.

    An output that is a number times a state (or its rate) takes that amplitude's place; any other linear
    output adds an equation.

    Parameters
    ----------
    form
        What stands in the file.

    Raises
    ------
    ValueError
        What has no meaning for amplitudes: explicit time, a name p, matrices that hold states, outputs of the
        same name as another amplitude, parameters of single records. Whether the equations are linear is seen
        by `harmonic_model`.
    """
    _check_names(form)
    _check_time(form)
    _check_records(form)
    if form.matrices is None:
        derivatives = _chains(form.states)
        left = [name for name, r in form.states.items() if not _is_definition(name, r, derivatives)]
        rows = [(f"p*({name})", form.states[name]) for name in left]
        owners = [derivatives[name].base for name in left]
        inputs = tuple(form.inputs)
    else:
        y = form.matrices.coordinates
        derivatives = {x: _Derivative(x, 0) for x in y} | {f"v_{x}": _Derivative(x, 1) for x in y}
        rows = _matrix_rows(form, form.matrices)
        owners = list(y)
        own = not form.inputs and not form.force
        inputs = tuple(f"{FORCE}{x}" for x in y) if own else tuple(form.inputs)
        if own:
            _check_free(form, inputs)
            rows = [(left, force) for (left, _), force in zip(rows, inputs, strict=True)]
    renamed, more = _outputs(form, derivatives)
    names = {name: d.of(renamed.get(d.base, d.base)) for name, d in derivatives.items()}
    equations = [f"{put(left, names)} = {put(right, names)}" for left, right in rows]
    equations += [f"{output} = {put(text, names)}" for output, text in more.items()]
    unseen = {x: i for i, x in enumerate(owners) if form.outputs and x not in renamed}
    used = {name for text in equations for name in _words(text)}
    at_start = {name for text in form.initial.values() if isinstance(text, str) for name in _words(text)}
    left_out = tuple(name for name in form.estimate if name not in used and name in at_start)
    return OperatorForm(
        tuple(equations),
        {name: value for name, value in form.estimate.items() if name not in left_out},
        tuple(name for name in inputs if name in used),
        left_out,
        unseen,
    )


def put(text: str, names: Mapping[str, str]) -> str:
    """Put other texts for names of an expression.

    Examples
    --------
    >>> put("2e5*x - v", {"x": "y", "v": "(p*y)"})
    '2e5*y - (p*y)'
    """
    return _TOKEN.sub(lambda found: names.get(found[0], found[0]), text)


def _words(text: str) -> set[str]:
    return {word for word in _TOKEN.findall(text) if word[0].isalpha()}


def _matrix_rows(form: TimeForm, matrices: Matrices) -> list[tuple[str, str]]:
    """Left and right side of each row of (M p² + C p + K) X = F."""
    allowed = {*form.estimate, *form.known}
    rows = []
    for i, name in enumerate(matrices.coordinates):
        terms = []
        for j, other in enumerate(matrices.coordinates):
            parts = []
            for key, power in (("M", "*p**2"), ("C", "*p"), ("K", "")):
                entry = getattr(matrices, key)[i][j]
                text = entry if isinstance(entry, str) else repr(float(entry))
                if lost := sorted(expressions.names(expressions.parse(text, where=key)) - allowed):
                    raise ValueError(
                        f"row {i + 1} of {key} holds {lost[0]}, which is no parameter and not known: "
                        "amplitudes need matrices of constants"
                    )
                if text != "0.0":
                    parts.append(f"({text}){power}")
            if parts:
                terms.append(f"({' + '.join(parts)})*{other}")
        if not terms:
            raise ValueError(f"the row of {name} in M, C and K is empty: leave this coordinate out")
        rows.append((" + ".join(terms), form.force.get(name, "0")))
    return rows


def _chains(states: Mapping[str, str]) -> dict[str, _Derivative]:
    """Each state as a derivative of another one: x' = v makes v the first derivative of x."""
    source: dict[str, str] = {}
    for name, rate in states.items():
        target = rate.strip()
        if target not in states or target in source:
            continue
        above = name  # not in a circle: the first state of a chain is no rate itself
        while above in source:
            above = source[above]
        if above != target:
            source[target] = name
    found = {}
    for name in states:
        base, order = name, 0
        while base in source:
            base, order = source[base], order + 1
        found[name] = _Derivative(base, order)
    return found


def _is_definition(name: str, rate: str, derivatives: Mapping[str, _Derivative]) -> bool:
    """Whether this rate says nothing but that one state is the derivative of another."""
    target, own = derivatives.get(rate.strip()), derivatives[name]
    return target is not None and target.base == own.base and target.order == own.order + 1


def _outputs(form: TimeForm, derivatives: Mapping[str, _Derivative]) -> tuple[dict[str, str], dict[str, str]]:
    """Texts for the amplitudes that outputs stand for, and the outputs that need equations of their own."""
    renamed: dict[str, str] = {}
    more: dict[str, str] = {}
    shown: set[str] = set()
    for output, text in form.outputs.items():
        found = _scaled(text, form)
        if found is None or derivatives[found[0]].base in renamed:
            more[output] = text
            continue
        name, scale = found
        d = derivatives[name]
        shown.add(output)
        plain = output == d.base and scale == "1" and not d.order
        rate = f"/p**{d.order}" if d.order else ""
        renamed[d.base] = output if plain else f"({output}{rate}/({scale}))"
    bases = {d.base for d in derivatives.values()} - set(renamed)
    for output in (*shown, *more):
        if output in bases or output in form.inputs or output in form.estimate or output in form.known:
            raise ValueError(
                f"outputs.{output}: the amplitude needs a name of its own; {output} means something "
                "else already"
            )
    return renamed, more


def _scaled(text: str, form: TimeForm) -> tuple[str, str] | None:
    """The state and the number of an output that is number · state."""
    import sympy

    expression = expressions.parse(text)
    known = {sympy.Symbol(k): sympy.Rational(repr(v)) for k, v in form.known.items()}
    expression = sympy.expand(expression.subs(known))
    names = expressions.names(expression)
    if len(names) != 1 or not names <= set(form.states):
        return None
    name = next(iter(names))
    scale = expression.coeff(sympy.Symbol(name), 1)
    if expression != scale * sympy.Symbol(name) or not scale.is_Rational or scale == 0:
        return None
    return name, f"{scale.p}/{scale.q}" if scale.q != 1 else str(scale.p)


def _check_names(form: TimeForm) -> None:
    for what in ("states", "outputs", "estimate", "known", "inputs"):
        if "p" in getattr(form, what):
            raise ValueError(f"{what}: p is d/dt in equations of amplitudes; choose another name")


def _check_time(form: TimeForm) -> None:
    for what in ("states", "force", "outputs"):
        for name, text in getattr(form, what).items():
            if "t" in expressions.names(expressions.parse(text)):
                raise ValueError(
                    f"{what}.{name} depends on the time t, which amplitudes do not know: make what excites a "
                    'measured input, such as inputs = ["u"]'
                )
    if not form.states:
        raise ValueError("a model without states has no amplitudes to be measured")


def _check_records(form: TimeForm) -> None:
    """Refuse parameters of single records that stand in more than initial values."""
    texts: list[str] = [*form.states.values(), *form.force.values(), *form.outputs.values()]
    if form.matrices is not None:
        m = form.matrices
        texts += [x for rows in (m.M, m.C, m.K) for row in rows for x in row if isinstance(x, str)]
    used = {name for text in texts for name in _words(text)}
    if own := [name for name in form.per_record if name in used]:
        raise ValueError(
            f"per_record: {own[0]} stands in the equations, and harmonic tests have one value for all of them"
        )


def _check_free(form: TimeForm, forces: Iterable[str]) -> None:
    taken = {*form.states, *form.estimate, *form.known, *form.outputs}
    for name in forces:
        if name in taken:
            raise ValueError(
                f"{name} is the force on {name[len(FORCE) :]} here, as there are no inputs: choose another "
                "name, or name the forces (inputs and [force])"
            )
