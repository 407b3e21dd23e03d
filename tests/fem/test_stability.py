import dataclasses
import math

import numpy as np
import pytest
from exact_solutions import whirl_exactly
from fem_rotors import rotor23
from whirl_rotors import machine

import fem

MASS, SHAFT, DIAMETER = 20.0, 1.0, 0.03
STIFFNESS = 48 * fem.STEEL_MODULUS * math.pi / 64 * DIAMETER**4 / SHAFT**3
CRITICAL = math.sqrt(STIFFNESS / MASS)


def jeffcott(*supports, bearing=1e13, material=0.0):
    """A disc in the middle of a massless shaft."""
    return fem.Rotor(
        [SHAFT / 2, SHAFT / 2],
        DIAMETER,
        density=0.0,
        discs=[fem.Disc(2, MASS)],
        supports=[fem.Support(1, bearing), fem.Support(3, bearing), *supports],
        material_damping=material,
    )


@pytest.mark.parametrize("ratio", [0.2, 1.0, 5.0])
def test_internal_damping(ratio):
    """Stable up to ω0 (1 + c_e / c_i)."""
    material = 1e-4
    rotor = jeffcott(fem.Support(2, 0.0, ratio * material * STIFFNESS), material=material)
    expected = CRITICAL * (1 + ratio)
    found = fem.stability_threshold(rotor, 2 * expected)
    assert found.status == "threshold"
    assert found.threshold == pytest.approx(expected, rel=1e-7)
    assert found.frequency == pytest.approx(CRITICAL, rel=1e-7)
    assert found.whirl_ratio == pytest.approx(1 / (1 + ratio), rel=1e-7)
    assert found.direction == 1


def test_internal_damping_on_flexible_bearings():
    """Only the shaft's share of the deflection is damped inside: k_s (1 + iβ(ω − Ω)) in series with 2 k_b."""
    material, bearing, external = 2e-4, 0.7 * STIFFNESS, 60.0
    rotor = jeffcott(fem.Support(2, 0.0, external), bearing=bearing, material=material)
    found = fem.stability_threshold(rotor, 3000.0)
    shaft = STIFFNESS * (1 + 1j * material * (found.frequency - found.threshold))
    dynamic = shaft * 2 * bearing / (shaft + 2 * bearing)
    balance = dynamic - MASS * found.frequency**2 + 1j * external * found.frequency
    assert abs(balance) < 1e-8 * STIFFNESS


@pytest.mark.parametrize(("factor", "status"), [(1 - 1e-6, "stable"), (1 + 1e-6, "unstable")])
def test_cross_coupling_at_the_limit(factor, status):
    """q = b ω0 is the limit."""
    damping = 150.0
    q = factor * damping * CRITICAL
    rotor = jeffcott(fem.Support(2, ((0, q), (-q, 0)), damping, kind="seal"))
    assert fem.stability_threshold(rotor, 500.0).status == status


def test_cross_coupling_that_grows_with_speed():
    """q = b Ω / 2, as in a plain seal: stable up to 2 ω0, whirl ratio 1/2."""
    damping, top = 150.0, 1000.0
    q = damping * top / 2
    seal = fem.Support(
        2, [((0, 0), (0, 0)), ((0, q), (-q, 0))], [damping, damping], speeds=(0.0, top), kind="seal"
    )
    found = fem.stability_threshold(jeffcott(seal), top)
    assert found.threshold == pytest.approx(2 * CRITICAL, rel=1e-7)
    assert found.whirl_ratio == pytest.approx(0.5, rel=1e-8)
    assert found.mode in (1, 2)
    assert "0.5 × speed" in found.sentence()


def test_anisotropic_bearings_shift_the_limit():
    """Two planes: the eigenvalue at the threshold lies on the axis, on both sides of it off it."""
    # Split stiffness and damping outside balance material damping for a while.
    rotor = dataclasses.replace(machine(cross=False), material_damping=np.full(23, 2e-4))
    found = fem.stability_threshold(rotor, 3000.0, n=4)
    assert found.status == "threshold"
    at = fem.whirl_modes(rotor, found.threshold, 4)
    k = int(np.argmin(np.abs(at.frequencies - found.frequency)))
    assert abs(at.eigenvalues[k].real) < 1e-7 * at.frequencies[k]
    before = fem.whirl_modes(rotor, 0.999 * found.threshold, 4)
    after = fem.whirl_modes(rotor, 1.001 * found.threshold, 4)
    assert before.eigenvalues.real.max() < 0 < after.eigenvalues.real.max()


