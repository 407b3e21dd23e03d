import math

import numpy as np
import pytest

import fem
from fem import (
    api617_limit,
    api_unbalance,
    peak_columns,
    response_peaks,
)
from rotorid.commands.operating_range import Separation, critical_peaks, open_question, unsearched


def jeffcott(speeds, zeta, critical=100.0):
    return speeds**2 / np.abs(critical**2 - speeds**2 + 2j * zeta * critical * speeds)


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


def test_half_power_points_outside_the_range_are_said():
    speeds = np.linspace(90.0, 104.0, 200)
    (peak,) = peaks_of(speeds, damped(0.05), operating=(150.0, 200.0)).peaks
    assert peak.below is not None
    assert peak.above is None
    assert peak.amplification is None
    assert peak.required is None
    assert peak.enough is None
    assert peak.note == "the steady speeds end before the curve falls to 0.707 above"


def test_a_higher_neighbour_hides_the_half_power_point():
    speeds = np.linspace(50.0, 200.0, 2000)
    found = peaks_of(speeds, lambda speed: jeffcott(speed, 0.04) + 3 * jeffcott(speed, 0.04, 112.0))
    if len(found.peaks) == 2:
        assert found.peaks[0].above is None
        assert "another peak" in found.peaks[0].note
    two = peaks_of(speeds, lambda speed: jeffcott(speed, 0.04) + 0.9 * jeffcott(speed, 0.03, 109.0))
    first = two.peaks[0]
    assert first.amplification is None
    assert "another peak" in first.note


@pytest.mark.parametrize(
    ("AF", "below", "above"),
    [
        (2.4999, 0.0, 0.0),
        (2.5, 0.0, 10.0),
        (3.55, 17 * (1 - 1 / 2.05), 10 + 17 * (1 - 1 / 2.05)),
        (10.0, 15.0, 25.0),
        (18.5, 16.0, 26.0),
        (100.0, 16.0, 26.0),
    ],
)
def test_required_margins(AF, below, above):
    assert fem.required_margin(AF, above=False) == pytest.approx(below)
    assert fem.required_margin(AF, above=True) == pytest.approx(above)


def test_separation_from_the_operating_range():
    speeds = np.linspace(3.0, 400.0, 1000)
    speed = closed_form(0.05)[0]

    def peak(low, high):
        return peaks_of(speeds, damped(0.05), operating=(low, high)).peaks[0]

    over = peak(110.0, 150.0)  # the critical speed is below
    assert over.margin == pytest.approx(100 * (110 - speed) / 110)
    assert over.required == pytest.approx(17 * (1 - 1 / (over.amplification - 1.5)))
    assert over.enough is False
    assert peak(130.0, 150.0).enough is True
    under = peak(20.0, 80.0)
    assert under.margin == pytest.approx(100 * (speed - 80) / 80)
    assert under.required == pytest.approx(10 + 17 * (1 - 1 / (under.amplification - 1.5)))
    inside = peak(80.0, 120.0)
    assert inside.margin == 0
    assert inside.enough is False
    flat = peaks_of(speeds, damped(0.35), operating=(80.0, 160.0)).peaks[0]
    assert flat.amplification < 2.5
    assert flat.enough is True


def test_no_peak():
    speeds = np.linspace(1.0, 50.0, 30)
    found = peaks_of(speeds, np.square)
    assert found.peaks == ()
    assert found.sentence() == "no peak in this range of speeds"
    assert found.to_dict()["peaks"] == []


def test_results_speak():
    speeds = np.linspace(3.0, 400.0, 300)
    found = peaks_of(speeds, damped(0.05), operating=(110.0, 150.0))
    assert "NOT ENOUGH" in found.summary()
    assert peak_columns(found.peaks, "µm", 1e6)[2].heading == "amplitude, µm peak"
    assert f"{found.peaks[0].amplitude:.4g}" in found.summary()
    assert len(found.to_frame()) == 1
    assert found.to_dict()["peaks"][0]["enough"] is False


def test_an_impossible_range_of_operating_speeds():
    with pytest.raises(ValueError, match="lowest and a highest"):
        peaks_of(np.array([1.0, 2.0, 3.0]), damped(0.1), operating=(5.0, 2.0))


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


