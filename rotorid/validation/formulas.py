"""Misprinted equations of [S]: what they, and the right ones, leave at what the program predicts.

The equations stand in `data/formulas.csv`, each with the exercise of `sample_data/identify` whose true
parameters it is tried with: amplitudes `X` with `X_r`, `X_i` and `X_phi`, the frequency `w` and `p = iw`; of
free vibration `A1`, `A2` and `z`, and of the beam of task 8.1 `EI` and `delta12`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

import fem
from rotorid.base.arrays import ComplexArray
from rotorid.expressions import parse_equation
from rotorid.harmonic.natural_frequencies import natural_modes
from rotorid.tables import read_measurements
from rotorid.validation.identification import beam, exercise
from rotorid.validation.row import Row, printed_table, row

SOURCE = "[S] misprinted equations"
REASON = "a share of the larger side, of which rounding leaves less than 1e-9"


def rows() -> list[Row]:
    """Two rows a misprint: what the printed equation leaves (not 0), and the corrected one (0)."""
    found = []
    for line in printed_table("formulas.csv"):
        values = _solution(line["exercise"])
        for words, worst, erratum in (("printed", min, line["erratum"]), ("corrected", max, "")):
            left = worst(residual(text, values) for text in line[words].split(";"))
            found.append(
                row(SOURCE, f"{line['quantity']}, left as {words}", "0", left, 1e-9, REASON, erratum)
            )
    return found


def residual(text: str, values: Mapping[str, ComplexArray]) -> float:
    """Largest difference of the two sides of an equation, as a share of the larger side."""
    import sympy

    names = [sympy.Symbol(name) for name in values]
    left, right = (sympy.lambdify(names, side, "numpy")(*values.values()) for side in parse_equation(text))
    return float(np.abs(left - right).max() / max(np.abs(left).max(), np.abs(right).max()))


def _solution(folder: str) -> Mapping[str, ComplexArray]:
    """Parameters and amplitudes of an exercise at its true parameters."""
    path, file, expected = exercise(folder)
    model, data = file.model, read_measurements(path / "data.csv", file)
    theta = np.array([expected["truth"][name] for name in model.parameters])
    values = {name: np.array(number) for name, number in (model.known | expected["truth"]).items()}
    if data.free.all():
        shaft = beam()
        z, shapes = natural_modes(model.dynamic_stiffness(theta)[0])
        values |= {"z": z, "A1": np.ones(2), "A2": shapes[1] / shapes[0]}
        stiffness = shaft.youngs_modulus * shaft.second_moment
        return values | {"EI": stiffness[0], "delta12": fem.compliance(shaft, (4, 7))[0, 1]}
    w, inputs = data.frequencies, {name: data.signals[name] for name in model.inputs}
    for name, Z in (inputs | model.predict(theta, w, inputs)).items():
        values |= {name: Z, f"{name}_r": Z.real, f"{name}_i": Z.imag, f"{name}_phi": np.angle(Z)}
    return values | {"w": w, "p": 1j * w}
