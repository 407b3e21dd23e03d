"""Parameters of a rotor by name: what is read is what is set, and what is refused is said."""

from dataclasses import replace

import numpy as np
import pytest
from fem_rotors import machines, rotor23
from hypothesis import given

import fem
from fem.model.calibration import is_reading
from fem.model.rotor_parameters import (
    expand,
    parameter_value,
    typical_size,
    with_changes,
    with_parameters,
)
from rotorid.samples import sample_data
from rotorid.tables import read_rotor

PLAIN = ("kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy", "tilting_stiffness")
STAND = ("mass", "stiffness_x", "stiffness_y", "damping_x", "damping_y")
ROTOR = fem.Rotor(
    [0.1] * 4,
    0.05,
    discs=[fem.Disc(2, 5.0, 0.1, 0.05, "wheel"), fem.Disc(3, 7.0, 0.2)],
    supports=[
        fem.Support(1, 1e7, 100.0, "DE", pedestal=fem.Pedestal(20.0, (4e7, 5e7), 10.0)),
        fem.Support(2, ((-1e5, 2e5), (-2e5, -1e5)), kind="seal"),
        fem.Support(5, ((2e7, 1e6), (-1e6, 3e7)), ((200.0, 0.0), (0.0, 300.0)), "NDE"),
    ],
)


def compressor():
    return read_rotor(sample_data() / "compressor" / "rotor.toml")


def all_paths(rotor):
    yield from (f"material.{name}" for name in ("youngs_modulus", "density", "poisson_ratio"))
    for kind in ("bearing", "seal"):
        own = [s for s in rotor.supports if s.kind == kind]
        for i, support in enumerate(own, start=1):
            names = [*PLAIN, *(f"pedestal_{n}" for n in STAND if support.pedestal)]
            yield from (f"{kind}[{i}].{name}" for name in names)
            yield from (
                f"{kind}[{i}].{q}.{s}" for q in ("kxx", "damping") for s in ("scale", "slope", "curve")
            )
    for i in range(1, len(rotor.discs) + 1):
        yield from (f"disc[{i}].{name}" for name in ("mass", "polar_inertia", "diametral_inertia", "scale"))


def read_back(rotor):
    """All values that can be read; a refused one names its scale, which is 1."""
    values = {}
    for path in all_paths(rotor):
        try:
            values[path] = parameter_value(rotor, path)
        except ValueError as error:
            if not str(error).endswith(f": {path}.scale"):
                raise
            values[f"{path}.scale"] = parameter_value(rotor, f"{path}.scale")
        assert typical_size(rotor, path) > 0
    return values


@pytest.mark.parametrize("rotor", [ROTOR, compressor(), rotor23(100.0)], ids=["drawn", "compressor", "23"])
def test_what_is_read_gives_an_equal_rotor(rotor):
    values = read_back(rotor)
    assert len(values) > 20
    assert with_parameters(rotor, values) == rotor
    assert with_parameters(rotor, dict(reversed(values.items()))) == rotor
    assert with_changes(rotor, dict.fromkeys(values, 0.0)) == rotor


@given(machines())
def test_what_is_read_gives_an_equal_rotor_whatever_it_is(rotor):
    assert with_parameters(rotor, read_back(rotor)) == rotor


def test_coefficients_by_index_name_list_and_all():
    assert parameter_value(ROTOR, "bearing[2].kyx") == parameter_value(ROTOR, "bearing[NDE].kyx") == -1e6
    assert parameter_value(ROTOR, "seal[1].kyy") == parameter_value(ROTOR, "seal.kxx") == -1e5
    changed = with_parameters(
        ROTOR,
        {"bearing.kxx": 6e7, "bearing[1,NDE].cyy": 5.0, "seal[1].kxy": 3.0, "bearing[DE].stiffness.scale": 2},
    )
    assert changed.supports[0].stiffness == ((1.2e8, 0.0), (0.0, 2e7))
    assert changed.supports[2].stiffness == ((6e7, 1e6), (-1e6, 3e7))
    assert [s.damping for s in changed.supports] == [((100.0, 0), (0, 5.0)), 0.0, ((200.0, 0), (0, 5.0))]
    assert changed.supports[1].stiffness == ((-1e5, 3.0), (-2e5, -1e5))
    assert with_parameters(ROTOR, {"bearing[1].stiffness": 3.0}).supports[0].stiffness == 3.0
    assert changed.discs == ROTOR.discs