def test_stable_is_said():
    rotor = dataclasses.replace(
        rotor23(), supports=[fem.Support(s.node, 1e8, 2e4) for s in rotor23().supports]
    )
    found = fem.stability_threshold(rotor, 1000.0)
    assert found.status == "stable"
    assert found.threshold is None
    assert found.whirl_ratio is None
    assert found.margin > 0
    assert "stable from 0 to 1000" in found.summary()


def test_the_margin_is_the_least_decrement_of_the_range():
    """Internal damping takes away from the forward whirl, the more the faster the rotor runs."""
    material = 1e-4
    rotor = jeffcott(fem.Support(2, 0.0, 5 * material * STIFFNESS), material=material)
    found = fem.stability_threshold(rotor, 4 * CRITICAL)  # the threshold lies at 6 times
    last = whirl_exactly(rotor, 4 * CRITICAL, 2).eigenvalues
    expected = (-2 * np.pi * last.real / np.abs(last.imag)).min()
    assert found.status == "stable"
    assert found.margin == pytest.approx(expected, rel=1e-6)
    assert found.margin < 0.6 * fem.stability_threshold(rotor, CRITICAL).margin


def test_undamped_is_not_unstable():
    assert fem.stability_threshold(rotor23(), 1000.0).status == "stable"


def test_unstable_from_the_start():
    q = 1e6
    found = fem.stability_threshold(jeffcott(fem.Support(2, ((0, q), (-q, 0)), 10.0, kind="seal")), 500.0)
    assert found.status == "unstable"
    assert found.direction == 1
    assert "unstable already at 0" in found.summary()
    assert found.to_dict()["threshold_rad_s"] is None


def test_running_away_is_said():
    rotor = jeffcott(fem.Support(2, -2 * STIFFNESS, 10.0, kind="seal"))
    found = fem.stability_threshold(rotor, 500.0, n=1)
    assert found.status == "unstable"


@pytest.mark.parametrize(
    ("highest", "options", "message"),
    [(10.0, {"lowest": 20.0}, "range of speeds is empty"), (10.0, {"lowest": -5.0}, "not negative")],
)
def test_bad_input(highest, options, message):
    with pytest.raises(ValueError, match=message):
        fem.stability_threshold(rotor23(), highest, **options)


def test_tables_are_not_left():
    rotor = jeffcott(fem.Support(2, [1e3, 1e3], [1.0, 1.0], speeds=(100.0, 200.0), name="seal"))
    with pytest.raises(ValueError, match="seal"):
        fem.stability_threshold(rotor, 150.0)
    assert fem.stability_threshold(rotor, 200.0, lowest=100.0).status == "stable"


def veering():
    """Modes 3 and 4 veer sharply between 200 and 225 rad/s, where one of them loses stability."""
    return fem.Rotor(
        [0.07598931, 0.11731469, 0.17572019, 0.28725273],
        [0.17364281, 0.18922264, 0.11957767, 0.16664831],
        [0.0, 0.0, 0.0, 0.05866477],
        youngs_modulus=[1.16283623e11, 1.51811977e11, 1.66249788e11, 1.68663561e11],
        density=[4185.70733511, 3473.05108279, 5381.48107674, 6375.33350678],
        material_damping=[6.9187337e-07, 4.38956655e-08, 9.13098917e-07, 6.02745395e-07],
        supports=[
            fem.Support(
                5,
                ((86604455.79, -6332058.41), (-17029054.77, 58682574.55)),
                ((25452.72, -2607.584), (-7439.726, 33058.947)),
            ),
            fem.Support(
                3,
                [
                    ((310099817.98, 114204051.11), (-114204051.11, 616926832.59)),
                    ((22531703.17, 10913375.61), (-7633740.71, 11993259.52)),
                    ((50519546.24, -2709611.89), (2709611.89, 77312206.27)),
                ],
                [418.155, ((137.505, -27.6903), (-51.4019, 159.7095)), 4665.1515],
                speeds=(0.0, 300.0, 1000.0),
            ),
            fem.Support(
                2,
                13856974.44,
                ((179.216, -41.3020), (-58.4332, 150.9910)),
                pedestal=fem.Pedestal(0.0, (824463616.55, 74877667.76), 8965.15),
            ),
        ],
        model=fem.Model(True, True, False),
    )


