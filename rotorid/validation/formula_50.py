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
from rotorid.validation.row import Row, number, printed_table, row

NODES = (7, 12, 18)
SUPPORTS = (2, 22)
INPUTS = "[S] task 9.1, inputs"
ONE = "[S] task 9.1, one mode"
TWO = "[S] task 9.2, two modes"
EXACT_ONE = "[S] task 9.1, with all digits"
EXACT_TWO = "[S] task 9.2, with all digits"

ROUNDED = {1: ("95.88", "224.28", "136.58"), 2: ("130.05", "199.191", "154.698")}
"""Masses, kg, with which the book goes on."""

EIGENVALUES = {
    1: ("5.4699984884055432907e-5", "2.8445228090759880109e-6", "5.6013830686857908223e-7"),
    2: ("5.4681514908717400444e-5", "3.4134112098230237262e-6", "6.3712088145957582972e-7"),
}
TWICE = "rounded twice: 136.5749 became 136.575, and that 136.58"
DIGITS = "20 digits of an exact solution are printed; double precision holds 15"
ALPHA12 = "printed 1.3 % too large; what follows from it below is right for the printed number only"
RUNNING_TEXT = "the running text prints the value of alpha33; the book's computation uses 16.4e-8"
THREE_DIGITS = (
    "the printed inputs have three digits and alpha12 is wrong, magnified by one mode (condition number 63)"
)
TWO_MODES = "the printed inputs have three digits and alpha12 is wrong (condition number 18)"


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
    texts = {line["quantity"]: line["printed"] for line in printed_table("task_9_inputs.csv")}
    rotor = read_rotor(sample_data() / "rotor23.csv")
    exact, printed = of_rotor(rotor), as_printed(texts)
    return [
        *_places(rotor),
        *_inputs(texts, exact),
        *_results(printed, exact),
        *_with_all_digits(exact),
    ]


def as_printed(texts: dict[str, str]) -> Inputs:
    """Inputs of the book's computation."""
    value = {name: number(text) for name, text in texts.items()}
    alpha = [[value[f"alpha{min(i, j)}{max(i, j)}"] for j in (1, 2, 3)] for i in (1, 2, 3)]
    shapes = [[1.0, 1.0], [value["U21"], value["U22"]], [value["U31"], value["U32"]]]
    return Inputs(np.array(alpha), np.array([value["lambda1"], value["lambda2"]]) ** -0.5, np.array(shapes))


def of_rotor(rotor: fem.Rotor) -> Inputs:
    """The same inputs from the finite elements, with all digits."""
    modes = fem.critical_speeds(rotor, 2)
    shapes = modes.shapes[np.array(NODES) - 1]
    return Inputs(fem.compliance(rotor, NODES), modes.frequencies, shapes / shapes[0])


def _places(rotor: fem.Rotor) -> list[Row]:
    start, end = rotor.positions[np.array(SUPPORTS) - 1]
    places = rotor.positions[np.array(NODES) - 1] - start
    wrong = "the lengths of the printed element table between the two supports sum to 2.76 m"
    return [
        *(
            row(INPUTS, f"a{i}, m from the left support", text, float(places[i - 1]))
            for i, text in enumerate(("0.655", "1.34", "2.105"), start=1)
        ),
        row(
            INPUTS,
            "l, distance of the supports, m",
            "2.74",
            float(end - start),
            erratum=wrong,
            corrected="2.76",
        ),
    ]


def _inputs(texts: dict[str, str], exact: Inputs) -> list[Row]:
    """The printed inputs beside those of the rotor."""
    found = []
    lam = exact.omega**-2
    for name, text in texts.items():
        i, j = (int(digit) - 1 for digit in name[-2:]) if name[0] in "aU" else (int(name[-1]) - 1, 0)
        if name.startswith("alpha"):
            quantity, value = f"{name}, m/N", exact.alpha[i, j]
        elif name.startswith("U"):
            quantity, value = f"{name}, shape of mode {j + 1} at mass {i + 1}", exact.shapes[i, j]
        else:
            quantity, value = f"{name} = 1/omega{i + 1}^2, s^2", lam[i]
        if name == "alpha12":
            found.append(
                row(INPUTS, quantity, text, float(value), erratum=ALPHA12, corrected="1.10521909e-7")
            )
        elif name == "alpha23":
            cut = "one unit of the last digit: 11.076 is cut to 11.07, not rounded"
            found.append(row(INPUTS, quantity, text, float(value), 0.01e-8, cut))
        else:
            found.append(row(INPUTS, quantity, text, float(value)))
    return [
        *found,
        row(
            INPUTS,
            "alpha22 of the running text, m/N",
            "9.35e-8",
            float(exact.alpha[1, 1]),
            erratum=RUNNING_TEXT,
            corrected="1.64475623e-7",
        ),
    ]