def test_pedestals_discs_and_material():
    values = {
        "bearing[1].pedestal_stiffness_y": 6e7,
        "bearing[1].pedestal_mass": 30.0,
        "bearing.pedestal_damping.scale": 2.0,
        "bearing[2].tilting_stiffness": 1e3,
        "disc[wheel].scale": 2.0,
        "disc.mass.scale": 3.0,
        "material.youngs_modulus": 2e11,
        "material.density.scale": 1.1,
    }
    changed = with_parameters(ROTOR, values)
    assert changed.supports[0].pedestal == fem.Pedestal(30.0, (4e7, 6e7), 20.0)
    assert changed.supports[2] == replace(ROTOR.supports[2], tilting_stiffness=1e3)
    assert changed.discs == (fem.Disc(2, 30.0, 0.2, 0.1, "wheel"), fem.Disc(3, 21.0, 0.2))
    assert (changed.youngs_modulus == 2e11).all()
    np.testing.assert_allclose(changed.density, ROTOR.density * 1.1, rtol=1e-15)


def test_scales_multiply_and_a_scale_twice_is_its_square():
    once = with_parameters(ROTOR, {"bearing[2].kxx.scale": 2.0})
    assert with_parameters(once, {"bearing[2].kxx.scale": 2.0}).supports[2].stiffness[0][0] == 8e7
    both = with_parameters(ROTOR, {"bearing[2].kxx.scale": 2.0, "bearing.kxx.scale": 3.0})
    assert both.supports[2].stiffness == ((1.2e8, 1e6), (-1e6, 3e7))
    table = compressor()
    i = next(i for i, s in enumerate(table.supports) if s.speeds)
    kind = table.supports[i].kind
    scaled = with_parameters(table, {f"{kind}.stiffness.scale": 1.1}).supports[i]
    at = np.array(scaled.speeds)
    np.testing.assert_allclose(scaled.at(at)[0], 1.1 * table.supports[i].at(at)[0], rtol=1e-14)
    np.testing.assert_array_equal(scaled.at(at)[1], table.supports[i].at(at)[1])


def test_slope_and_curve_add_to_constants_and_tables():
    sloped = with_parameters(ROTOR, {"bearing[2].kxy.slope": 50.0, "bearing[2].kxy": 7.0})
    assert sloped.supports[2].speeds == (0.0, 1e4)
    k, c = sloped.supports[2].at(500.0)
    np.testing.assert_allclose(k, [[2e7, 7.0 + 25e3], [-1e6, 3e7]], rtol=1e-14)
    np.testing.assert_array_equal(c, np.diag([200.0, 300.0]))
    curved = with_parameters(sloped, {"bearing[2].cyy.curve": 1e-3, "bearing[2].kxy.scale": 2.0}).supports[2]
    k, c = curved.at([250.0, 312.5])
    np.testing.assert_allclose(k[:, 0, 1], 14 + 100 * np.array([250.0, 312.5]), rtol=1e-12)
    np.testing.assert_allclose(c[1, 1, 1], 300 + 1e-3 * 312.5**2, rtol=1e-12)
    constant = with_parameters(ROTOR, {"seal[1].kxx.curve": -2.0, "seal[1].stiffness.slope": 3.0}).supports[1]
    np.testing.assert_allclose(constant.speeds, np.linspace(0, 3000, 97), rtol=1e-15)
    np.testing.assert_allclose(constant.at(3000.0)[0][0, 0], -1e5 - 2 * 9e6 + 9e3, rtol=1e-14)
    np.testing.assert_allclose(constant.at(3000.0)[0][1, 1], -1e5 + 9e3, rtol=1e-14)
    offset = with_parameters(ROTOR, {"bearing[1].stiffness.offset": 5.0}).supports[0]
    assert (offset.speeds, offset.stiffness) == ((), 1e7 + 5)


def test_a_table_ends_before_a_bearing_pushes_outwards():
    sloped = with_parameters(ROTOR, {"bearing[2].kxx.slope": -4e4, "bearing[2].cxx.slope": -0.1})
    assert sloped.supports[2].speeds == pytest.approx((0.0, 500.0), rel=1e-8)
    curved = with_parameters(ROTOR, {"bearing[2].kxx.curve": -80.0}).supports[2]
    assert (curved.speeds[-1], len(curved.speeds)) == (pytest.approx(500.0, rel=1e-8), 17)
    assert parameter_value(sloped, "bearing[2].kxx.slope") == 0


def test_changes_from_where_the_rotor_stands_go_for_tables_too():
    sloped = with_parameters(ROTOR, {"bearing[2].kxx.slope": 100.0})
    changed = with_changes(
        sloped, {"bearing[2].kxx": 5e5, "disc[2].mass": 0.5, "bearing.kyy.scale": 0.1, "bearing.cxx": -1.0}
    )
    k, c = changed.supports[2].at(200.0)
    np.testing.assert_allclose([k[0, 0], k[1, 1], c[0, 0]], [2e7 + 2e4 + 5e5, 3.3e7, 199.0], rtol=1e-14)
    assert changed.discs[1].mass == 7.5


