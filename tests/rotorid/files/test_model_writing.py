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
from timedomain_cases import state_space_of

import fem
from rotorid.files import InputError, read_harmonic_model, read_ode_model, read_rotor
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
    path = saved(tmp_path, "m.toml", toml_bytes(equations_of(three, {}, outputs=["x7", "v_x18"])))
    model = read_ode_model(path)
    assert (model.parameters, model.outputs) == ((), ("x7", "v_x18"))
    with pytest.raises(InputError, match="no parameter is to be estimated"):
        read_harmonic_model(path)


MATRICES = """
M = [["m", 0], [0, 2.0]]
C = [[0.3, 0.1], [-0.1, "d"]]
K = [[5, -1], [-1, "k"]]
inputs = ["u"]
[force]
y1 = "g*u"
[known]
g = 2.5
[estimate]
m = 4.0
d = 0.5
k = 3.0
"""


@each_of(
    ("old", "new", "words"),
    [
        ('"g*u"', '"g*cos(3*t)"', r"'cos\(3\*t\)' is neither a polynomial"),
        ('"g*u"', '"g*u*t"', r"t has no meaning for amplitudes: .*measured input"),
        ('[["m", 0]', '[["m"]', r"key M: .*expected square matrices"),
        ("[force]", 'per_record = ["k"]\n[force]', r"k has no meaning for amplitudes"),
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
        (
            read_harmonic_model,
            "[states]\nx = 1\n[estimate]\nk = 9.0",
            r"\[states\] are for `fit`",
        ),
        (
            read_ode_model,
            'equations = ["k*X = F"]\nestimate = ["k"]',
            r"equations are",
        ),
    ],
)
def test_models_that_are_none(tmp_path, read, text, words):
    with pytest.raises(InputError) as caught:
        read(saved(tmp_path, "m.toml", text))
    assert re.search(words, str(caught.value), re.DOTALL), str(caught.value)


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
