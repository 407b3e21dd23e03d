"""Tasks 9.1 and 9.2 of [S] through the files of `sample_data/book_task_9`: each printed number or why not."""

import numpy as np
import pytest

import fem
from rotorid import InputError, equivalent_masses, natural_frequencies, read_rotor
from rotorid.samples import sample_data
from rotorid.tables.data.modes_table import read_compliance, read_modes

NODES = (7, 12, 18)
# masses as the book goes on with them, and its eigenvalues λ = 1/ω², ascending in λ
ROUNDED = {1: (95.88, 224.28, 136.58), 2: (130.05, 199.191, 154.698)}
EIGENVALUES = {
    1: (5.6013830686857908223e-7, 2.8445228090759880109e-6, 5.4699984884055432907e-5),
    2: (6.3712088145957582972e-7, 3.4134112098230237262e-6, 5.4681514908717400444e-5),
}


def task(suffix=""):
    folder = sample_data() / "book_task_9"
    modes = read_modes(folder / f"modes{suffix}.csv")
    nodes, alpha = read_compliance(folder / f"compliance{suffix}.csv", modes.nodes)
    assert nodes == modes.nodes == NODES
    return alpha, modes.frequencies, modes.shapes


def masses(alpha, omega, shapes, modes):
    return equivalent_masses(alpha, omega[:modes], shapes[:, :modes]).values


@pytest.fixture(scope="module")
def printed():
    return task("_printed")


@pytest.fixture(scope="module")
def exact():
    return task()


def test_the_printed_inputs(printed):
    alpha, omega, shapes = printed
    np.testing.assert_allclose(1 / omega**2, [0.547e-4, 0.342e-5], rtol=1e-12)
    upper = alpha[np.triu_indices(3)] * 1e8
    np.testing.assert_allclose(upper, [8.92, 11.2, 6.8, 16.4, 11.07, 9.35], rtol=1e-15)
    assert shapes.T.tolist() == [[1, 1.46, 1.02], [1, 0.12, -1.047]]


def test_the_exact_inputs_are_those_of_the_rotor(exact):
    rotor = read_rotor(sample_data() / "rotor23.csv")
    found = fem.critical_speeds(rotor, 3)
    rows = found.shapes[np.array(NODES) - 1]
    np.testing.assert_allclose(exact[0], fem.compliance(rotor, NODES), rtol=1e-10)
    np.testing.assert_allclose(exact[1], found.frequencies, rtol=1e-10)
    np.testing.assert_allclose(exact[2], rows / rows[0], rtol=1e-9)


def test_of_the_printed_inputs_only_one_compliance_is_wrong(printed, exact):
    """All others are right to one unit of the last printed digit."""
    units = np.array([[0.01, 0.1, 0.1], [0.1, 0.1, 0.01], [0.1, 0.01, 0.01]]) * 1e-8
    off = np.abs(printed[0] - exact[0]) > units
    assert np.argwhere(off).tolist() == [[0, 1], [1, 0]]
    assert printed[0][0, 1] / exact[0][0, 1] - 1 == pytest.approx(0.0134, abs=5e-5)
    assert (np.abs(printed[2] - exact[2][:, :2]) < [[0.01, 0.01], [0.01, 0.01], [0.01, 0.001]]).all()
    assert (np.abs(1 / printed[1] ** 2 - 1 / exact[1][:2] ** 2) < [1e-7, 1e-8]).all()


@pytest.mark.parametrize(
    ("modes", "values"),
    [
        (1, [95.879, 224.283, 136.575]),  # the third is printed as 136.375, and as 136.58: errata
        (2, [130.05, 199.191, 154.698]),
    ],
)
def test_the_printed_masses(printed, modes, values):
    found = masses(*printed, modes)
    np.testing.assert_allclose(found, values, atol=5e-4)
    np.testing.assert_allclose(found, ROUNDED[modes], atol=6e-3)  # what the book goes on with


@pytest.mark.parametrize("modes", [1, 2])
def test_the_printed_eigenvalues_to_all_their_digits(printed, modes):
    """Twenty digits of an exact solution for the rounded masses: floating point holds fourteen."""
    omega, _ = natural_frequencies(printed[0], ROUNDED[modes])
    np.testing.assert_allclose(omega**-2, EIGENVALUES[modes][::-1], rtol=1e-13)