def _results(printed: Inputs, exact: Inputs) -> list[Row]:
    """What follows from the printed inputs."""
    one, two = printed.masses(1), printed.masses(2)
    names = [f"m{i}, kg" for i in (1, 2, 3)]
    found = [
        row(ONE, names[0], "95.879", float(one[0])),
        row(ONE, names[1], "224.283", float(one[1])),
        row(
            ONE,
            names[2],
            "136.375",
            float(one[2]),
            erratum="a wrong digit: the next line of the book has it as 136.58",
            corrected="136.575",
        ),
        *(row(ONE, f"{names[i]}, rounded", text, float(one[i])) for i, text in enumerate(ROUNDED[1][:2])),
        row(ONE, f"{names[2]}, rounded", ROUNDED[1][2], float(one[2]), 0.006, TWICE),
        *(row(TWO, name, text, float(m)) for name, text, m in zip(names, ROUNDED[2], two, strict=True)),
    ]
    omega = {}
    for modes, source in ((1, ONE), (2, TWO)):
        omega[modes] = printed.frequencies(np.array([number(text) for text in ROUNDED[modes]]))
        found += [
            row(
                source,
                f"eigenvalue {k + 1}, s^2",
                text,
                float(omega[modes][k] ** -2),
                1e-12 * number(text),
                DIGITS,
            )
            for k, text in enumerate(EIGENVALUES[modes])
        ]
    found += [
        row(ONE, "omega1, rad/s", "135.209", float(omega[1][0])),
        row(
            ONE,
            "omega2, rad/s",
            "593.391",
            float(omega[1][1]),
            erratum="the root of an eigenvalue cut to three digits, 2.84e-6 instead of 2.8445e-6",
            corrected="592.92",
        ),
        row(
            TWO,
            "omega1, rad/s",
            "135.209",
            float(omega[2][0]),
            erratum="the eigenvalue of task 9.1, 5.47e-5, instead of 5.46815e-5",
            corrected="135.23",
        ),
        row(
            TWO,
            "omega2, rad/s",
            "541.261",
            float(omega[2][1]),
            erratum="the root of an eigenvalue cut to five digits, 3.4134e-6 instead of 3.41341e-6",
            corrected="541.26",
        ),
        row(
            ONE,
            "omega2 above that of the rotor, %",
            "10",
            100 * float(omega[1][1] / exact.omega[1] - 1),
        ),
    ]
    return found


def _with_all_digits(exact: Inputs) -> list[Row]:
    """The book's results beside those of the rotor's own compliances and shapes, with all digits."""
    found = []
    for modes, source, reason, right in (
        (1, EXACT_ONE, THREE_DIGITS, ("140.357", "191.941", "160.680")),
        (2, EXACT_TWO, TWO_MODES, ("134.203", "196.617", "157.083")),
    ):
        masses = exact.masses(modes)
        texts = ("95.879", "224.283", "136.375") if modes == 1 else ROUNDED[2]
        found += [
            row(source, f"m{i + 1}, kg", text, float(masses[i]), erratum=reason, corrected=right[i])
            for i, text in enumerate(texts)
        ]
        omega = exact.frequencies(masses)
        speeds = (("135.209", "135.2404"), ("593.391", "530.68"))
        if modes == 2:
            speeds = (("135.209", "135.2358"), ("541.261", "539.05"))
        found += [
            row(source, f"omega{k + 1}, rad/s", text, float(omega[k]), erratum=reason, corrected=corrected)
            for k, (text, corrected) in enumerate(speeds)
        ]
        if modes == 1:
            above = 100 * float(omega[1] / exact.omega[1] - 1)
            found.append(
                row(
                    source,
                    "omega2 above that of the rotor, %",
                    "10",
                    above,
                    erratum=f"the second frequency is not too high but too low: {reason}",
                    corrected="-1.9",
                )
            )
    return found
