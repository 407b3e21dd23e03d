"""One model file for `rotorid fit` and `rotorid identify`, written from matrices and read back."""

from __future__ import annotations

import re

import numpy as np
import pytest
from cases import each_of
from exact_solutions import frequency_response
from hypothesis import given, settings
from hypothesis import strategies as st
from repetitions import FULL
from timedomain_cases import motion_in, state_space_of

import fem
from rotorid.files import InputError, TableWarning, read_harmonic_model, read_ode_model, read_rotor
from rotorid.files.settings import toml_bytes
from rotorid.files.small_model import equations_of
from rotorid.identify import identify
from rotorid.identify.amplitudes import experiments
from rotorid.reduction import reduce
from rotorid.samples import sample_data

TRUTH = {"d_x7": 1234.5, "d_x12": 321.0, "d_x18": 567.0}
BEGIN = {"x7": 2000.0, "x12": 500.0, "x18": 400.0}
FREQUENCIES = np.array([40.0, 90.0, 133.0, 136.0, 300.0, 530.0, 545.0, 1000.0])


@pytest.fixture(scope="module")
def three():
    return reduce(read_rotor(sample_data() / "rotor23.csv"), (7, 12, 18), 2).equations_of_motion


def begun(content, value):
    """A file of matrices with an initial value."""
    return content.replace(b"\n[estimate]", f"\n[initial]\n{value}\n\n[estimate]".encode())


def saved(folder, name, content):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def response(motion, dampers, forces):
    """Amplitudes (frequencies, n) of a motion with dampers to the ground, solved here."""
    C = motion.C + np.diag([dampers.get(f"d_{name}", 0.0) for name in motion.coordinates])
    w = FREQUENCIES[:, None, None]
    dynamic = -w * w * motion.M + 1j * w * C + motion.K
    return np.stack([np.linalg.solve(one, forces) for one in dynamic])


@pytest.mark.parametrize("inputs", [(), ("f_x7",)])
def test_amplitudes_give_the_dampers_of_a_reduced_rotor(tmp_path, three, inputs):
    content = toml_bytes(equations_of(three, BEGIN, inputs=inputs, outputs=["x7", "x12"]), ["one\nM = 3", ""])
    assert content.startswith(b"# one\n# M = 3\n# \nschema_version = 1\n")
    file = read_harmonic_model(saved(tmp_path, "m.toml", content))
    assert file.model.outputs == ("x7", "x12", "x18")
    assert file.unmeasured == ("x18",)
    X = response(three, TRUTH, np.array([2.0, 0, 0]))
    forces = dict.fromkeys(file.model.inputs, 0.0) | {"f_x7": 2.0}
    signals = {name: X[:, i] for i, name in enumerate(three.coordinates)}
    answer = identify(file.model, experiments(file.model, FREQUENCIES, signals | forces))
    np.testing.assert_allclose(answer.values, [*TRUTH.values()], rtol=1e-6)


def test_nothing_to_estimate(tmp_path, three):
    """Such a file is simulated and read back; fit and identify refuse it in words."""
    path = saved(
        tmp_path, "m.toml", begun(toml_bytes(equations_of(three, {}, outputs=["x7", "v_x18"])), "x7 = 0.001")
    )
    model = read_ode_model(path)
    assert model.parameters == ()
    assert model.outputs == ("x7", "v_x18")
    np.testing.assert_array_equal(motion_in(path).K, three.K)
    with pytest.raises(InputError, match="no parameter is to be estimated"):
        read_harmonic_model(path)


def test_what_nothing_holds_is_refused():
    loose = fem.Motion(np.diag([1.0, 0.0]), np.zeros((2, 2)), np.diag([1.0, 0.0]), ("x1", "x2"), 0.0)
    with pytest.raises(ValueError, match="neither mass nor damping need stiffness"):
        equations_of(loose, {})


MATRICES = """
M = [["m", 0], [0, 2.0]]
C = [[0.3, 0.1], [-0.1, "d"]]
K = [[5, -1], [-1, "k"]]
inputs = ["u"]
[force]
y1 = "g*u"
[outputs]
a = "1e3*y1"
w = "v_y2/4"
both = "y1 + 2*y2"
[known]
g = 2.5
[estimate]
m = 4.0
d = 0.5
k = 3.0
[bounds]
d = [0, inf]
[errors]
amplitude_percent = 1
"""

STATES = """
inputs = ["u"]
[states]
x = "u - k*x"
[initial]
x = 0
[estimate]
k = 9.0
"""


def predicted(file, name, w):
    values = file.model.predict(np.array(list(file.start.values())), w, {"u": np.ones(len(w), dtype=complex)})
    return values[name]


def test_amplitudes_are_those_of_the_model_in_time(tmp_path):
    path = saved(tmp_path, "m.toml", MATRICES)
    file, model = read_harmonic_model(path), read_ode_model(path)
    assert dict(file.start) == dict(zip(model.parameters, model.start, strict=True))
    assert set(model.outputs) <= set(file.model.outputs)
    assert (file.errors.relative, file.bounds) == (0.01, {"d": (0.0, np.inf)})
    w = np.array([0.1, 1.0, 2.7, 9.0])
    expected = frequency_response(state_space_of(model), w)[:, :, 0]
    for i, name in enumerate(model.outputs):
        np.testing.assert_allclose(predicted(file, name, w), expected[:, i], rtol=1e-12)


