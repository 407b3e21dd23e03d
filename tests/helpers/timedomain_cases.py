"""Models and records of [Q] and [F], and oscillators, for tests of fits."""

import numpy as np

import fem
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

CHAIN_STATES = {
    "y1": "v1",
    "v1": "(-(c1 + c2)*y1 + c2*y2)/m1",
    "y2": "v2",
    "v2": "(c2*y1 - (c2 + c3)*y2 + c3*y3)/m2",
    "y3": "v3",
    "v3": "(c3*y2 - (c3 + c4)*y3)/m3",
}
CHAIN_INITIAL = dict(zip(CHAIN_STATES, (0.5, 0.1, -0.2, -0.1, 0.3, 0.1), strict=True))
CHAIN_OPTIMUM = np.array([0.13999975, 11.99998962, 28.00000273])
CHAIN_ERRORS = np.array([5.6e-7, 1.2e-5, 1.0e-5])


def chain():
    """[F]: three masses, c1, m1 and m2 unknown."""
    return ode_model(
        CHAIN_STATES,
        initial=CHAIN_INITIAL,
        known={"c2": 0.3, "c3": 0.2, "c4": 0.12, "m3": 18.0},
        estimate={"c1": 0.1, "m1": 11.0, "m2": 23.0},
    )


def chain_record():
    """The exact record of (0.14, 12, 28), rounded to five significant digits."""
    model, t = chain(), np.round(0.2 * np.arange(251), 10)
    exact = simulate(model, [0.14, 12.0, 28.0], t, sensitivities=False).y
    rounded = np.array([[float(f"{v:.4e}") for v in row] for row in exact])
    return Record(t, dict(zip(model.outputs, rounded.T, strict=True)))


def book_model():
    """[Q]."""
    return ode_model(
        {"x1": "theta1*x2", "x2": "theta2*x1 + theta3*x2 + cos(t)"},
        initial={"x1": 1.5, "x2": 1.0},
        outputs={"y1": "x1 + 2*x2", "y2": "2*x1 + x2"},
        estimate={"theta1": 0.0, "theta2": 0.0, "theta3": 0.0},
    )


def decay(**options):
    return ode_model({"x": "-a*x"}, initial={"x": "x0"}, estimate={"a": 0.5, "x0": 1.0}, **options)


def decay_record(n=41, error=0.01, **options):
    t = np.linspace(0.0, 4.0, n)
    noise = error * np.random.default_rng(0).standard_normal(n)
    return Record(t, {"x": 2.0 * np.exp(-0.8 * t) + noise}, **options)


def state_space_of(model, theta=None):
    """A linear model s' = A s + B u, y = C s + D u: C and D are outputs of unit states and inputs."""
    theta = model.start if theta is None else np.asarray(theta, dtype=float)
    n, both = len(model.states), np.eye(len(model.states) + len(model.inputs))
    A, _, B = np.split(model.matrices(theta)[0], np.add(n, (0, 1)), axis=1)
    C, D = np.split(
        model.h(np.zeros(len(both)), both[:, :n, None], theta, both[:, n:])[..., 0].T, [n], axis=1
    )
    return fem.StateSpace(A, B, C, D, model.states, model.inputs, model.outputs)
