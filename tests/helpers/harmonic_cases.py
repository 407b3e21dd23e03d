"""Models and simulated readings that several tests of identification share."""

import numpy as np
from coverage_identify import NUMBERS, TWO_MASSES, readings

from rotorid.identify.amplitudes import AmplitudeErrors
from rotorid.identify.equations import harmonic_model
from rotorid.identify.operator_model import HarmonicModel

STATED = AmplitudeErrors(relative=0.02, phase=np.deg2rad(1.0))

FEEDBACK = (
    "(T0*T1*T2*p**3 + (T0*T1 + T0*T2 + T1*T2)*p**2 + (T0 + T1 + T2)*p + 1 + K)*S"
    " = (T1*T2*p**2 + (T1 + T2)*p + 1)*F"
)
PUMP = "(T0**2*T2*p**3 + T0*(2*zeta*T2 + T0)*p**2 + (2*zeta*T0 + K*T1 + T2)*p + 1 + K)*S = (T2*p + 1)*F"
ROTOR = "(m*p**2 + b*p + c)*Z - delta*b*p*Z = -m*e*p**2"


def task51() -> tuple[HarmonicModel, np.ndarray, np.ndarray, dict]:
    """[S] task 5.1: model, true parameters, frequencies, inputs."""
    model = harmonic_model(["(m*p**2 + b*p + c)*X = F"], known={"m": 10.0}, estimate=["c", "b"])
    return model, np.array([1000.0, 10.0]), np.array([10.0, 20.0, 30.0]), {"F": 10.0}


def two_masses(
    estimate: tuple[str, ...] = ("a1", "a2", "a"),
) -> tuple[HarmonicModel, np.ndarray, np.ndarray, dict]:
    """[S] 1.6: two masses, natural frequencies 22.4 and 44.7 rad/s, three dampers unknown."""
    known = {name: value for name, value in NUMBERS.items() if name not in estimate}
    model = harmonic_model(TWO_MASSES, known=known, estimate=estimate)
    truth = np.array([NUMBERS[name] for name in estimate])
    return model, truth, np.array([15.0, 20.0, 25.0, 40.0, 50.0]), {"F1": 100.0}


simulate = readings


def chain(masses: int) -> tuple[list[str], list[str]]:
    """Equations of a chain with dampers and their unknowns m, b, c of each mass."""
    equations = []
    for i in range(1, masses + 1):
        left = f"(m{i}*p**2 + b{i}*p + c{i})*X{i}"
        left += f" - (b{i}*p + c{i})*X{i - 1}" if i > 1 else ""
        left += f" + (b{i + 1}*p + c{i + 1})*(X{i} - X{i + 1})" if i < masses else ""
        equations.append(f"{left} = {'F' if i == 1 else '0'}")
    return equations, [f"{q}{i}" for q in "mbc" for i in range(1, masses + 1)]