def test_one_end_of_a_half_power_band_is_enough_to_belong_together():
    hidden = fem.Peak(100.0, 1.0, None, 102.5, None, None, None)
    clear = fem.Peak(102.2, 2.0, 99.5, 105.0, 18.6, None, None)
    each = [fem.Peaks((peak,), None) for peak in (hidden, clear)]
    assert critical_peaks(["x", "y"], each) == [("y", clear)]


def test_what_is_not_known_and_what_to_do():
    speeds, rpm = np.linspace(90.0, 104.0, 200), 30 / math.pi
    found = peaks_of(speeds, damped(0.05), operating=(115.0, 120.0))
    text = open_question(found.peaks, 90.0, 104.0, (115.0, 120.0))
    assert "no amplification factor at 957" in text
    assert f"only speeds from {90 * rpm:.6g} to {104 * rpm:.6g} rpm were searched" in text
    assert f"give speeds from {90 * rpm:.0f} to {1.26 * 120 * rpm:.0f} rpm" in text
    wide = np.linspace(3.0, 400.0, 1000)
    known = peaks_of(wide, damped(0.05), operating=(115.0, 120.0))
    assert open_question(known.peaks, 3.0, 400.0, (115.0, 120.0)) == ""
    assert unsearched(3.0, 400.0, None) == ""


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
    assert Separation([100.0], (300.0, 400.0), "few").sentence().endswith("rpm: few.")
    assert outside.tables()[0].rows[0][1] == 25.0


def machine(damping=2e3):
    supports = [fem.Support(1, 2e7, damping, "front"), fem.Support(7, 2e7, damping, "rear")]
    return fem.Rotor([0.15] * 6, 0.05, discs=[fem.Disc(4, 15.0)], supports=supports)


@pytest.mark.parametrize("step", [40.0, 7.0])
def test_peaks_do_not_depend_on_the_steps(step):
    speeds = np.arange(20.0, 900.0, step)
    response = fem.unbalance_response(machine(), {4: 1e-3, 2: 3e-4j}, speeds)
    sensors = [4, (2, 45.0)]
    finer, peaks = fem.resolve_peaks(response, sensors, operating=(100.0, 200.0))
    many = fem.unbalance_response(machine(), {4: 1e-3, 2: 3e-4j}, np.arange(20.0, 900.0, 0.05))
    for sensor, found in zip(sensors, peaks, strict=True):
        dense = fem.response_peaks(many, sensor, operating=(100.0, 200.0)).peaks
        assert len(found.peaks) == len(dense) > 0
        for one, other in zip(found.peaks, dense, strict=True):
            assert one.speed == pytest.approx(other.speed, rel=1e-6)
            assert one.amplitude == pytest.approx(other.amplitude, rel=1e-6)
            assert one.amplification == pytest.approx(other.amplification, rel=1e-4)
            assert one.margin == pytest.approx(other.margin, abs=1e-3)
            assert np.abs(finer.speeds / one.speed - 1).min() < 2e-7  # nearer ones differ by rounding
    assert np.isin(speeds, finer.speeds).all()
    k = np.searchsorted(finer.speeds, speeds)
    np.testing.assert_allclose(finer.readings(sensors)[k], response.readings(sensors), rtol=1e-12)


def test_too_few_speeds_show_no_peak():
    response = fem.unbalance_response(machine(), {4: 1e-3}, [100.0, 200.0])
    finer, peaks = fem.resolve_peaks(response, [4])
    assert finer is response
    assert peaks == []


def test_undamped_peaks_are_said():
    response = fem.unbalance_response(machine(0.0), {4: 1e-3}, np.arange(20.0, 900.0, 40.0))
    finer, (found,) = fem.resolve_peaks(response, [4])
    assert found.peaks[0].undamped
    assert finer.warnings[-1].startswith("practically undamped peaks")
    near = np.abs(finer.speeds - found.peaks[0].speed) < 1e-2 * found.peaks[0].speed
    assert np.isin(finer.speeds[near], response.speeds).all()
