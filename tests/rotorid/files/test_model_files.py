"""Model files of `fit` and `identify`: what they say, what is refused, and matrices that are written."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from cases import each_of
from exact_solutions import frequency_response
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL
from timedomain_cases import state_space_of

import fem
from rotorid.files import InputError, read_harmonic_model, read_ode_model, read_rotor
from rotorid.files.settings import toml_bytes
from rotorid.files.small_model import equations_of
from rotorid.reduction import reduce
from rotorid.samples import sample_data

SMALL = 'equations = ["(m*p**2 + b*p + c)*X = F"]\nknown = { m = 10.0 }\nestimate = ["c", "b"]\n'
STATES = """
inputs = ["u"]
[states]
x = "v"
v = "-k*x - c*v + u"
[initial]
x = "x0"
v = 0
[outputs]
y = "x"
z = "2*v"
[estimate]
k = 2
c = 0.1
x0 = 1.0
[known]
g = 9.81
[bounds]
c = [0, inf]
"""
MATRICES = """
M = [["m1", 0], [0, 2.0]]
K = [["k + 1", -1], [-1, 3]]
coordinates = ["a", "b"]
inputs = ["u"]
[force]
b = "u"
[initial]
a = 0.5
[estimate]
m1 = 4.0
k = 1.0
"""


def saved(folder, content):
    path = folder / "m.toml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_a_model_of_amplitudes(tmp_path):
    more = 'inputs = ["F"]\n[bounds]\nc = [0, 2e6]\nb = [0, inf]\n[start]\nc = 900\n'
    more += "[errors]\namplitude_percent = 2\nphase_deg = 1\nfloor = 1e-6\n"
    file = read_harmonic_model(saved(tmp_path, SMALL + more))
    assert (file.model.parameters, file.model.known, file.model.inputs) == (("c", "b"), {"m": 10.0}, ("F",))
    assert (file.bounds, file.start) == ({"c": (0.0, 2e6), "b": (0.0, math.inf)}, {"c": 900.0})
    assert (file.errors.relative, file.errors.floor) == (0.02, 1e-6)
    assert file.errors.phase == pytest.approx(math.radians(1))


def test_a_model_of_states(tmp_path):
    model = read_ode_model(saved(tmp_path, STATES))
    assert (model.states, model.parameters) == (("x", "v"), ("k", "c", "x0"))
    assert (model.outputs, model.inputs) == (("y", "z"), ("u",))
    np.testing.assert_array_equal(model.start, [2.0, 0.1, 1.0])
    np.testing.assert_array_equal(model.bounds[1], [0.0, np.inf])
    np.testing.assert_allclose(model.f(0.0, [1.0, 2.0], [2.0, 0.1, 1.0], [3.0])[:, 0], [2.0, 0.8])
    np.testing.assert_allclose(model.x0([2.0, 0.1, 7.0])[:, 0], [7.0, 0.0])


def test_a_model_of_matrices(tmp_path):
    model = read_ode_model(saved(tmp_path, MATRICES.replace('b = "u"', 'b = "cos(t)"')))
    assert (model.states, model.outputs) == (("a", "v_a", "b", "v_b"), ("a", "b"))
    rates = model.f(0.0, [1.0, 0.3, 2.0, 0.4], model.start, [0.0])[:, 0]
    np.testing.assert_allclose(rates, [0.3, (-2 + 2) / 4, 0.4, (1 + 1 - 6) / 2], atol=1e-15)
    np.testing.assert_array_equal(model.x0(model.start)[:, 0], [0.5, 0, 0, 0])


amplitudes, times = read_harmonic_model, read_ode_model


@each_of(
    "read, text, old, new, words",
    [
        (amplitudes, SMALL, "equations", "equation", "key equation: .*did you mean 'equations'"),
        (amplitudes, SMALL, '["(m', '["n = 1", "(n', "equation 2.* n"),
        (amplitudes, SMALL, "X = F", "X*X = F", "equation 1.*linear"),
        (amplitudes, SMALL, '["c", "b"]', '["c", "k"]', "k .*stands in no equation"),
        (amplitudes, SMALL, '["c", "b"]', '["c", "b", "m"]', "known value m: m is already a parameter"),
        (
            amplitudes,
            SMALL,
            'b"]\n',
            'b"]\n[bounds]\nd = [0, 1]\n',
            "key bounds.*d is none",
        ),
        (amplitudes, SMALL, 'b"]\n', 'b"]\n[bounds]\nc = [1, 1]\n', r"key bounds.*\[lowest, highest\] of c"),
        (amplitudes, SMALL, 'b"]\n', 'b"]\n[bounds]\nc = [false, 1]\n', "key bounds.c: found 'false'"),
        (amplitudes, MATRICES, '"u"\n', '"cos(3*t)"\n', r"'cos\(3\*t\)' is neither a polynomial"),
        (amplitudes, MATRICES, '"u"\n', '"u*t"\n', "t has no meaning for amplitudes: .*measured input"),
        (amplitudes, MATRICES, "[force]", 'per_record = ["k"]\n[force]', "k has no meaning for amplitudes"),
        (amplitudes, STATES, "", "", r"\[states\] are for `fit`"),
        (times, SMALL, "", "", "equations are"),
        (times, STATES, "c*v + u", "c*v + w", "state v: .*w is not defined here"),
        (times, STATES, 'x = "x0"\n', "", "the value of the state x is missing"),
        (times, STATES, 'x = "x0"\n', 'x = "u"\n', "initial x: .*u is not defined here"),
        (times, STATES, "c = [0, inf]", "c = [1, 2]", "key bounds: .*of c, .*starting value"),
        (times, STATES, 'inputs = ["u"]', 'inputs = ["u", "x"]', "input x: x is already a state"),
        (times, MATRICES, '[["m1", 0]', '[["m1"]', "key M: .*square matrices"),
        (times, MATRICES, "a = 0.5", "c = 0.5", "initial: c is no state"),
    ],
)
def test_complaints_name_file_and_key(tmp_path, read, text, old, new, words):
    assert old in text
    path = saved(tmp_path, text.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read(path)
    assert re.search(words, str(caught.value), re.DOTALL), str(caught.value)
    assert str(path) in str(caught.value)


EVIL = "__import__('pathlib').Path('{}').touch()"


@each_of(
    "text",
    [
        'equations = ["EVIL = F"]\nestimate = ["c"]\n',
        'equations = ["c*X = F"]\nestimate = ["c"]\ninputs = ["EVIL"]\n',
        'equations = ["c*X = F"]\nestimate = ["c"]\n[known]\n"EVIL" = 1\n',
        'equations = ["c*X = F"]\nestimate = ["c"]\n[bounds]\nc = ["EVIL", 1]\n',
        'estimate = ["c"]\nM = [[1]]\nK = [["c"]]\noutputs = { "EVIL" = "y1", z = "EVIL" }\n',
    ],
)
def test_no_text_of_a_model_file_runs_code(tmp_path, text):
    mark = tmp_path / "mark"
    with pytest.raises(InputError, match=r"m\.toml"):
        read_harmonic_model(saved(tmp_path, text.replace("EVIL", EVIL.format(mark))))
    assert not mark.exists()


@pytest.fixture(scope="module")
def three():
    return reduce(read_rotor(sample_data() / "rotor23.csv"), (7, 12, 18), 2).equations_of_motion


def test_nothing_to_estimate(tmp_path, three):
    """Such a file is simulated and read back; fit and identify refuse it in words."""
    path = saved(tmp_path, toml_bytes(equations_of(three, {}, outputs=["x7", "v_x18"]), ["one\nM = 3"]))
    assert path.read_text().startswith("# one\n# M = 3\n")
    model = read_ode_model(path)
    assert (model.parameters, model.outputs) == ((), ("x7", "v_x18"))
    with pytest.raises(InputError, match="no parameter is to be estimated"):
        read_harmonic_model(path)


@settings(max_examples=100 if FULL else 40)
@given(
    entries=st.lists(st.integers(-3, 3), min_size=27, max_size=27),
    light=st.sets(st.integers(0, 2), max_size=2),
    damped=st.booleans(),
    force=st.integers(0, 2),
)
def test_time_and_amplitudes_have_the_response_of_the_matrices(
    tmp_path_factory, entries, light, damped, force
):
    """Written in matrices, read for time or amplitudes: always the same response."""
    M, C, K = np.array(entries, dtype=float).reshape(3, 3, 3) / 10
    M = M @ M.T + np.diag([2.0, 3.0, 4.0])
    C = C + (np.diag([6.0, 5.0, 7.0]) if damped else 0)
    K = K + np.diag([20.0, 30.0, 40.0])
    for i in light:
        M[i], M[:, i] = 0, 0
        if not damped:
            C[i], C[:, i] = 0, 0
    names = ("x1", "x2", "y1")
    motion = fem.Motion(M, C, K, names, 0.0)
    heavy = [name for i, name in enumerate(names) if i not in light]
    force = force if damped or force not in light else names.index(heavy[0])
    content = toml_bytes(equations_of(motion, {heavy[0]: 2.0}, inputs=[f"f_{names[force]}"], outputs=heavy))
    path = saved(tmp_path_factory.mktemp("f"), content)
    w = np.array([0.7, 2.9, 8.0])
    damping = C + np.diag([2.0 if name == heavy[0] else 0.0 for name in names])
    s = w[:, None, None]
    exact = np.linalg.inv(-s * s * M + 1j * s * damping + K)[:, :, force]
    exact = exact[:, [names.index(name) for name in heavy]]
    found = frequency_response(state_space_of(read_ode_model(path)), w)[:, :, 0]
    np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-10)
    file = read_harmonic_model(path)
    inputs = {name: np.ones(3, dtype=complex) for name in file.model.inputs}
    predicted = file.model.predict(np.array([2.0]), w, inputs)
    for i, name in enumerate(heavy):
        np.testing.assert_allclose(predicted[name], exact[:, i], rtol=1e-8, atol=1e-10)
