"""Eight bearing coefficients from harmonic tests, with intervals, and what one test alone could tell.

Run `python examples/identify_bearings.py [PICTURE.png]`. The readings are simulated: 1 % and 0.5°.
"""

from __future__ import annotations

import sys

import numpy as np

from rotorid.identify import AmplitudeErrors, Experiments, experiments, harmonic_model, identify
from rotorid.plots import plot

EQUATIONS = (
    "(m*p**2 + bxx*p + kxx)*X + (bxy*p + kxy)*Y = FX",
    "(byx*p + kyx)*X + (m*p**2 + byy*p + kyy)*Y = FY",
)
STIFFNESS = np.array([[9.0e7, 3.0e7], [-8.0e7, 1.6e8]])  # N/m
DAMPING = np.array([[5.0e5, -1.5e5], [-1.5e5, 8.0e5]])  # N·s/m
MASS = 300.0  # kg, of the housing that a shaker drives
NAMES = ("kxx", "kxy", "kyx", "kyy", "bxx", "bxy", "byx", "byy")
TRUTH = dict(zip(NAMES, [*STIFFNESS.ravel(), *DAMPING.ravel()], strict=True))
ERRORS = AmplitudeErrors(relative=0.01, phase=np.deg2rad(0.5))
MODEL = harmonic_model(EQUATIONS, known={"m": MASS}, estimate=NAMES)


def tests(directions: str) -> Experiments:
    """Readings of a shaker of 1 kN at four frequencies in each direction, with their errors."""
    rng = np.random.default_rng(1)
    frequencies, rows = [], []
    for direction in directions:
        for omega in (100.0, 200.0, 300.0, 400.0):
            force = np.array([direction == "x", direction == "y"]) * 1000.0
            dynamic = STIFFNESS - omega**2 * MASS * np.eye(2) + 1j * omega * DAMPING
            exact = np.linalg.solve(dynamic, force)
            scatter = ERRORS.relative * rng.standard_normal(2) + 1j * ERRORS.phase * rng.standard_normal(2)
            rows.append([*force, *(exact * (1 + scatter))])
            frequencies.append(omega)
    FX, FY, X, Y = np.array(rows).T
    return experiments(MODEL, frequencies, {"FX": FX, "FY": FY, "X": X, "Y": Y}, errors=ERRORS)


def main(picture: str | None = None) -> dict[str, float]:
    """Print estimates and intervals; return them with the truth inside or not."""
    # Two directions: all eight are determined.
    found = identify(MODEL, tests("xy"))
    print(found.summary(), end="\n\n")
    assert found.ci95 is not None
    inside = [bool(low <= TRUTH[name] <= high) for name, (low, high) in zip(NAMES, found.ci95, strict=True)]
    print(f"{sum(inside)} of {len(inside)} intervals hold the true value", end="\n\n")

    # One direction: the readings of x and y move together at each frequency, errors are magnified.
    one = identify(MODEL, tests("x"))
    print("one direction only:", one.summary(), sep="\n")

    if picture is not None:
        plot(found).figure.savefig(picture)
    assert found.std is not None
    assert one.std is not None
    return {
        **{name: float(value) for name, value in zip(NAMES, found.values, strict=True)},
        "intervals_that_hold_the_truth": sum(inside),
        "condition_number": found.estimate.condition_number,
        "worse_kyy_std": float(one.std[3] / found.std[3]),
    }


if __name__ == "__main__":
    main(*sys.argv[1:2])
