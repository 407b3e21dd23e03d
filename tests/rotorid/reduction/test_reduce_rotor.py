"""Reductions of the rotor of [S] task 9.1 by formula (50), with full-precision inputs."""

import re

import numpy as np
import pytest
from book_task_9 import (
    COMPLIANCE,
    FREQUENCIES,
    SHAPES,
)

import fem
from rotorid.files import read_rotor
from rotorid.reduction import (
    equivalent_masses,
    mac,
    natural_frequencies,
    reduce,
    reduce_measured,
    small_model,
)
from rotorid.samples import sample_data


@pytest.fixture(scope="module")
def rotor():
    return read_rotor(sample_data() / "rotor23.csv")


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_full_precision_masses_and_frequencies(rotor, modes):
    reduction = reduce(rotor, (7, 12, 18), modes)
    np.testing.assert_allclose(reduction.compliance, COMPLIANCE, rtol=1e-7)
    exact = equivalent_masses(COMPLIANCE, FREQUENCIES[:modes], SHAPES[:, :modes])
    # the book/README inputs have 9 digits; condition 64 turns them into 7
    np.testing.assert_allclose(reduction.masses.values, exact.values, rtol=1e-5)
    expected, _ = natural_frequencies(COMPLIANCE, exact.values)
    np.testing.assert_allclose(reduction.frequencies, expected, rtol=1e-6)


def test_the_one_mode_regression_says_that_it_is_ill_conditioned(rotor):
    one, two, three = (reduce(rotor, (7, 12, 18), k) for k in (1, 2, 3))
    # column-scaled condition numbers; unscaled they are 64, 20 and 1.8
    assert [round(r.masses.condition_number, 1) for r in (one, two, three)] == [63.2, 18.3, 1.4]
    assert any("ill-conditioned" in w for w in one.warnings)
    assert three.warnings == ()


def test_a_rotor_that_is_three_masses_gets_them_back():
    rng = np.random.default_rng(4)
    A = rng.normal(size=(3, 3))
    alpha, truth = (A @ A.T + np.eye(3)) * 1e-8, np.array([50.0, 120.0, 80.0])
    omega, shapes = natural_frequencies(alpha, truth)
    for modes in (1, 2, 3):
        estimate = equivalent_masses(alpha, omega[:modes], shapes[:, :modes])
        np.testing.assert_allclose(estimate.values, truth, rtol=1e-8)


def test_natural_frequencies_solve_the_direct_problem_with_a_seal():
    alpha, m, c = COMPLIANCE, np.array([134.0, 197.0, 157.0]), np.array([0.0, 2e6, 0.0])
    omega, shapes = natural_frequencies(alpha, m, seal_stiffness=c)
    stiffness = np.linalg.inv(alpha) + np.diag(c)
    np.testing.assert_allclose(stiffness @ shapes, np.diag(m) @ shapes * omega**2, rtol=1e-9, atol=1e-3)
    estimate = equivalent_masses(alpha, omega[:2], shapes[:, :2], seal_stiffness=c)
    np.testing.assert_allclose(estimate.values, m, rtol=1e-8)


def test_masses_that_are_not_positive_are_said(rotor):
    reduction = reduce(rotor, (2, 3, 4), 1)
    assert (reduction.masses.solution <= 0).any()
    assert any("not positive" in w for w in reduction.warnings)
    document = reduction.to_dict()
    assert all(f is None or f > 0 for f in document["natural_frequencies_rad_s"])


def test_mac_is_one_for_the_rotor_itself(rotor):
    reduction = reduce(rotor, (7, 12, 18), 3)
    assert reduction.mac.shape == (3,)
    assert (reduction.mac > [0.99999, 0.999, 0.985]).all()
    np.testing.assert_allclose(np.diag(mac(reduction.rotor_shapes, -2 * reduction.rotor_shapes)), 1.0)


def test_document_frame_and_text(rotor):
    reduction = reduce(rotor, (7, 12, 18), 2)
    document = reduction.to_dict()
    assert {
        "nodes", "positions_m", "masses_kg", "compliance_m_per_N", "natural_frequencies_rad_s",
        "rotor_frequencies_rad_s", "relative_error", "mac", "condition_number", "warnings",
    } <= set(document)  # fmt: skip
    np.testing.assert_allclose(document["positions_m"], np.array([0.655, 1.34, 2.105]) + 0.318, atol=1e-9)
    frame = reduction.to_frame()
    masses, modes = (frame[frame["table"] == name] for name in ("masses", "modes"))
    np.testing.assert_allclose(masses["mass_kg"].astype(float), document["masses_kg"])
    assert masses["node"].tolist() == document["nodes"]
    assert modes["mode"].tolist() == [1, 2, 3]
    np.testing.assert_allclose(modes["frequency_rad_s"].astype(float), document["natural_frequencies_rad_s"])
    assert modes[["node", "position_m", "mass_kg"]].isna().all(axis=None)
    assert masses[["mode", "frequency_rad_s", "mac"]].isna().all(axis=None)


