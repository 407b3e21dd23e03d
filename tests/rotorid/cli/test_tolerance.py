"""`rotorid tolerance`."""

import pytest

USUAL = ("tolerance", "--mass", "500kg", "--speed", "3000rpm", "--grade", "G2.5")


def test_the_known_example(cli):
    outcome = cli(*USUAL)
    assert outcome.code == 0
    found = cli(*USUAL, "--json").json
    assert found["permissible_g_mm"] == pytest.approx(3978.87, abs=0.01)
    assert found["specific_um"] == pytest.approx(7.958, abs=0.001)
    assert found["grade"] == "G2.5"
    assert found["planes"] == []
    assert found["bearings"] is None
    assert found["provenance"]["options"]["speed"] == "3000rpm"


def test_units_are_converted(cli):
    pounds = cli("tolerance", "--mass", "1102.3113 lb", "--speed", "50Hz", "--grade", "2,5", "--json").json
    assert pounds["permissible_g_mm"] == pytest.approx(3978.87, abs=0.01)
