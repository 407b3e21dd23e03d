"""Expressions of model files: what they mean, and that they never run code."""

import builtins
import contextlib

import pytest
import sympy
from cases import each_of
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rotorid.identify.expressions import FUNCTIONS, ExpressionError, is_name, names, parse, parse_equation

X, Y, LAMBDA = sympy.symbols("x y lambda")


@each_of(
    ("text", "value"),
    [
        ("-2**2", -4),
        ("2**3**2", 512),
        ("0.1 + 0.2", sympy.Rational(3, 10)),
        ("1e-3*.5", sympy.Rational(1, 2000)),
        ("16/4/2", 2),
        ("x**-2", X**-2),
        ("x**0.5", sympy.sqrt(X)),
        ("x**y", X**Y),
        ("abs(-3)*sign(-2)", -3),
        (" x\t+\r\n y ", X + Y),
        ("2**0.5", sympy.Rational("1.4142135623730951")),
    ],
)
def test_meaning(text, value):
    assert sympy.simplify(parse(text) - value) == 0


NAMES = [
    *("E", "I", "N", "S", "O", "Q", "C", "beta", "gamma", "lambda", "zeta", "pi", "oo", "nan", "if", "None"),
    *("eval", "exec", "x_1", "T1", "ζ", "δ1"),
]


@each_of("name", NAMES)
def test_every_other_name_is_a_plain_symbol(name):
    assert parse(name) == sympy.Symbol(name)
    assert parse(name).assumptions0 == sympy.Symbol("a").assumptions0
    assert is_name(name)
    assert names(parse(f"2*{name}**2 + sin({name})*y")) == {name, "y"}


@each_of("function", FUNCTIONS)
def test_functions_of_names_and_numbers(function):
    expr = parse(f"{function}(x)")
    assert names(expr) == {"x"}
    other = "Abs" if function == "abs" else function
    at = float(expr.subs(X, sympy.Rational(1, 3)))
    assert at == pytest.approx(float(getattr(sympy, other)(sympy.Rational(1, 3))), rel=1e-12)
    assert float(parse(f"{function}(1/3)")) == pytest.approx(at, rel=1e-12)
    assert not is_name(function)


def test_equations_have_two_sides():
    left, right = parse_equation("(m*p**2 + b*p + c)*X = F")
    assert names(left) == {"m", "p", "b", "c", "X"}
    assert right == sympy.Symbol("F")
    for text in ("m*X", "a = b = c"):
        with pytest.raises(ExpressionError, match="needs one ="):
            parse_equation(text)
    with pytest.raises(ExpressionError, match="without ="):
        parse("a = b")


@each_of(
    ("text", "position", "hint"),
    [
        ("", 0, "ends here"),
        ("2x", 1, r"2\*x"),
        ("x^2", 1, r"\*\*"),
        ("x y", 2, "before y"),
        ("(x", 0, "never closed"),
        ("x)", 1, "closes nothing"),
        ("x +", 3, "ends here"),
        ("* x", 0, r"expected before \*"),
        ("sin", 0, "is a function"),
        ("sin x", 0, "is a function"),
        ("sine(x)", 0, "did you mean sin"),
        ("f(x)", 0, "no function"),
        ("atan(x, y)", 6, "one argument"),
        ("x/0", 1, "zero"),
        ("0**-1", 1, "zero"),
        ("x/(y - y)", 1, "zero"),
        ("(y - y)**-1", 7, "zero"),
        ("x**(y - y + 51)", 1, "at most 50"),
        ("x**51", 1, "at most 50"),
        ("9**9**9", 1, "at most 50"),
        ("1e999", 0, "at most"),
        ("1e-99999", 0, "at least"),
        ("log(0)", 0, "no finite"),
        ("asin(2)", 0, "no finite"),
        ("(-8)**(1/3)", 4, "no finite real"),
        ("exp(1000)", 0, "no finite"),
        ("1e300*1e300", 0, "at most"),
        ("_x", 0, "begins with a letter"),
        ("−x", 0, "written -"),
    ],
)
def test_messages_name_the_place_and_the_remedy(text, position, hint):
    with pytest.raises(ExpressionError, match=hint) as caught:
        parse(text, where="equation 3")
    assert caught.value.text == text
    assert caught.value.position == position
    assert str(caught.value).startswith("equation 3: ")
    assert f"character {position + 1}" in str(caught.value)


