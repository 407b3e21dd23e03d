"""Equivalent masses of the 23-element rotor by formula (50), [S] tasks 9.1 and 9.2.

Three kinds of numbers: the inputs that the book takes from its rotor, beside those of the rotor computed
here; what follows from the printed inputs, beside what the book prints; and the same results from inputs with
all digits, which differ because three digits are too few for one mode.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import fem
from rotorid.base.arrays import FloatArray
from rotorid.reduction import equivalent_masses, natural_frequencies
from rotorid.samples import sample_data
from rotorid.tables import read_rotor
from rotorid.validation.row import Printed, Row

NODES = (7, 12, 18)
SUPPORTS = (2, 22)
INPUTS = "[S] task 9.1, inputs"
ONE = "[S] task 9.1, one mode"
TWO = "[S] task 9.2, two modes"
EXACT = {1: "[S] task 9.1, with all digits", 2: "[S] task 9.2, with all digits"}
BOOK = Printed("masses.csv")
ALPHA = [f"alpha{i}{j}" for i in (1, 2, 3) for j in range(i, 4)]


@dataclass(frozen=True, eq=False)
class Inputs:
    """What formula (50) needs, for three masses and two modes.

    Attributes
    ----------
    alpha
        Compliance, m/N, shape (3, 3).
    omega
        rad/s, shape (2,).
    shapes
        1 at the first mass, shape (3, 2).
    """

    alpha: FloatArray
    omega: FloatArray
    shapes: FloatArray

    def masses(self, modes: int) -> FloatArray:
        """Masses, kg, from the first modes."""
        return equivalent_masses(self.alpha, self.omega[:modes], self.shapes[:, :modes]).values

    def frequencies(self, masses: FloatArray) -> FloatArray:
        """Natural frequencies of the three masses, rad/s."""
        return natural_frequencies(self.alpha, masses)[0]


def rows() -> list[Row]:
    """All rows of formula (50)."""
    rotor = read_rotor(sample_data() / "rotor23.csv")
    exact, printed = of_rotor(rotor), as_printed()
    return [*_inputs(rotor, exact), *_results(printed, exact), *_with_all_digits(exact)]


def as_printed() -> Inputs:
    """Inputs of the book's computation."""
    value = {name: BOOK.number(INPUTS, quantity) for name, quantity in _names().items()}
    alpha = [[value[f"alpha{min(i, j)}{max(i, j)}"] for j in (1, 2, 3)] for i in (1, 2, 3)]
    shapes = [[1.0, 1.0], [value["U21"], value["U22"]], [value["U31"], value["U32"]]]
    return Inputs(np.array(alpha), np.array([value["lambda1"], value["lambda2"]]) ** -0.5, np.array(shapes))


def _names() -> dict[str, str]:
    """The quantities of the inputs by their names."""
    return {
        **{name: f"{name}, m/N" for name in ALPHA},
        **{f"U{i}{k}": f"U{i}{k}, shape of mode {k} at mass {i}" for k in (1, 2) for i in (2, 3)},
        **{f"lambda{k}": f"lambda{k} = 1/omega{k}^2, s^2" for k in (1, 2)},
    }


def of_rotor(rotor: fem.Rotor) -> Inputs:
    """The same inputs from the finite elements, with all digits."""
    modes = fem.critical_speeds(rotor, 2)
    shapes = modes.shapes[np.array(NODES) - 1]
    return Inputs(fem.compliance(rotor, NODES), modes.frequencies, shapes / shapes[0])


def _inputs(rotor: fem.Rotor, exact: Inputs) -> list[Row]:
    """The printed inputs beside those of the rotor."""
    start, end = rotor.positions[np.array(SUPPORTS) - 1]
    places = rotor.positions[np.array(NODES) - 1] - start
    value = {name: exact.alpha[int(name[-2]) - 1, int(name[-1]) - 1] for name in ALPHA}
    value |= {f"U{i}{k}": exact.shapes[i - 1, k - 1] for k in (1, 2) for i in (2, 3)}
    value |= {f"lambda{k}": exact.omega[k - 1] ** -2 for k in (1, 2)}
    return BOOK.rows(
        INPUTS,
        {
            **{f"a{i}, m from the left support": place for i, place in enumerate(places, start=1)},
            "l, distance of the supports, m": end - start,
            "elements in the printed table": len(rotor.length),
            **{quantity: value[name] for name, quantity in _names().items()},
            "alpha22 of the running text, m/N": exact.alpha[1, 1],
        },
    )


def _results(printed: Inputs, exact: Inputs) -> list[Row]:
    """What follows from the printed inputs; frequencies, as in the book, from the rounded masses."""
    one, two = printed.masses(1), printed.masses(2)
    rounded = np.array([BOOK.number(ONE, f"{name}, rounded") for name in _masses(one)])
    first = printed.frequencies(rounded)
    second = printed.frequencies(np.array([BOOK.number(TWO, name) for name in _masses(two)]))
    numbers = {**_masses(one), **{f"{name}, rounded": m for name, m in _masses(one).items()}}
    numbers |= _eigenvalues(first) | _frequencies(first)
    numbers["omega2 above that of the rotor, %"] = 100 * (first[1] / exact.omega[1] - 1)
    after = _masses(two) | _eigenvalues(second) | _frequencies(second)
    return [*BOOK.rows(ONE, numbers), *BOOK.rows(TWO, after)]


def _with_all_digits(exact: Inputs) -> list[Row]:
    """The book's results beside those of the rotor's own compliances and shapes, with all digits."""
    found = []
    for modes, source in EXACT.items():
        masses = exact.masses(modes)
        omega = exact.frequencies(masses)
        values = _masses(masses) | _frequencies(omega)
        if modes == 1:
            values["omega2 above that of the rotor, %"] = 100 * (omega[1] / exact.omega[1] - 1)
        found += BOOK.rows(source, values)
    return found


def _masses(values: FloatArray) -> dict[str, float]:
    return {f"m{i}, kg": value for i, value in enumerate(values.tolist(), start=1)}


def _eigenvalues(omega: FloatArray) -> dict[str, float]:
    found = {f"eigenvalue {k}, s^2": value**-2 for k, value in enumerate(omega.tolist(), start=1)}
    rounded = {f"eigenvalue {k} as the root is taken of it, s^2": omega[k - 1] ** -2 for k in (1, 2)}
    return found | rounded


def _frequencies(omega: FloatArray) -> dict[str, float]:
    return {f"omega{k}, rad/s": value for k, value in enumerate(omega.tolist()[:2], start=1)}