def test_sizes_for_steps():
    assert typical_size(ROTOR, "bearing[1].kxy") == 1e7
    assert typical_size(ROTOR, "bearing[2].kxy") == 1e6
    assert typical_size(ROTOR, "bearing[2].cxy") == 300.0
    assert typical_size(ROTOR, "seal[1].cxx") == 1.0
    assert typical_size(ROTOR, "bearing[1].kxx.slope") == 1e4
    assert typical_size(ROTOR, "bearing[2].kyy.curve") == 30.0
    assert typical_size(ROTOR, "disc.scale") == typical_size(ROTOR, "key_phasor.angle") == 1.0


def test_angles_are_of_the_readings():
    assert is_reading("probe[DE x].angle")
    assert is_reading("key_phasor.angle")
    assert not is_reading("bearing[1].kxx")
    assert parameter_value(ROTOR, "probe[DE x].angle") == 0
    assert with_parameters(ROTOR, {"probe[DE x].angle": 5.0, "key_phasor.angle": -3.0}) == ROTOR


def test_wildcards():
    assert expand(ROTOR, "bearing[*].kxx.scale") == ("bearing[1].kxx.scale", "bearing[2].kxx.scale")
    assert expand(ROTOR, "bearing[*].pedestal_mass") == ("bearing[1].pedestal_mass",)
    assert expand(ROTOR, "disc[*].mass") == ("disc[1].mass", "disc[2].mass")
    assert expand(ROTOR, "probe[*].angle", ["A", "B"]) == ("probe[A].angle", "probe[B].angle")
    for path in ("bearing[1,2].kxx", "bearing.stiffness", "key_phasor.angle", "probe[A].angle"):
        assert expand(ROTOR, path) == (path,)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("kxx", "is no parameter: one looks like"),
        ("bearings[1].kxx", "did you mean 'bearing'"),
        ("bearing[1].kxxx", "did you mean 'kxx'"),
        ("bearing[1].stiffnes", "did you mean 'stiffness'"),
        ("bearing[1].kxx.scal", "did you mean 'scale'"),
        ("bearing[1].pedestal_mass.slope", "suffix 'slope' is not known"),
        ("bearing[DEE].kxx", r"of 2 bearings none is called 'DEE' \(did you mean 'DE'"),
        ("bearing[3].kxx", "of 2 bearings none is called '3': .*1, 2, DE or NDE"),
        ("bearing[1,1].kxx", "names one bearing twice"),
        ("bearing[1,DE].kxx", "names one bearing twice"),
        ("bearing[2].pedestal_mass", "stands on no pedestal"),
        ("seal.pedestal_mass", "stands on no pedestal"),
        ("disc[wheal].mass", "did you mean 'wheel'"),
        ("disc[1].width", "of a disc, 'width' is not known"),
        ("disc.scale.scale", "suffix 'scale' is not known"),
        ("material[1].density", r"write material\.density"),
        ("probe.angle", r"write probe\[NAME\]\.angle"),
        ("probe[C].angle", "the probe 'C' is not known"),
        ("probe[A].angl", "did you mean 'angle'"),
    ],
)
def test_a_wrong_path_is_refused_in_words(path, words):
    with pytest.raises(ValueError, match=words):
        expand(ROTOR, path, ["A", "B"])


def test_values_that_are_not_one_number_are_refused():
    with pytest.raises(ValueError, match=r"bearing\.kxx is several numbers, 1e\+07 to 2e\+07"):
        parameter_value(ROTOR, "bearing.kxx")
    table = with_parameters(ROTOR, {"bearing[1].kxx.slope": 1.0})
    for refused in (parameter_value, lambda rotor, path: with_parameters(rotor, {path: 1.0})):
        with pytest.raises(ValueError, match=r"bearing\[1\]\.kyy is a table: bearing\[1\]\.kyy\.scale"):
            refused(table, "bearing[1].kyy")
        with pytest.raises(ValueError, match=r"differs along the shaft: material\.density\.scale"):
            refused(replace(ROTOR, density=[7800.0, 7000, 7800, 7800]), "material.density")
    with pytest.raises(ValueError, match="another parameter has this number"):
        with_parameters(ROTOR, {"bearing[1].stiffness": 1e7, "bearing.kyy": 1e7})
    with pytest.raises(ValueError, match=r"bearing\[1\]\.kxx must be a number"):
        with_parameters(ROTOR, {"bearing[1].kxx": "x"})
    with pytest.raises(ValueError, match="finite and not negative, not -1"):
        with_parameters(ROTOR, {"bearing[1].kxx": -1.0})
    twins = fem.Rotor([0.1], 0.05, supports=[fem.Support(1, 1.0, name="A"), fem.Support(2, 1.0, name="A")])
    with pytest.raises(ValueError, match="of 2 bearings several are called 'A'"):
        parameter_value(twins, "bearing[A].kxx")
    with pytest.raises(ValueError, match="the rotor has no seal"):
        parameter_value(twins, "seal.kxx")
