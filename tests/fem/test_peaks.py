import math

import numpy as np
import pytest

import fem
from fem import (
    api617_limit,
    api_unbalance,
    response_peaks,
)
from rotorid.commands.operating_range import Separation, critical_peaks


def jeffcott(speeds, zeta, critical=100.0):
    return speeds**2 / abs(critical**2 - speeds**2 + 2j * zeta * critical * speeds)


class Curve:
    """A response whose only reading is a function of speed."""

    def __init__(self, speeds, curve):
        self.speeds, self.curve, self.steady = speeds, curve, np.ones(speeds.shape, bool)

    def at(self, sensor):
        return self.curve(self.speeds)

    def solve(self, speeds):
        return Curve(speeds, self.curve)


def peaks_of(speeds, curve, **options):
    return response_peaks(Curve(speeds, curve), 1, **options)


def damped(zeta):
    return lambda speeds: jeffcott(speeds, zeta)


def closed_form(zeta, critical=100.0):
    """Peak and half-power speeds: with r = (ω0/Ω)², (r − 1)² + 4 ζ² r is twice its minimum there."""
    peak = critical / math.sqrt(1 - 2 * zeta**2)
    low = 4 * zeta**2 * (1 - zeta**2)
    r = np.roots([1, 4 * zeta**2 - 2, 1 - 2 * low])
    below, above = np.sort(critical / np.sqrt(r))
    return peak, below, above


@pytest.mark.parametrize("steps", [60, 173, 1000, 4001])
@pytest.mark.parametrize("zeta", [0.03, 0.1, 0.25])
def test_jeffcott_whatever_the_step(steps, zeta):
    speeds = np.linspace(3.0, 400.0, steps)
    (peak,) = peaks_of(speeds, damped(zeta)).peaks
    speed, below, above = closed_form(zeta)
    assert peak.speed == pytest.approx(speed, rel=1e-7)
    assert peak.below == pytest.approx(below, rel=1e-8)
    assert peak.above == pytest.approx(above, rel=1e-8)
    assert peak.amplification == pytest.approx(speed / (above - below), rel=1e-7)
    assert peak.amplitude == pytest.approx(1 / (2 * zeta * math.sqrt(1 - zeta**2)), rel=1e-8)
    assert peak.note == ""


def test_an_undamped_peak_has_no_amplitude():
    speeds = np.sort(np.concatenate([np.linspace(60.0, 140.0, 50), 100 + 1e-5 * np.arange(-9.5, 10)]))
    found = peaks_of(speeds, damped(1e-12), operating=(120.0, 130.0))
    (peak,) = found.peaks
    assert peak.undamped
    assert peak.amplification is None
    assert peak.required == 16.0
    assert "practically undamped" in found.summary()
    assert found.to_dict()["peaks"][0]["amplitude"] is None


def test_half_power_points_outside_the_range_are_unknown():
    (peak,) = peaks_of(np.linspace(90.0, 104.0, 200), damped(0.05), operating=(150.0, 200.0)).peaks
    assert peak.below is not None
    assert (peak.above, peak.amplification, peak.required, peak.enough) == (None,) * 4
    assert peak.note == "the steady speeds end before the curve falls to 0.707 above"


@pytest.mark.parametrize(
    ("AF", "below", "above"),
    [
        (2.4999, 0.0, 0.0),
        (2.5, 0.0, 10.0),
        (3.55, 17 * (1 - 1 / 2.05), 10 + 17 * (1 - 1 / 2.05)),
        (10.0, 15.0, 25.0),
        (100.0, 16.0, 26.0),
    ],
)
def test_required_margins(AF, below, above):
    assert fem.required_margin(AF, above=False) == pytest.approx(below)
    assert fem.required_margin(AF, above=True) == pytest.approx(above)


