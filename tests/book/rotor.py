"""The rotor of 23 elements, [S] tasks 9.1 and 9.2: critical speeds, shapes, equivalent masses (50).

The masses are computed three times: from the inputs as the book prints them; from the rotor's own, with all
digits; and of these, with one and two modes, once more beside the printed masses, which follow from a
misprint.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

import fem
from book.printed import below, parts, read
from rotorid.files import read_rotor
from rotorid.reduction import equivalent_masses, natural_frequencies
from rotorid.samples import sample_data

NODES = (7, 12, 18)
SUPPORTS = (2, 22)
INPUTS = "[S] task 9.1, inputs"
PRINTED = {1: "[S] task 9.1, one mode", 2: "[S] task 9.2, two modes"}
EXACT = {1: "[S] task 9.1, with all digits", 2: "[S] task 9.2, with all digits"}
RECOMPUTED = "[S] tasks 9.1 and 9.2 recomputed, {}"
ALPHA = [(i, j) for i in (1, 2, 3) for j in range(i, 4)]
ABOVE = "omega2 above that of the rotor, %"


@dataclass(frozen=True)
class Inputs:
    """Compliance (3, 3), m/N; frequencies (n,), rad/s; shapes (3, n), 1 at the first mass."""

    alpha: np.ndarray
    omega: np.ndarray
    shapes: np.ndarray

    def masses(self, modes):
        return equivalent_masses(self.alpha, self.omega[:modes], self.shapes[:, :modes])

    def frequencies(self, masses):
        return natural_frequencies(self.alpha, masses)[0]


@cache
def book():
    return read("s_masses.csv")


def _number(quantity, source=INPUTS):
    return float(book()[source, quantity].printed)


def as_printed():
    """Inputs of the book's computation."""
    alpha = [[_number(f"alpha{min(i, j)}{max(i, j)}, m/N") for j in (1, 2, 3)] for i in (1, 2, 3)]
    shapes = [[_number(f"U{i}{k}, shape of mode {k} at mass {i}") for k in (1, 2)] for i in (2, 3)]
    squares = [_number(f"lambda{k} = 1/omega{k}^2, s^2") for k in (1, 2)]
    return Inputs(np.array(alpha), np.array(squares) ** -0.5, np.array([[1.0, 1.0], *shapes]))


def exact():
    """The same from the finite elements, with three modes."""
    rotor = read_rotor(sample_data() / "rotor23.csv")
    modes = fem.critical_speeds(rotor, 3)
    shapes = modes.shapes[np.array(NODES) - 1]
    return Inputs(fem.compliance(rotor, NODES), modes.frequencies, shapes / shapes[0])


def speeds_and_shapes():
    """Slender elements, consistent masses, no shear, no rotary inertia: the defaults of a rotor table."""
    rotor = read_rotor(sample_data() / "rotor23.csv")
    modes, fine = fem.critical_speeds(rotor, 3), fem.critical_speeds(fem.refined(rotor, 12), 3)
    names = "critical speed {}, rad/s", "critical speed {}, each element cut into twelve, rad/s"
    shapes = modes.shapes / modes.shapes[0]
    again = parts(names[0], modes.frequencies) | parts(names[1], fine.frequencies)
    return {
        **below("[S] task 9.1, critical speeds", parts(names[0], modes.frequencies)),
        **below(
            "[S] task 9.1, mode shapes",
            {f"mode {k + 1}, node {i + 1}": value for (i, k), value in np.ndenumerate(shapes)},
        ),
        **below("[S] task 9.1, critical speeds recomputed", again),
    }


def masses():
    """Formula (50); frequencies, as in the book, from the rounded masses."""
    own, printed = exact(), as_printed()
    found = below(INPUTS, _inputs(own))
    for modes, source in PRINTED.items():
        values = printed.masses(modes).values
        names = "m{}, kg, rounded" if modes == 1 else "m{}, kg"
        omega = printed.frequencies([_number(names.format(i), source) for i in (1, 2, 3)])
        numbers = parts("m{}, kg", values) | parts("omega{}, rad/s", omega[:2])
        numbers |= parts("eigenvalue {}, s^2", omega**-2.0)
        numbers |= parts("eigenvalue {} as the root is taken of it, s^2", omega[:2] ** -2.0)
        if modes == 1:
            numbers |= parts(names, values) | {ABOVE: 100 * (omega[1] / own.omega[1] - 1)}
        found |= below(source, numbers)
    for modes in (1, 2, 3):
        values = own.masses(modes).values
        omega = own.frequencies(values)
        numbers = parts("m{}, kg", values) | parts("omega{}, rad/s", omega)
        found |= below(RECOMPUTED.format("1 mode" if modes == 1 else f"{modes} modes"), numbers)
        if modes < 3:
            numbers.pop("omega3, rad/s")
            above = {ABOVE: 100 * (omega[1] / own.omega[1] - 1)} if modes == 1 else {}
            found |= below(EXACT[modes], numbers | above)
    return found


def _inputs(own):
    rotor = read_rotor(sample_data() / "rotor23.csv")
    start, end = rotor.positions[np.array(SUPPORTS) - 1]
    places = rotor.positions[np.array(NODES) - 1] - start
    return {
        **parts("a{}, m from the left support", places),
        "l, distance of the supports, m": end - start,
        "elements in the printed table": len(rotor.length),
        **{f"alpha{i}{j}, m/N": own.alpha[i - 1, j - 1] for i, j in ALPHA},
        **{
            f"U{i}{k}, shape of mode {k} at mass {i}": own.shapes[i - 1, k - 1]
            for i in (2, 3)
            for k in (1, 2)
        },
        **{f"lambda{k} = 1/omega{k}^2, s^2": own.omega[k - 1] ** -2 for k in (1, 2)},
        "alpha22 of the running text, m/N": own.alpha[1, 1],
    }
