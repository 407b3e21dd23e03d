"""Tables of vectors over speed: units, conventions and errors by hand, and what is refused, in words."""

import numpy as np
import pytest

from rotorid.files import InputError
from rotorid.files.runs import read_vectors

HEAD = "run,speed_rpm,sensor,amplitude_um_pp,phase_deg,time_s,amplitude_std_um_pp,phase_std_deg\n"
ROWS = "a,600,DE,20,30,1,2,6\na,900,DE,40,90,2,2,3\n"


def read(tmp_path, text, phase="lead"):
    path = tmp_path / "vectors.csv"
    path.write_text(text)
    return read_vectors(path, phase)


def test_numbers_by_hand(tmp_path):
    (sweep,) = read(tmp_path, HEAD + ROWS)
    np.testing.assert_allclose(sweep.speeds, [20 * np.pi, 30 * np.pi])
    np.testing.assert_allclose(sweep.vectors[:, 0], [1e-5 * np.exp(1j * np.pi / 6), 2e-5j], atol=1e-20)
    along, across = 1e-12, (2e-5 * np.radians(3)) ** 2
    np.testing.assert_allclose(sweep.covariances[1, 0], [[across, 0], [0, along]], atol=1e-24)
    assert sweep.time.tolist() == [1, 2]
    (lag,) = read(tmp_path, HEAD + ROWS, "lag")
    np.testing.assert_allclose(lag.vectors, sweep.vectors.conj())
    np.testing.assert_allclose(lag.covariances[0, 0, 0, 1], -sweep.covariances[0, 0, 0, 1])


def test_runs_have_their_own_speeds_and_order(tmp_path):
    """Rows in any order, by time; without times by speed; a sensor may lack."""
    text = HEAD + "b,700,DE,1,0,5,1,1\nb,650,DE,2,0,4,1,1\nb,650,NDE,3,0,4,1,1\n" + ROWS
    b, a = read(tmp_path, text)
    assert (b.run, a.run) == ("b", "a")
    np.testing.assert_allclose(b.speeds * 30 / np.pi, [650, 700])
    assert np.isnan(b.vectors).tolist() == [[False, False], [False, True]]
    (bare,) = read(tmp_path, "run,speed_Hz,sensor,amplitude,phase_deg\na,9,x,1,0\na,8,x,2,0\n")
    assert bare.time is None
    np.testing.assert_allclose(bare.speeds / 2 / np.pi, [8, 9])
    assert bare.labels.speed_unit == "Hz"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            HEAD + ROWS.replace(",2,6", ",0,6"),
            "amplitude_std_um_pp: found '0', expected a standard dev",
        ),
        (HEAD + ROWS + "a,900,DE,1,1,2,1,1\n", "row 4, column sensor: found 'DE', expected another .* row 3"),
        (
            HEAD + ROWS + "a,901,NDE,1,1,2,1,1\n",
            "column speed_rpm: found '901', expected 900 as in row 3",
        ),
        (HEAD.replace(",phase_std_deg", "") + ROWS.replace(",2,6", ",2").replace(",2,3", ",2"), "phase_std"),
        ("run,speed_rpm,sensor,amplitude,phase_deg\na,9,x,1,0\na,9,x,2,0\n", "need a column time_s"),
    ],
)
def test_what_cannot_be_is_refused_in_words(tmp_path, text, words):
    with pytest.raises(InputError, match=words):
        read(tmp_path, text)


def test_a_table_as_instruments_write_it_is_a_run_named_as_its_file(tmp_path):
    wide = ",DE,,NDE,,\nrpm,mils pp,deg,mils pp,deg,time_s\n600,2.1,30,1.5,40,1\n650,4.2,90,2.5,95,2\n"
    (sweep,) = read(tmp_path, wide, "lag")
    assert (sweep.run, sweep.sensors, sweep.labels.vibration_unit) == ("vectors", ("DE", "NDE"), "mil_pp")
    assert sweep.time.tolist() == [1, 2]
    shown = np.array(sweep.labels.vibration(sweep.vectors))
    np.testing.assert_allclose(shown, [[[2.1, 1.5], [4.2, 2.5]], [[30, 40], [90, 95]]])
    (one,) = read(tmp_path, "RPM,Amp (mils),Phase (deg)\n600,2.1,30\n650,4.2,90\n")
    assert (one.run, one.sensors) == ("vectors", ("1",))