def test_a_parameter_of_the_start_alone_is_left_out(tmp_path):
    path = saved(tmp_path, "m.toml", MATRICES.replace("k = 3.0", "k = 3.0\nv0 = 1.0"))
    with pytest.warns(TableWarning, match=r"v0: in no equation of amplitudes, .* left out"):
        assert read_harmonic_model(path).model.parameters == ("m", "d", "k")


@each_of(
    ("old", "new", "words"),
    [
        ('"g*u"', '"g*cos(3*t)"', r"'cos\(3\*t\)' is neither a polynomial"),
        ('"g*u"', '"g*u*t"', r"t has no meaning for amplitudes: .*measured input"),
        ('"g*u"', '"g*u*y1"', r"not linear in the signals: it contains"),
        ('"g*u"', '"g*u + 1"', r"a load without any amplitude has no influence"),
        ('"y1 + 2*y2"', '"y1**2"', r"not linear in the signals"),
        ('[["m", 0]', '[["m", "u"]', r"not linear in the signals"),
        ('[["m", 0]', '[["m"]', r"key M: .*expected square matrices"),
        ('w = "v_y2/4"', 'y2 = "1e3*y1"', r"y2: an amplitude needs a name of its own"),
        ('a = "1e3*y1"', 'k = "1e3*y1"', r"k: an amplitude needs a name of its own"),
        ('y1 = "g*u"', 'y3 = "g*u"', r"y3: .*a force one of y1 or y2"),
        ("[outputs]", 'per = ["m"]\n[outputs]', r"key force.per: .*expected a number, or an expression"),
        ("[force]", 'per_record = ["k"]\n[force]', r"k has no meaning for amplitudes"),
        ('a = "1e3*y1"', 'y1 = "1e3*y2"', r"y1: an amplitude needs a name of its own"),
        ("[force]", "[states]\nx = 1\n[force]", r"key M: .*expected equations, matrices or states"),
        ("k = 3.0", "k = 3.0\np = 1.0", r"p: an amplitude needs a name of its own"),
    ],
)
def test_what_has_no_meaning_for_amplitudes_is_refused(tmp_path, old, new, words):
    assert old in MATRICES
    path = saved(tmp_path, "m.toml", MATRICES.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read_harmonic_model(path)
    assert re.search(words, str(caught.value), re.DOTALL), str(caught.value)
    assert str(path) in str(caught.value)


@each_of(
    ("read", "text", "words"),
    [
        (read_harmonic_model, STATES, r"neither equations nor M and K; \[states\] are for `fit`"),
        (
            read_ode_model,
            'equations = ["k*X = F"]\nestimate = ["k"]',
            r"\[states\], or M and K; equations are",
        ),
        (read_ode_model, 'estimate = ["k"]\n[states]\nx = "k"', r"no starting value of k"),
        (
            read_ode_model,
            STATES.replace("[estimate]", "[estimates]"),
            r"key estimates: .*did you mean 'estimate'",
        ),
        (
            read_ode_model,
            f"{STATES}[bounds]\nk = [10, inf]",
            r"key bounds: .*of k, .*starting value",
        ),
        (read_ode_model, f"{STATES}[bounds]\nkk = [0, 1]", r"key bounds: .*kk is none .did you mean 'k'"),
        (read_ode_model, STATES.replace("u - k", "u - q"), r"state x: 'u - q\*x': q is not defined here"),
        (read_ode_model, STATES.replace("9.0", '"nine"'), r"key estimate.k: found 'nine', expected a number"),
        (
            read_harmonic_model,
            'M = [[1]]\nK = [["f_y1"]]\n[estimate]\nf_y1 = 1.0\n',
            r"f_y1: an amplitude needs",
        ),
    ],
)
def test_models_that_are_none(tmp_path, read, text, words):
    with pytest.raises(InputError) as caught:
        read(saved(tmp_path, "m.toml", text))
    assert re.search(words, str(caught.value), re.DOTALL), str(caught.value)


def test_names_with_starting_values_serve_equations_too(tmp_path):
    path = saved(tmp_path, "m.toml", 'equations = ["(k + c*p)*X = F"]\n[estimate]\nk = 3.0\nc = 1\n')
    assert read_harmonic_model(path).start == {"k": 3.0, "c": 1.0}


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
    path = saved(tmp_path_factory.mktemp("f"), "m.toml", content)
    w = np.array([0.7, 2.9, 8.0])
    damping = C + np.diag([2.0 if name == heavy[0] else 0.0 for name in names])
    s = w[:, None, None]
    exact = np.linalg.inv(-s * s * M + 1j * s * damping + K)[:, :, force]
    exact = exact[:, [names.index(name) for name in heavy]]
    found = frequency_response(state_space_of(read_ode_model(path)), w)[:, :, 0]
    np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-10)
    file = read_harmonic_model(path)
    inputs = {name: np.ones(3, dtype=complex) for name in file.model.inputs}
    amplitudes = file.model.predict(np.array([2.0]), w, inputs)
    for i, name in enumerate(heavy):
        np.testing.assert_allclose(amplitudes[name], exact[:, i], rtol=1e-8, atol=1e-10)