BOMBS = [
    "9**9**9**9",
    "((((x**50)**50)**50)**50)",
    "(a+b+c+d+e+f)**50",
    "*".join(["(a+b+c+d)"] * 40),
    "(" * 5000 + "x" + ")" * 4999,
    "-" * 9999 + "x",
    "**".join(["x"] * 3000),
    "sin(" * 2000 + "x" + ")" * 2000,
    "x" * 10_001,
    "+".join(["x"] * 4999),
    "+".join(f"1/9999{i}**50" for i in range(600)),
    "abs(" + "+".join(f"x{i}*y{i}" for i in range(700)) + ")",
    "9" * 9999,
    "1e" + "9" * 9000,
]


@pytest.mark.parametrize("text", BOMBS, ids=[text[:12] for text in BOMBS])
def test_bombs_end(text):
    """Without the parser's limits each of these runs for minutes or exhausts the memory."""
    with contextlib.suppress(ExpressionError):
        parse(text)


CODE = [
    *("__import__('os').system('touch {})", "x.__class__", "().__class__.__bases__[0]", "lambda x: x"),
    *("f'{x}'", "eval('1')", "exec(x)", "getattr(x, y)", "[x for x in y]", "{x}", "x if y else z", "x; y"),
    *(
        "x\nimport os",
        "x := 1",
        "`id`",
        "$(id)",
        "x\x00y",
        "ｅｖａｌ(x)",
        "Symbol('x')",
        "x@y",
        "x\\y",
        "'x'",
    ),
    *("1if x else 2", "0x10", "1_000", "1j", "\u202ex", "ª", "x//y", "not x", "x and y", "x < y", "~x"),
]


@pytest.mark.parametrize("text", CODE)
def test_code_is_refused_and_never_run(text, monkeypatch):
    parse("sin(x)")  # sympy itself may import and compile at its first use

    def alarm(*_args, **_options):
        pytest.fail("code was run")

    for name in ("eval", "exec", "compile", "open"):
        monkeypatch.setattr(builtins, name, alarm)
    monkeypatch.setattr("os.system", alarm)
    monkeypatch.setattr(sympy, "sympify", alarm)
    with pytest.raises(ExpressionError):
        parse(text)


_PIECES = st.sampled_from([*"xyEI()()+-*/.0123456789e", "**", "sin", "sqrt", "abs", " ", "=", "50", "λ", "_", "'", "1e300"])  # fmt: skip  # noqa: E501


@settings(max_examples=300, deadline=2000)
@given(st.one_of(st.text(max_size=60), st.lists(_PIECES, max_size=40).map("".join)))
@example("0**x")
@example("sqrt(x-x-1)")
@example("(x-x)**-0.5")
@example("log(x/x - 1)")
def test_any_text_is_an_expression_or_an_expression_error(text):
    value = problem = None
    try:
        value = parse(text)
    except ExpressionError as error:
        problem = error
    if problem is not None:
        assert 0 <= problem.position <= len(text)
        assert len(str(problem)) < 400
        return
    assert isinstance(value, sympy.Expr)
    assert not value.has(sympy.zoo, sympy.nan, sympy.oo, sympy.I, sympy.pi, sympy.E)
    assert all(type(symbol) is sympy.Symbol and symbol.name in text for symbol in value.free_symbols)


_EXPRESSIONS = st.recursive(
    st.one_of(st.sampled_from(["x", "y"]), st.integers(0, 20).map(str), st.sampled_from(["0.5", "2.25"])),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        inner.map(lambda t: f"-{t}"),
        st.tuples(inner, st.integers(0, 3)).map(lambda t: f"({t[0]})**{t[1]}"),
    ),
    max_leaves=8,
)


@settings(max_examples=150, deadline=2000)
@given(_EXPRESSIONS)
def test_arithmetic_is_that_of_python(text):
    """The peer is Python's own parser, here on text that this test has made."""
    expected = eval(text, {"__builtins__": {}}, {"x": 0.75, "y": -1.5})
    assert float(parse(text).subs({X: 0.75, Y: -1.5})) == pytest.approx(expected, rel=1e-9, abs=1e-9)