def test_the_text_has_the_numbers_of_the_result(rotor):
    found = reduce(rotor, (7, 12, 18), 2)
    lines = found.answer.brief(24).splitlines()
    for node, place, mass in zip((7, 12, 18), (0.973, 1.658, 2.423), found.masses.values, strict=True):
        (line,) = [line for line in lines if line.split()[:1] == [str(node)]]
        assert line.split()[1:3] == [f"{place:.3f}", f"{mass:.3f}"]
    whole = sum(disc.mass for disc in rotor.discs)
    whole += (rotor.density * np.pi / 4 * rotor.outer_diameter**2 * rotor.length).sum()
    together = found.masses.values.sum()
    assert f"together {together:.1f} of the rotor's {whole:.1f} kg." in lines[0]
    largest = 100 * np.abs(found.relative_error[:2]).max()
    assert lines[1] == (
        f"Frequencies within {largest:.2g} % of the rotor's, MAC {found.mac[:2].min():.4g}; mode 3 off by "
        f"{100 * found.relative_error[2]:+.3g} %; condition number {found.masses.condition_number:.3g}."
    )
    head = next(i for i, line in enumerate(lines) if line.startswith("  mode "))
    assert "rotor, rpm" in lines[head]
    for k in range(3):
        mode, f_rpm, f, g_rpm, g, error, mac = lines[head + 1 + k].split()
        model, own = found.frequencies[k], found.rotor_frequencies[k]
        assert int(mode) == k + 1
        assert [float(f), float(g)] == pytest.approx([model, own], abs=5.1e-5)
        assert [float(f_rpm), float(g_rpm)] == pytest.approx(np.array([model, own]) * 30 / np.pi, abs=0.051)
        assert float(error) == pytest.approx(100 * (model / own - 1), abs=5.1e-4)
        assert float(mac) == pytest.approx(found.mac[k], abs=5.1e-6)


def test_modes_that_were_not_measured_or_do_not_vibrate_are_said(rotor):
    few = reduce_measured(COMPLIANCE, FREQUENCIES[:2], SHAPES[:, :2])
    lines = few.answer.brief(24).splitlines()
    head = next(i for i, line in enumerate(lines) if line.startswith("  mode "))
    assert "measured, rpm" in lines[head]
    assert len(lines[head + 2].split()) == 7
    assert lines[head + 3].split()[::2] == ["3", f"{few.frequencies[2]:.4f}"]
    last = few.to_frame().iloc[-1]
    assert last["frequency_rad_s"] == few.frequencies[2]
    assert last[["rotor_frequency_rad_s", "relative_error", "mac"]].isna().all()
    odd = reduce(rotor, (2, 3, 4), 1)
    still = [k for k in range(3) if not np.isfinite(odd.frequencies[k])]
    assert still
    assert odd.answer.numbers.count("does not vibrate") == len(still)


def test_rows_of_the_frame_are_numbered_through(rotor):
    frame = reduce(rotor, (7, 12, 18), 2).to_frame()
    assert frame.index.tolist() == list(range(6))
    assert frame["table"].tolist() == ["masses"] * 3 + ["modes"] * 3
    assert frame["node"].tolist()[:3] == [7, 12, 18]


def test_places_of_measured_modes_are_numbered_or_named():
    given = COMPLIANCE, FREQUENCIES[:2], SHAPES[:, :2]
    numbered = reduce_measured(*given)
    named = reduce_measured(*given, nodes=("fan", "wheel", 18))
    assert numbered.nodes == (1, 2, 3)
    assert numbered.to_frame()["node"].tolist()[:3] == [1, 2, 3]
    assert named.nodes == ("fan", "wheel", 18)
    assert named.to_dict()["nodes"] == ["fan", "wheel", 18]
    np.testing.assert_array_equal(named.masses.solution, numbered.masses.solution)
    for wrong in (("fan", "wheel"), ("fan", "fan", 18)):
        with pytest.raises(ValueError, match="3 different names of places"):
            reduce_measured(*given, nodes=wrong)


