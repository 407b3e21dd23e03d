import math

import numpy as np
import pytest

import fem
from fem._new.peaks import find_peaks


def jeffcott(speeds, zeta, critical=100.0):
    return speeds**2 / np.abs(critical**2 - speeds**2 + 2j * zeta * critical * speeds)


def peaks_of(speeds, curve, **options):
    return find_peaks(
        speeds, np.abs(curve(speeds)), lambda speed: float(np.abs(curve(np.float64(speed)))), **options
    )


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


def test_peaks_of_a_rotor_do_not_depend_on_the_step():
    rotor = fem.Rotor(
        np.full(10, 0.1),
        0.05,
        discs=[fem.Disc(6, 20.0)],
        supports=[fem.Support(n, 2e7, 2e4) for n in (1, 11)],
    )

    def found(steps):
        speeds = np.linspace(20.0, 600.0, steps)
        return fem.response_peaks(fem.unbalance_response(rotor, {6: 1e-4}, speeds), 6).peaks

    coarse, fine = found(300), found(3000)
    assert len(coarse) == len(fine) == 1
    assert coarse[0].speed == pytest.approx(fine[0].speed, rel=1e-6)
    assert coarse[0].amplification == pytest.approx(fine[0].amplification, rel=1e-4)


def test_half_power_points_outside_the_range_are_said():
    speeds = np.linspace(90.0, 104.0, 200)
    (peak,) = peaks_of(speeds, damped(0.05), operating=(150.0, 200.0)).peaks
    assert peak.below is not None
    assert peak.above is None
    assert peak.amplification is None
    assert peak.required is None
    assert peak.enough is None
    assert "above lies outside the speeds, which end at 104" in peak.note
    assert "150" not in peak.note


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
    assert found.summary() == "no peak in this range of speeds"
    assert found.to_dict()["peaks"] == []


def test_results_speak():
    speeds = np.linspace(3.0, 400.0, 300)
    found = peaks_of(speeds, damped(0.05), operating=(110.0, 150.0))
    assert "NOT ENOUGH" in found.summary()
    assert "amplitude, µm" in found.summary("µm", 1e6)
    assert f"{1e6 * found.peaks[0].amplitude:.4g}" in found.summary("µm", 1e6)
    assert len(found.to_frame()) == 1
    assert found.to_dict()["peaks"][0]["enough"] is False


def test_an_impossible_range_of_operating_speeds():
    with pytest.raises(ValueError, match="lowest and a highest"):
        peaks_of(np.array([1.0, 2.0, 3.0]), damped(0.1), operating=(5.0, 2.0))
