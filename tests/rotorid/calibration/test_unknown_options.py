"""What people write after --estimate and --prior: read as meant, or refused with one sentence."""

from dataclasses import replace

import pytest
from helpers.calibration.jobs import machine

import fem
from rotorid.commands.calibrate_options import unknowns

COEFFICIENTS = ("kxx", "kxy", "kyx", "kyy", "cxx", "cyy")


def read(estimate, prior="", *, rotor=None, probes=(), exact=True):
    return unknowns(rotor or machine(), probes, estimate, prior, exact=exact)


def paths(*args, **more):
    return [unknown.path for unknown in read(*args, **more)]


@pytest.mark.parametrize("which", ["bearing[1]", "bearing[DE]", "bearing[1,2]", "bearing"])
def test_every_coefficient_that_is_not_zero(which):
    plain = paths(f"{which}.*")
    several = which in ("bearing[1,2]", "bearing")  # of two bearings that differ one factor for both
    assert plain == [f"{which}.{name}{'.scale' if several else ''}" for name in COEFFICIENTS]
    assert paths("bearing[*].*") == [f"bearing[{i}].{name}" for i in (1, 2) for name in COEFFICIENTS]


def test_what_is_not_known_exactly_comes_beside():
    found = read("bearing[1].kxx", exact=False, probes=["a", "b"])
    beside = {u.path: u.prior for u in found if u.beside}
    assert beside == {
        "material.youngs_modulus.scale": (1.0, 0.01),
        "disc[1].scale": (1.0, 0.01),
        "disc[2].scale": (1.0, 0.01),
        "bearing[2].pedestal_stiffness.scale": (1.0, 0.1),
        "probe[a].angle": (0.0, 2.0),
        "probe[b].angle": (0.0, 2.0),
    }


@pytest.mark.parametrize(
    ("estimate", "taken"),
    [
        ("bearing[NDE].pedestal_stiffness_x", "bearing[2].pedestal_stiffness.scale"),
        ("disc[1].mass", "disc[1].scale"),
        ("material.youngs_modulus", "material.youngs_modulus.scale"),
    ],
)
def test_a_number_that_is_estimated_is_not_a_second_time_beside(estimate, taken):
    assert taken not in [u.path for u in read(estimate, exact=False) if u.beside]
    assert "probe[a].angle" in paths(estimate, exact=False, probes=["a"])


@pytest.mark.parametrize(
    ("prior", "expected"),
    [
        ("bearing[1].kxx=20%", (4e7, 8e6)),
        ("bearing[1].kxx=7e7+-20%", (7e7, 1.4e7)),
        ("k=7e7±1e6", (7e7, 1e6)),
        ("bearing[*].*=5%", (4e7, 2e6)),
        ({"bearing[1].kxx": "5%"}, (4e7, 2e6)),
    ],
)
def test_priors(prior, expected):
    (found,) = read("k=bearing[1].kxx", prior)
    assert found.prior == pytest.approx(expected)
    assert found.first(machine()) == expected[0]


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("bearing[1].kxx", (0.0, None)),
        ("bearing[1].kxx.scale", (1e-3, None)),
        ("seal[1].kxx", (None, None)),
        ("material.density", (7.8, None)),
    ],
)
def test_limits(path, expected):
    seal = fem.Support(3, ((1e6, 2e5), (-2e5, 1e6)), 100.0, kind="seal")
    rotor = replace(machine(), supports=[*machine().supports, seal])
    (found,) = read(path, rotor=rotor, probes=["a"])
    assert found.limits(rotor) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("estimate", "said"),
    [
        ("", "'' is no parameter"),
        ("bearing[7].kxx", "the bearing '7' is not known"),
        ("seal[*].*", "the rotor has no seal"),
        ("probe[z].angle", "the probe 'z' is not known"),
        ("bearing[*].kxx,bearing[2].kxx", "bearing[2].kxx stands twice"),
        ("k=bearing[*].kxx", "one name for 2 numbers"),
    ],
)
def test_estimates_that_cannot_be_read(estimate, said):
    with pytest.raises(ValueError) as error:
        read(estimate, probes=["a"])
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("prior", "said"),
    [
        *(
            (f"bearing[1].kxx={text}", "a standard deviation is needed")
            for text in ("", "0", "nan", "20%%", "1+-2+-3")
        ),
        ("bearing[1].kxx", "is no NAME=VALUE"),
        ("bearing[1].kxx=5%,bearing[1].kxx=6%", "stands twice"),
        ("bearing[2].kxx=5%", "nothing that is estimated is called 'bearing[2].kxx'"),
    ],
)
def test_priors_that_cannot_be_read(prior, said):
    with pytest.raises(ValueError, match="--prior") as error:
        read("bearing[1].kxx", prior)
    assert said in str(error.value)
