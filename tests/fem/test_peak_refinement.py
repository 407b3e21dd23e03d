"""Peaks of a response between the speeds that were asked for."""

import numpy as np
import pytest

import fem


def rotor(damping=2e3):
    supports = [fem.Support(1, 2e7, damping, "front"), fem.Support(7, 2e7, damping, "rear")]
    return fem.Rotor([0.15] * 6, 0.05, discs=[fem.Disc(4, 15.0)], supports=supports)


@pytest.mark.parametrize("step", [40.0, 7.0])
def test_peaks_do_not_depend_on_the_steps(step):
    speeds = np.arange(20.0, 900.0, step)
    response = fem.unbalance_response(rotor(), {4: 1e-3, 2: 3e-4j}, speeds)
    sensors = [4, (2, 45.0)]
    finer, peaks = fem.resolve_peaks(response, sensors, operating=(100.0, 200.0))
    many = fem.unbalance_response(rotor(), {4: 1e-3, 2: 3e-4j}, np.arange(20.0, 900.0, 0.05))
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
    response = fem.unbalance_response(rotor(), {4: 1e-3}, [100.0, 200.0])
    finer, peaks = fem.resolve_peaks(response, [4])
    assert finer is response
    assert peaks == []


def test_undamped_peaks_are_said():
    response = fem.unbalance_response(rotor(0.0), {4: 1e-3}, np.arange(20.0, 900.0, 40.0))
    finer, (found,) = fem.resolve_peaks(response, [4])
    assert found.peaks[0].undamped
    assert finer.warnings[-1].startswith("practically undamped peaks")
    near = np.abs(finer.speeds - found.peaks[0].speed) < 1e-2 * found.peaks[0].speed
    assert np.isin(finer.speeds[near], response.speeds).all()