@pytest.mark.parametrize(
    ("zeta", "operating", "margin", "required", "enough"),
    [
        (0.05, (110.0, 150.0), lambda v: (110 - v) / 1.1, lambda AF: 17 * (1 - 1 / (AF - 1.5)), False),
        (0.05, (130.0, 150.0), lambda v: (130 - v) / 1.3, lambda AF: 17 * (1 - 1 / (AF - 1.5)), True),
        (0.05, (20.0, 80.0), lambda v: (v - 80) / 0.8, lambda AF: 10 + 17 * (1 - 1 / (AF - 1.5)), True),
        (0.05, (80.0, 120.0), lambda _: 0.0, None, False),
        (0.35, (80.0, 160.0), lambda _: 0.0, None, True),  # flat: an amplification below 2.5 asks for nothing
    ],
)
def test_separation_from_the_operating_range(zeta, operating, margin, required, enough):
    (peak,) = peaks_of(np.linspace(3.0, 400.0, 1000), damped(zeta), operating=operating).peaks
    assert peak.margin == pytest.approx(margin(closed_form(zeta)[0]))
    assert required is None or peak.required == pytest.approx(required(peak.amplification))
    assert peak.enough is enough


def test_one_peak_a_critical_speed():
    """Two readings of two critical speeds, the second one sharp and near: four peaks, two rows."""
    speeds = np.linspace(50.0, 200.0, 2000)
    each = [
        peaks_of(speeds, lambda s, a=a, b=b: a * jeffcott(s, 0.08) + b * jeffcott(s, 0.01, 140.0))
        for a, b in ((1.0, 0.2), (0.5, 0.3))
    ]
    assert sum(len(one.peaks) for one in each) == 4
    chief = critical_peaks(["x", "y"], each)
    assert [name for name, _ in chief] == ["x", "y"]
    assert [peak.speed for _, peak in chief] == pytest.approx([100, 140], rel=0.02)


def test_limits_of_the_standards():
    assert api617_limit(400 * math.pi) == pytest.approx(25.4e-6)
    assert api617_limit(100 * math.pi) == pytest.approx(50.8e-6)
    ounce_inch = 28.349523e-3 * 25.4e-3
    assert api_unbalance(0.45359237 * 100, math.pi * 100) == pytest.approx(
        4 * 100 / 3000 * ounce_inch, rel=1e-4
    )


def test_critical_speeds_beside_a_range():
    inside = Separation([100.0, 350.0], (300.0, 400.0))
    assert inside.sentence().startswith("INSIDE the operating range 2864.79 to 3819.72 rpm: 3342.25 rpm")
    outside = Separation([100.0, 500.0], (300.0, 400.0))
    assert "the nearest, 4774.65 rpm, is 25.0 % away" in outside.sentence()
    assert outside.to_dict()["critical_speeds"][0]["separation_percent"] == pytest.approx(200 / 3)


def machine(damping=2e3):
    supports = [fem.Support(1, 2e7, damping, "front"), fem.Support(7, 2e7, damping, "rear")]
    return fem.Rotor([0.15] * 6, 0.05, discs=[fem.Disc(4, 15.0)], supports=supports)


def test_peaks_do_not_depend_on_the_steps():
    def response(step):
        return fem.unbalance_response(machine(), {4: 1e-3, 2: 3e-4j}, np.arange(20.0, 900.0, step))

    sensors = [4, (2, 45.0)]
    finer, peaks = fem.resolve_peaks(response(40.0), sensors, operating=(100.0, 200.0))
    for sensor, coarse in zip(sensors, peaks, strict=True):
        dense = fem.response_peaks(response(0.05), sensor, operating=(100.0, 200.0)).peaks
        assert len(coarse.peaks) == len(dense) > 0
        for one, other in zip(coarse.peaks, dense, strict=True):
            assert (one.speed, one.amplitude) == pytest.approx((other.speed, other.amplitude), rel=1e-6)
            assert one.amplification == pytest.approx(other.amplification, rel=1e-4)
            assert one.margin == pytest.approx(other.margin, abs=1e-3)
            assert abs(finer.speeds / one.speed - 1).min() < 2e-7  # nearer ones differ by rounding
    k = np.searchsorted(finer.speeds, response(40.0).speeds)
    np.testing.assert_allclose(finer.readings(sensors)[k], response(40.0).readings(sensors), rtol=1e-12)


def test_undamped_peaks_are_said():
    response = fem.unbalance_response(machine(0.0), {4: 1e-3}, np.arange(20.0, 900.0, 40.0))
    finer, (found,) = fem.resolve_peaks(response, [4])
    assert found.peaks[0].undamped
    assert finer.warnings[-1].startswith("practically undamped peaks")
    near = abs(finer.speeds - found.peaks[0].speed) < 1e-2 * found.peaks[0].speed
    assert np.isin(finer.speeds[near], response.speeds).all()
