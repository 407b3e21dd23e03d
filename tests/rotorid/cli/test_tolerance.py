"""`rotorid tolerance`."""

import pytest


def test_units_are_converted(cli):
    pounds = cli("tolerance", "--mass", "1102.3113 lb", "--speed", "50Hz", "--grade", "2,5", "--json").json
    assert pounds["permissible_g_mm"] == pytest.approx(3978.87, abs=0.01)
