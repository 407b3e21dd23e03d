"""`[calibration]` of a rotor file: it comes back with all digits, and what cannot be is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from tables_data import complaints, write_csv

import fem
from fem.parameters import with_parameters
from rotorid.files import read_rotor, write_rotor
from rotorid.samples import sample_data

HEAD = 'shaft = "shaft.csv"\n[[bearing]]\nname = "DE"\nnode = 1\nkxx = 1e7\nkyy = 2e7\n'
PLAIN = """[[calibration.parameter]]
name = "bearing[DE].kxx"
value = 1e7
std = 2e5
correlation = [1.0, -0.5]
[[calibration.parameter]]
name = "material.density.scale"
value = 1.02
std = 0.01
correlation = [-0.5, 1]
"""


@pytest.fixture
def read(tmp_path):
    write_csv(tmp_path / "shaft.csv", [["length_m", "diameter_m"], [0.3, 0.1]])

    def from_text(text):
        (tmp_path / "rotor.toml").write_text(HEAD + text, encoding="utf-8")
        return read_rotor(tmp_path / "rotor.toml").calibration

    return from_text


def drawn(rng, rotor):
    """A calibration as a fit of full correlation gives it, in units of very different size."""
    names = ("bearing[1].kxx.scale", "bearing[2].cyy.offset", "material.youngs_modulus")
    names += ("probe[DE, x].angle", "key_phasor.angle")
    A = rng.normal(size=(5, 5)) * [[1e-2], [1e-3], [3e9], [2.0], [0.5]]
    return fem.Calibration(
        names,
        rng.normal(size=5),
        A @ A.T,
        rng.uniform(0, 0.2),
        needs_trial_run=True,
        data={"job.toml": "12ab", "runs.csv": "34cd"},
    )


@pytest.mark.parametrize("seed", range(3))
def test_it_comes_back_with_all_digits(tmp_path, seed):
    plain = read_rotor(sample_data() / "compressor" / "rotor.toml")
    calibration = drawn(np.random.default_rng(seed), plain)
    rotor = replace(with_parameters(plain, {"bearing[1].kyy.scale": 1.1}), calibration=calibration)
    write_rotor(tmp_path / "r.toml", rotor)
    back = read_rotor(tmp_path / "r.toml")
    assert back == rotor
    for name in ("names", "lack_of_fit", "needs_trial_run", "data"):
        assert getattr(back.calibration, name) == getattr(calibration, name)
    np.testing.assert_array_equal(back.calibration.values, calibration.values)
    np.testing.assert_allclose(back.calibration.covariance, calibration.covariance, rtol=1e-14)


def test_without_errors_and_with_nothing_but_angles(tmp_path):
    rotor = fem.Rotor([0.3], 0.1, supports=[fem.Support(1, 1e7), fem.Support(2, 1e7)])
    for found in (
        fem.Calibration(("bearing[1].kxx",), [1e7], [[0.0]]),
        fem.Calibration(("key_phasor.angle",), [3.0], [[0.0]]),
    ):
        write_rotor(tmp_path / "r.toml", replace(rotor, calibration=found))
        again = read_rotor(tmp_path / "r.toml").calibration
        assert again.names == found.names
        np.testing.assert_array_equal(again.covariance, found.covariance)
        assert again.lack_of_fit == 0


def test_what_an_engineer_writes_is_read(read):
    found = read(PLAIN)
    np.testing.assert_allclose(found.covariance, [[4e10, -1e3], [-1e3, 1e-4]], rtol=1e-14)
    assert not found.needs_trial_run
    found = read('[[calibration.parameter]]\nname = "bearing[DE].kxx"\nvalue = 1e7\nstd = 2e5\n')
    np.testing.assert_allclose(found.covariance, [[4e10]], rtol=1e-14)
    assert read("") is None


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        (PLAIN.replace("[DE]", "[DF]"), "calibration", r"the bearing 'DF' is not known: one of 1, DE"),
        (PLAIN.replace("[DE]", "[*]"), "calibration", r"single parameter: name one, without \[\*\]"),
        (PLAIN.replace("std = 2e5", "std = -2e5"), "calibration.parameter[1].std", "0 or more"),
        ('[[calibration.data]]\nfile = "A"', "calibration.data[1].sha256", "its hash"),
        ("[calibration]\nlack_of_fit = -0.1", "calibration.lack_of_fit", "0 or more"),
    ],
)
def test_what_is_no_calibration_of_this_rotor_is_refused_with_file_and_key(read, text, key, words):
    (problem,) = complaints(read, text)
    assert problem.file.endswith("rotor.toml")
    assert problem.column == key
    assert re.search(words, problem.expected), problem.expected