@pytest.mark.parametrize(
    ("modes", "mode", "cut", "printed_omega", "right"),
    [
        # the book rounds an eigenvalue before it takes the root: that is what it prints
        (1, 1, 5.47e-5, 135.209, 135.20925),
        (1, 2, 2.84e-6, 593.391, 592.91889),
        (2, 1, 5.47e-5, 135.209, 135.23208),
        (2, 2, 3.4134e-6, 541.261, 541.25970),
    ],
)
def test_the_printed_frequencies_are_those_of_rounded_eigenvalues(
    printed, modes, mode, cut, printed_omega, right
):
    assert cut**-0.5 == pytest.approx(printed_omega, abs=5e-4)
    omega, _ = natural_frequencies(printed[0], ROUNDED[modes])
    assert omega[mode - 1] == pytest.approx(right, abs=5e-6)
    assert abs(omega[mode - 1] ** -2 - cut) < 10.0 ** (np.floor(np.log10(cut)) - 2)  # the digits it drops
    free, _ = natural_frequencies(printed[0], masses(*printed, modes))  # masses unrounded
    assert free[mode - 1] == pytest.approx(right, rel=2e-5)


def test_the_printed_inputs_turn_the_conclusion_round(printed, exact):
    """The book: the second frequency from one mode is 10 % too high. With exact inputs it is 2 % too low."""
    second = exact[1][1]
    of_book = natural_frequencies(printed[0], masses(*printed, 1))[0][1]
    assert of_book / second - 1 == pytest.approx(0.0965, abs=5e-5)
    right = natural_frequencies(exact[0], masses(*exact, 1))[0][1]
    assert right / second - 1 == pytest.approx(-0.0186, abs=5e-5)
    two = natural_frequencies(printed[0], masses(*printed, 2))[0][1]
    assert two / second - 1 == pytest.approx(0.00097, abs=5e-6)  # the book: they practically coincide
    moved = masses(*printed, 1) / masses(*exact, 1) - 1
    np.testing.assert_allclose(moved, [-0.3169, 0.1685, -0.1500], atol=5e-5)
    assert np.abs(masses(*printed, 2) / masses(*exact, 2) - 1).max() == pytest.approx(0.031, abs=5e-4)


@pytest.mark.parametrize(
    ("which", "moves", "error"),
    [
        ("alpha12", [-0.154, 0.051, -0.007], 0.0095),  # printed 1.3 % high
        ("alpha22", [-0.070, 0.047, -0.050], 0.0111),  # three digits
        ("U31", [-0.035, 0.039, -0.066], 0.0079),  # three digits
    ],
)
def test_three_inputs_do_it_about_equally(printed, exact, which, moves, error):
    """One mode, exact inputs but for one as printed: none alone explains the book's 10 %."""
    alpha, omega, shapes = (values.copy() for values in exact)
    if which == "U31":
        shapes[2, 0] = printed[2][2, 0]
    else:
        i, j = (int(digit) - 1 for digit in which[-2:])
        alpha[i, j] = alpha[j, i] = printed[0][i, j]
    found = masses(alpha, omega, shapes, 1)
    np.testing.assert_allclose(found / masses(*exact, 1) - 1, moves, atol=5.1e-4)
    assert natural_frequencies(alpha, found)[0][1] / omega[1] - 1 == pytest.approx(error, abs=5.1e-5)


@pytest.mark.parametrize(
    ("modes", "values", "frequencies"),
    [
        (1, [140.357, 191.941, 160.680], [135.2404, 530.68, 1062.8]),
        (2, [134.203, 196.617, 157.083], [135.2358, 539.05, 1069.3]),
        (3, [133.760, 197.102, 156.497], [135.2377, 539.99, 1069.8]),
    ],
)
def test_the_masses_of_the_exact_inputs(exact, modes, values, frequencies):
    found = masses(*exact, modes)
    np.testing.assert_allclose(found, values, atol=5e-4)
    omega, _ = natural_frequencies(exact[0], found)
    assert (np.abs(omega - frequencies) <= [5e-5, 5e-3, 0.05]).all()


def test_the_compliance_of_the_running_text_is_refused(tmp_path):
    """It prints α22 as 9.35e-8, the value of α33: no shaft bends like that."""
    text = (sample_data() / "book_task_9" / "compliance_printed.csv").read_text(encoding="utf-8")
    assert "12,12,16.4e-8" in text
    path = tmp_path / "compliance.csv"
    path.write_text(text.replace("12,12,16.4e-8", "12,12,9.35e-8"), encoding="utf-8")
    with pytest.raises(InputError, match=r"positive definite.*Between nodes 7 and 12"):
        read_compliance(path)
