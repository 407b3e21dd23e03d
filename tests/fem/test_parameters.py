"""Parameters of a rotor by name: what is read is what is set, and what is refused is said.

Error bands against rotors drawn from the covariance, which are built by hand.
"""

from dataclasses import replace

import numpy as np
import pytest
from fem_rotors import machines
from hypothesis import given
from repetitions import FULL

import fem
from fem import is_reading
from fem.parameters import (
    band,
    expand,
    parameter_value,
    spread,
    typical_size,
    with_changes,
    with_parameters,
)
from rotorid.files import read_rotor
from rotorid.samples import sample_data

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

TABLE = replace(
    ROTOR,
    supports=[
        *ROTOR.supports[:2],
        fem.Support(
            5,
            (((2e7, 0.0), (0.0, 3e7)), ((2e7, 2e6), (-1e6, 3e7))),
            ((200.0, 0.0), (0.0, 300.0)),
            "NDE",
            (100.0, 300.0),
        ),
    ],
)
"""The same with a table."""


def compressor():
    return read_rotor(sample_data() / "compressor" / "rotor.toml")


def all_paths(rotor):
    yield from (f"material.{name}" for name in ("youngs_modulus", "density", "poisson_ratio"))
    for kind in ("bearing", "seal"):
        own = [s for s in rotor.supports if s.kind == kind]
        for i, support in enumerate(own, start=1):
            names = [*PLAIN, *(f"pedestal_{n}" for n in STAND if support.pedestal)]
            yield from (f"{kind}[{i}].{name}" for name in names)
            yield from (f"{kind}[{i}].{q}.{s}" for q in ("kxx", "damping") for s in ("scale", "offset"))
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


@pytest.mark.parametrize("rotor", [ROTOR, compressor()], ids=["drawn", "compressor"])
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
    before, after = (r.supports[2].at([100.0, 200.0]) for r in (TABLE, with_parameters(TABLE, TENTH)))
    np.testing.assert_allclose(after[0], 1.1 * before[0], rtol=1e-14)
    np.testing.assert_array_equal(after[1], before[1])


TENTH = {"bearing[2].stiffness.scale": 1.1}


def test_offsets_add_to_constants_and_tables():
    offset = with_parameters(ROTOR, {"bearing[1].stiffness.offset": 5.0}).supports[0]
    assert (offset.speeds, offset.stiffness) == ((), 1e7 + 5)
    values = {"bearing[2].kxy.offset": 50.0, "bearing[2].kxy": 7.0, "bearing[2].kxy.scale": 2.0}
    assert with_parameters(ROTOR, values).supports[2].stiffness == ((2e7, 64.0), (-1e6, 3e7))
    k, _ = with_parameters(TABLE, {"bearing[2].kxy.offset": 50.0}).supports[2].at([100.0, 200.0])
    np.testing.assert_array_equal(k[:, 0, 1], [50.0, 1e6 + 50.0])


def test_changes_from_where_the_rotor_stands_go_for_tables_too():
    changed = with_changes(
        TABLE, {"bearing[2].kxx": 5e5, "disc[2].mass": 0.5, "bearing.kyy.scale": 0.1, "bearing.cxx": -1.0}
    )
    k, c = changed.supports[2].at(200.0)
    np.testing.assert_allclose([k[0, 0], k[1, 1], c[0, 0]], [2e7 + 5e5, 3.3e7, 199.0], rtol=1e-14)
    assert changed.discs[1].mass == 7.5


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
        ("bearings[1].kxx", "did you mean 'bearing'"),
        ("bearing[1].kxxx", "did you mean 'kxx'"),
        ("bearing[1].kxx.slope", "suffix 'slope' is not known .*one of scale, offset"),
        ("bearing[DEE].kxx", r"the bearing 'DEE' is not known \(did you mean 'DE'"),
        ("bearing[1, 3].kxx", "the bearing '3' is not known: one of 1, 2, DE, NDE"),
        ("disc[1].width", "of a disc, 'width' is not known"),
        ("probe.angle", r"the kind 'probe' is not known: .*probe\[NAME\]\.angle"),
        ("probe[C].angle", "the probe 'C' is not known"),
    ],
)
def test_a_wrong_path_is_refused_in_words(path, words):
    with pytest.raises(ValueError, match=words):
        expand(ROTOR, path, ["A", "B"])