@pytest.mark.parametrize(
    ("nodes", "modes", "message"),
    [
        ((), 1, "different nodes"),
        ((7, 7, 18), 1, "different nodes"),
        ((7, 12, 30), 1, "node 30 does not exist"),
        ((0, 12), 1, "node 0 does not exist"),
        ((7, 12), 3, "can use 1 … 2 modes"),
        ((7, 12), 0, "can use 1 … 2 modes"),
    ],
)
def test_bad_choices_are_refused(rotor, nodes, modes, message):
    with pytest.raises(ValueError, match=message):
        reduce(rotor, nodes, modes)


def test_a_free_rotor_has_no_compliance(rotor):
    free = fem.Rotor(rotor.length, rotor.outer_diameter, discs=rotor.discs)
    with pytest.raises(ValueError, match="support"):
        reduce(free, (7, 12, 18), 1)


def test_wrong_shapes_are_refused():
    with pytest.raises(ValueError, match="compliance must be"):
        equivalent_masses(np.eye(3), [1.0], np.ones((2, 1)))
    with pytest.raises(ValueError, match="positive"):
        equivalent_masses(np.eye(2), [0.0], np.ones((2, 1)))
    with pytest.raises(ValueError, match="node at the first mass"):
        equivalent_masses(np.eye(2), [1.0], [[0.0], [1.0]])


def test_the_plane_at_rest_of_an_anisotropic_gyroscopic_rotor():
    parts = {"discs": [fem.Disc(4, 30.0, 2.0, 1.0), fem.Disc(8, 20.0, 1.0, 0.6)]}
    stand = fem.Pedestal(5.0, (3e8, 1e8), 1e3)
    turning = fem.Rotor(
        [0.1] * 10,
        0.06,
        **parts,
        supports=[
            fem.Support(1, ((2e7, 3e6), (-3e6, 5e7)), 2e3),
            fem.Support(11, [1e7, 3e7], 1e3, speeds=(100.0, 500.0), pedestal=stand),
        ],
        model=fem.Model(shear=True, rotary_inertia=True, gyroscopic=True),
    )
    still = fem.Rotor(
        [0.1] * 10,
        0.06,
        **parts,
        supports=[fem.Support(1, 2e7), fem.Support(11, 1e7, pedestal=fem.Pedestal(5.0, 3e8))],
        model=fem.Model(shear=True, rotary_inertia=True),
    )
    a, b = reduce(turning, [4, 8], 2), reduce(still, [4, 8], 2)
    np.testing.assert_allclose(a.masses.solution, b.masses.solution, rtol=1e-9)
    np.testing.assert_allclose(a.rotor_frequencies, b.rotor_frequencies, rtol=1e-9)
    assert "plane x of the rotor at rest" in a.warnings[0]
    assert "nor masses of pedestals" in a.warnings[0]
    assert "(kxx) is that at 100 rad/s (--speed)" in a.warnings[1]
    assert not any("gyroscopic" in text for text in a.warnings[1:])
    assert not any("(kxx)" in text for text in b.warnings)
    stiffer = reduce(turning, [4, 8], 2, speed=500.0)
    assert (stiffer.rotor_frequencies > a.rotor_frequencies).all()
    assert "(kxx) is that at 500 rad/s (--speed)" in stiffer.warnings[1]
    with pytest.raises(ValueError, match="its table holds 100 to 500"):
        reduce(turning, [4, 8], 2, speed=50.0)


def test_a_mode_of_another_shape_is_said(rotor):
    result = reduce(rotor, [7, 12, 18], 2)
    assert not any("MAC" in text for text in result.warnings)
    clumsy = reduce(rotor, [9, 10, 19], 3)
    low = clumsy.mac < 0.9
    assert low.any()
    assert "MAC 0.01" in " ".join(clumsy.warnings)
    assert [f"mode {k + 1} by " in " ".join(clumsy.warnings) for k in range(3)] == (
        low | (np.abs(clumsy.relative_error) > 0.1)
    ).tolist()


def test_masses_that_are_not_positive_say_what_to_do(rotor):
    """Modes that ask for less than nothing: one warning with the way out."""
    wrong = reduce(rotor, [6, 7, 12], 2)
    (warning,) = wrong.warnings
    assert re.match(r"a mass is not positive, -25\d\d kg at node 7: .* --nonnegative$", warning)
    bounded = reduce(rotor, [6, 7, 12], 2, nonnegative=True)
    assert "at the bound 0" in bounded.warnings[0]
    assert "mode 2 does not vibrate" in bounded.warnings[1]
    assert "nan" not in bounded.summary()
    for result, way in ((wrong, "or --nonnegative"), (bounded, "leave out this node")):
        with pytest.raises(ValueError, match=way):
            small_model(rotor, [6, 7, 12], result.masses.solution)
