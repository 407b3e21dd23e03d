"""Uncertainty of masses and frequencies against finite differences, exact recomputation and drawn inputs."""

import json

import numpy as np
import pytest
from book_task_9 import (
    COMPLIANCE,
    FREQUENCIES,
    SHAPES,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from rotorid.reduction import equivalent_masses, natural_frequencies
from rotorid.reduction.equivalent.mass_uncertainty import InputErrors, mass_uncertainty

ALPHA12 = 11.2e-8 / COMPLIANCE[0, 1] - 1
"""What the printed α12 is wrong by: +1.337 %."""


def book(modes):
    return COMPLIANCE, FREQUENCIES[:modes], SHAPES[:, :modes]


def of_alpha12(share):
    errors = np.zeros((3, 3))
    errors[0, 1] = errors[1, 0] = share
    return InputErrors(compliance=errors)


@settings(max_examples=30, deadline=None)
@given(
    seed=st.integers(0, 10**6), k=st.integers(1, 3),
    normalise=st.sampled_from(["first", "largest", "length"]),
    rows=st.sampled_from(["equal", "relative", "own"]),
)  # fmt: skip
def test_derivatives_agree_with_finite_differences(seed, k, normalise, rows):
    """Inputs that no n-mass model fits: the residual term of the derivative counts."""
    rng = np.random.default_rng(seed)
    alpha = COMPLIANCE * (1 + np.diag(rng.uniform(0, 0.3, 3)))
    U = SHAPES[:, :k] * rng.uniform(0.7, 1.4, (3, k))
    omega, springs = FREQUENCIES[:k] * rng.uniform(0.9, 1.1, k), rng.uniform(0, 3e6, 3)
    weights = rng.uniform(0.5, 2, (3, k)) if rows == "own" else rows
    options = {"normalise": normalise, "rows": weights}
    found = mass_uncertainty(alpha, omega, U, InputErrors(1e-3), seal_stiffness=springs, **options)

    def solve(a, w, u, c):
        m = equivalent_masses(a, w, u, seal_stiffness=c, **options).values
        return np.array([m, natural_frequencies(a, m, seal_stiffness=c)[0]])

    step = 1e-6
    for name, gradient in found.gradients.items():
        ends = []
        for factor in (1 + step, 1 - step):
            a, w, u, c = alpha.copy(), omega.copy(), U.copy(), springs.copy()
            if name.startswith("alpha"):
                i, j = int(name[5]) - 1, int(name[6]) - 1
                a[i, j] *= factor
                a[j, i] = a[i, j]
            elif name.startswith("omega"):
                w[int(name[5]) - 1] *= factor
            elif name.startswith("U"):
                u[int(name[1]) - 1, int(name[2]) - 1] *= factor
            else:
                c[int(name[1]) - 1] *= factor
            ends.append(solve(a, w, u, c))
        scale = np.abs(np.nan_to_num(list(found.gradients.values()))).max(axis=0)
        np.testing.assert_allclose(
            (ends[0] - ends[1]) / (2 * step) / scale, gradient / scale, atol=2e-5, err_msg=name
        )


@pytest.mark.parametrize(("modes", "sigma"), [(1, 1e-4), (2, 1e-3), (3, 1e-3)])
def test_standard_deviations_agree_with_drawn_inputs(modes, sigma):
    """The inputs are drawn here, apart from the code under test."""
    found = mass_uncertainty(*book(modes), InputErrors(sigma, sigma, sigma))
    assert found.warnings == ()
    rng, draws = np.random.default_rng(1), []
    for _ in range(2000):
        noise = sigma * rng.normal(size=(3, 3))
        a = COMPLIANCE * (1 + np.tril(noise) + np.tril(noise, -1).T)
        w = FREQUENCIES[:modes] * (1 + sigma * rng.normal(size=modes))
        U = SHAPES[:, :modes] * (1 + sigma * np.vstack((np.zeros(modes), rng.normal(size=(2, modes)))))
        m = equivalent_masses(a, w, U).values
        draws.append(np.concatenate((m, natural_frequencies(a, m)[0])))
    # 2000 draws know a standard deviation to 1.6 %
    std = np.concatenate((found.masses_std, found.frequencies_std))
    np.testing.assert_allclose(np.std(draws, axis=0), std, rtol=0.06)
    m = np.corrcoef(np.array(draws)[:, :3].T)
    np.testing.assert_allclose(
        found.masses_covariance / np.outer(found.masses_std, found.masses_std), m, atol=0.05
    )


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_contributions_add_up_to_the_variance(modes):
    found = mass_uncertainty(*book(modes), InputErrors(0.001, 0.002, 0.003))
    total = sum(found.contributions.values())
    np.testing.assert_allclose(total[0], np.diag(found.masses_covariance), rtol=1e-12)
    np.testing.assert_allclose(total[1], np.diag(found.frequencies_covariance), rtol=1e-12)
    assert not found.contributions["U11"].any(), "the first ordinate is 1 by definition"
    assert not found.contributions["c1"].any(), "there is no seal"
    one = mass_uncertainty(*book(modes), of_alpha12(0.001))
    np.testing.assert_allclose(one.contributions["alpha12"], found.contributions["alpha12"], rtol=1e-12)


@pytest.mark.parametrize("modes", [1, 2])
def test_sensitivity_is_the_uncertainty_of_equal_errors(modes):
    found = mass_uncertainty(*book(modes), InputErrors(compliance=1e-4, shapes=1e-4))
    np.testing.assert_allclose(found.masses_std / found.masses / 1e-4, found.sensitivity, rtol=1e-10)
    unstated = mass_uncertainty(*book(modes), InputErrors())
    np.testing.assert_array_equal(unstated.sensitivity, found.sensitivity)


# what the error of the printed α12 does: first order, and exactly (kg; second frequency, rad/s)
OF_ALPHA12 = {
    1: ([-17.78, 6.69, 1.35], 10.23, [-21.68, 9.76, -1.06], 15.19),
    2: ([-2.576, 0.750, -1.185], 0.562, [-2.193, 0.426, -0.890], -0.249),
}


@pytest.mark.parametrize("modes", [1, 2])
def test_what_the_error_of_the_printed_alpha12_does(modes):
    """One mode: 15 % of a mass; two modes: 1.6 %. First order is poor for 1.3 % and says so."""
    found = mass_uncertainty(*book(modes), of_alpha12(0.013))
    masses, second, exact_masses, exact_second = OF_ALPHA12[modes]
    shift = found.shift({"alpha12": ALPHA12})
    dm, domega = shift
    np.testing.assert_allclose(dm, masses, atol=0.006)
    assert domega[1] == pytest.approx(second, abs=0.006)
    np.testing.assert_allclose(shift.exact_masses, exact_masses, atol=0.012)
    assert shift.exact_frequencies[1] == pytest.approx(exact_second, abs=0.012)
    printed = COMPLIANCE.copy()
    printed[0, 1] = printed[1, 0] = 11.2e-8
    m = equivalent_masses(printed, *book(modes)[1:]).values
    np.testing.assert_allclose(found.masses + shift.exact_masses, m, rtol=1e-9)
    omega = natural_frequencies(printed, m)[0]
    np.testing.assert_allclose(found.frequencies + shift.exact_frequencies, omega, rtol=1e-9)
    assert "m1" in shift.warnings[0]
    assert "use the exact values" in shift.warnings[0]
    # a standard deviation of 1.3 % is the shift of 1.3 %, and just as poor
    np.testing.assert_allclose(found.masses_std, np.abs(dm) * 0.013 / ALPHA12, rtol=1e-9)
    assert found.frequencies_std[1] == pytest.approx(abs(domega[1]) * 0.013 / ALPHA12)
    assert (found.nonlinearity[0] > 0.1).all()
    assert "first order is poor" in found.warnings[0]
    assert mass_uncertainty(*book(modes), of_alpha12(2e-4)).warnings == ()


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_the_error_of_first_order_falls_with_the_square_of_the_change(modes):
    found = mass_uncertainty(*book(modes), InputErrors(0.01))
    changes = {"alpha12": 1.0, "U21": -0.5, "omega1": 0.3, "alpha33": 0.7}
    missed = []
    for size in (1e-4, 5e-5):
        shift = found.shift({name: size * value for name, value in changes.items()})
        missed.append(np.abs(shift.exact_masses - shift.masses).max())
    assert missed[0] / missed[1] == pytest.approx(4.0, rel=0.05)
    np.testing.assert_allclose(
        found.shift({"alpha21": 0.01}).masses, found.shift({"alpha12": 0.01}).masses, rtol=0
    )


def test_with_one_mode_the_first_frequency_has_no_error_but_its_own():
    found = mass_uncertainty(*book(1), InputErrors(1e-4, 2e-4, 1e-4))
    assert found.frequencies_std[0] == pytest.approx(2e-4 * FREQUENCIES[0], rel=1e-6)
    assert mass_uncertainty(*book(1), of_alpha12(0.001)).frequencies_std[0] == 0.0


def test_the_result_does_not_depend_on_the_size_of_the_shapes():
    errors = InputErrors(1e-3, 1e-3, 1e-3)
    a = mass_uncertainty(*book(2), errors)
    b = mass_uncertainty(COMPLIANCE, FREQUENCIES[:2], SHAPES[:, :2] * [-3.0, 0.2], errors)
    np.testing.assert_allclose(a.masses_covariance, b.masses_covariance, rtol=1e-9)


def test_more_than_nine_masses_have_names_that_differ():
    n = 11
    alpha, m = np.eye(n) * 1e-8 + 1e-9, np.linspace(10, 30, n)
    omega, shapes = natural_frequencies(alpha, m)
    found = mass_uncertainty(alpha, omega, shapes, InputErrors(1e-3), normalise="length", rows="relative")
    assert len(found.gradients) == n * (n + 1) // 2 + n + n * n + n
    np.testing.assert_allclose(
        found.shift({"alpha11,1": 1e-4}).masses, found.shift({"alpha1,11": 1e-4}).masses, rtol=0
    )


def test_masses_that_are_not_known_are_said():
    found = mass_uncertainty(*book(1), InputErrors(0.03, 0.0, 0.03))
    text = " ".join(found.warnings)
    assert "as large as the mass" in text
    alpha = np.array([[4.0, 3.0], [3.0, 4.0]]) * 1e-8
    found = mass_uncertainty(alpha, [1000.0], [[1.0], [0.5]], InputErrors(0.01))
    text = " ".join(found.warnings)
    assert "m2 is not positive" in text
    assert "do not vibrate" in text
    document = json.loads(json.dumps(found.to_dict()))
    assert document["natural_frequencies_std_rad_s"][1] is None
    assert "the frequencies ± 0, unknown rpm" in found.answer.judgement


def test_text_frame_and_document():
    found = mass_uncertainty(*book(2), InputErrors(1e-3, 1e-3, 1e-3))
    std = np.concatenate((found.masses_std, found.frequencies_std))
    said = found.answer.judgement.removeprefix("By the stated errors the masses are ± ").removesuffix(" rpm.")
    likely = (std if found.drawn is None else found.drawn.ravel()) * np.repeat([1, 30 / np.pi], 3)
    parted = said.replace(" kg, the frequencies ± ", ", ").split(", ")
    assert [float(spread) for spread in parted] == pytest.approx(likely, rel=0.051)
    frame = found.to_frame().set_index("quantity")
    assert frame.index.tolist() == ["m1", "m2", "m3", "omega1", "omega2", "omega3"]
    np.testing.assert_allclose(frame.drop(columns=["unit", "value", "std", "nonlinearity"]).sum(axis=1), 1.0)
    np.testing.assert_allclose(frame["std"][:3], found.masses_std)
    document = json.loads(json.dumps(found.to_dict()))
    np.testing.assert_allclose(document["masses_std_kg"], found.masses_std)
    np.testing.assert_allclose(
        document["contributions"]["alpha12"]["masses_kg2"], found.contributions["alpha12"][0]
    )


def test_no_errors_give_no_uncertainty():
    found = mass_uncertainty(*book(2), InputErrors())
    assert not found.masses_std.any()
    assert found.warnings == ()
    assert "the masses are ± 0, 0, 0 kg" in found.summary()


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ({"compliance": 1.3}, "such as 0.013 for 1.3 %"),
        ({"shapes": -0.1}, "from 0 to below 1"),
        ({"frequencies": np.nan}, "from 0 to below 1"),
        ({"compliance": [0.1, 0.2]}, "one number or have shape"),
        ({"frequencies": [0.1, 0.1, 0.1]}, "one number or have shape"),
        ({"compliance": np.triu(np.full((3, 3), 0.1))}, "symmetric"),
    ],
)
def test_impossible_errors_are_refused(errors, message):
    with pytest.raises(ValueError, match=message):
        mass_uncertainty(*book(2), InputErrors(**errors))


def test_impossible_questions_are_refused():
    found = mass_uncertainty(*book(1), InputErrors(0.01))
    with pytest.raises(ValueError, match="no input 'alpha14'"):
        found.shift({"alpha14": 0.1})
    with pytest.raises(ValueError, match="no input 'U12'"):
        found.shift({"U12": 0.1})
    with pytest.raises(ValueError, match="must be finite"):
        found.shift({"alpha12": np.nan})
    with pytest.raises(ValueError, match="m3 by itself is not"):
        mass_uncertainty(COMPLIANCE, [100.0], [[1.0], [1.0], [0.0]], InputErrors(0.01))