def sealed(seed):
    """A rotor with seals whose cross-coupling grows with speed, and some with internal damping."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 9))

    def bearing(node):
        k, ratio, cross = 10 ** rng.uniform(7, 8.5), rng.uniform(0.5, 2), rng.uniform(-0.2, 0.2)
        return fem.Support(node, ((k, cross * k), (-cross * k, ratio * k)), 10 ** rng.uniform(2, 4.5))

    k, q = 10 ** rng.uniform(5, 7.5), 10 ** rng.uniform(5, 7.5)
    seal = fem.Support(
        int(rng.integers(2, n + 1)),
        [((k, 0), (0, k)), ((k, q), (-q, k))],
        [10 ** rng.uniform(1, 3)] * 2,
        speeds=(0.0, 1000.0),
        kind="seal",
    )
    return fem.Rotor(
        rng.uniform(0.05, 0.3, n),
        rng.uniform(0.04, 0.16, n),
        material_damping=rng.choice([0.0, 1e-6, 1e-4]) * rng.random(n),
        discs=[fem.Disc(int(rng.integers(1, n + 2)), rng.uniform(1, 60), 0.5, 0.3)],
        supports=[bearing(1), bearing(n + 1), seal],
        model=fem.Model(False, True, True),
    )


def grows_only_above(rotor, speed):
    """Judged by the full model's eigenvalues on both sides."""
    before, after = (
        whirl_exactly(rotor, factor * speed, 4).eigenvalues.real.max() for factor in (1 - 1e-5, 1 + 1e-5)
    )
    return before < 0 < after


def test_a_veering_does_not_exchange_the_mode():
    rotor = veering()
    found = [fem.stability_threshold(rotor, 1000.0, n=4, steps=steps) for steps in (40, 80, 160)]
    for one in found:
        assert one.threshold == pytest.approx(213.8314, rel=1e-5)
        assert one.threshold == pytest.approx(found[0].threshold, rel=1e-8)
        assert one.frequency == pytest.approx(found[0].frequency, rel=1e-8)
        assert one.mode == 4
        assert one.warnings == ()
    assert grows_only_above(rotor, found[0].threshold)
    # The Campbell diagram finds growth on the mode itself: the same speed.
    growing = fem.campbell(rotor, np.linspace(0.0, 1000.0, 41), 4).unstable
    assert growing[0].first == pytest.approx(found[0].threshold, rel=1e-7)


@pytest.mark.parametrize("seed", range(10))
def test_the_threshold_does_not_depend_on_the_steps(seed):
    rotor = sealed(seed)
    few, many = (fem.stability_threshold(rotor, 1000.0, n=4, steps=steps) for steps in (40, 160))
    assert few.status == many.status
    assert few.warnings == many.warnings == ()
    if few.threshold is not None:
        assert few.threshold == pytest.approx(many.threshold, rel=1e-6)
        assert few.frequency == pytest.approx(many.frequency, rel=1e-6)
        assert grows_only_above(rotor, few.threshold)


@pytest.mark.parametrize("seed", [0, 2, 3, 4])
def test_damped_critical_speeds_do_not_depend_on_the_steps(seed):
    rotor = sealed(seed)
    few, many = (fem.campbell(rotor, np.linspace(0.0, 1000.0, steps + 1), 6) for steps in (20, 80))
    assert few.critical_speeds.size
    np.testing.assert_allclose(few.critical_speeds, many.critical_speeds, rtol=1e-8)
    for speed in few.critical_speeds:
        omega = whirl_exactly(rotor, speed, 8).frequencies
        assert np.abs(omega - speed).min() < 1e-8 * speed


@pytest.mark.parametrize("highest", [700.0, 1000.0, 5000.0])
@pytest.mark.parametrize("loss", [1e-13, 1e-10, 1e-7])
def test_a_threshold_does_not_depend_on_the_size_of_tiny_losses(loss, highest):
    # internal damping alone: stable up to the critical speed, whatever its size
    ends = [fem.Support(1, 1e8), fem.Support(5, 1e8)]
    rotor = fem.Rotor([0.25] * 4, 0.05, supports=ends, material_damping=loss)
    critical = fem.critical_speeds(rotor, 1).frequencies[0]
    assert fem.stability_threshold(rotor, highest).threshold == pytest.approx(critical, rel=1e-10)
    (window,) = fem.campbell(rotor, np.arange(100.0, 1000.0, 100.0)).windows
    assert window.first == pytest.approx(critical, rel=1e-10)
    assert not fem.campbell(rotor, np.arange(100.0, 650.0, 100.0)).windows