def test_values_that_are_not_one_number_are_refused():
    with pytest.raises(ValueError, match=r"bearing\.kxx is several numbers, 1e\+07 to 2e\+07"):
        parameter_value(ROTOR, "bearing.kxx")
    for refused in (parameter_value, lambda rotor, path: with_parameters(rotor, {path: 1.0})):
        with pytest.raises(
            ValueError, match=r"bearing\[2\]\.kxy is several numbers.*: bearing\[2\]\.kxy\.scale"
        ):
            refused(TABLE, "bearing[2].kxy")
        with pytest.raises(ValueError, match=r"several numbers, 7000 to 7800: material\.density\.scale"):
            refused(replace(ROTOR, density=[7800.0, 7000, 7800, 7800]), "material.density")
    with pytest.raises(ValueError, match="another parameter has this number"):
        with_parameters(ROTOR, {"bearing[1].stiffness": 1e7, "bearing.kyy": 1e7})
    twins = fem.Rotor([0.1], 0.05, supports=[fem.Support(1, 1.0, name="A"), fem.Support(2, 1.0, name="A")])
    with pytest.raises(ValueError, match="the bearing 'A' is not known: one of 1, 2"):
        parameter_value(twins, "bearing[A].kxx")


NAMES = ("bearing[1].kxx", "bearing[2].stiffness.scale", "material.youngs_modulus", "disc[wheel].mass")
VALUES = np.array([4e7, 1.0, 2.1e11, 60.0])
RELATIVE = np.array([[0.03, 0, 0, 0], [-0.02, 0.03, 0, 0], [0.01, 0.005, 0.01, 0], [0, 0, 0.01, 0.02]])
ERRORS = RELATIVE * VALUES[:, None]
DRAWS = 800 if FULL else 300
WITHIN = 4 / np.sqrt(2 * DRAWS)  # four standard errors of a standard deviation


def built(values):
    k, scale, modulus, mass = values
    return fem.Rotor(
        [0.15] * 8,
        0.08,
        youngs_modulus=modulus,
        discs=[fem.Disc(4, mass, 1.0, 0.6, "wheel"), fem.Disc(7, 30.0)],
        supports=[
            fem.Support(1, ((k, 0.0), (0.0, 3e7)), 4e3),
            fem.Support(9, ((5e7 * scale, 5e6 * scale), (-5e6 * scale, 5e7 * scale)), 4e3),
        ],
        model=fem.Model(rotary_inertia=True, gyroscopic=True),
    )


CALIBRATED = replace(built(VALUES), calibration=fem.Calibration(NAMES, VALUES, ERRORS @ ERRORS.T))


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(7)
    return [built(VALUES + ERRORS @ rng.normal(size=4)) for _ in range(DRAWS)]


def criticals(rotor):
    return fem.critical_speeds(rotor, 4).frequencies


def test_critical_speeds_scatter_as_the_band_says(drawn):
    scatter = np.std([criticals(rotor) for rotor in drawn], axis=0)
    np.testing.assert_allclose(spread(CALIBRATED, criticals), scatter, rtol=WITHIN)


def test_what_is_linear_is_exact_and_complex_values_count_by_size():
    std = spread(CALIBRATED, lambda r: np.array([r.supports[0].stiffness[0][0], 2j * r.discs[0].mass]))
    expected = np.sqrt(np.diag(ERRORS @ ERRORS.T))[[0, 3]] * [1, 2]
    np.testing.assert_allclose(std, expected, rtol=1e-6)


def test_where_no_band_can_be_given_words_say_why():
    assert band(replace(CALIBRATED, calibration=None), "x", criticals) == (None, ())
    with pytest.raises(ValueError, match="no calibration"):
        spread(replace(CALIBRATED, calibration=None), criticals)
    wild = replace(CALIBRATED, calibration=fem.Calibration(("bearing[1].kxx",), [4e7], [[2.5e15]]))
    for rotor, values, words in (
        (wild, criticals, "within the errors of the calibration, support at node 1: "),
        (CALIBRATED, lambda rotor: np.zeros(2 + (rotor.discs[0].mass > 60.0)), "their number changes"),
    ):
        std, (text,) = band(rotor, "them", values)
        assert std is None
        assert text.startswith("no error bands of them: ")
        assert words in text
    contradicted = replace(CALIBRATED.calibration, needs_trial_run=True)
    _, (text,) = band(replace(CALIBRATED, calibration=contradicted), "the critical speeds", criticals)
    assert "contradict the model" in text
