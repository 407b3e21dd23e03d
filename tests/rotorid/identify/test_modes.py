"""Modes from amplitudes: against closed forms and drawn readings, and what is said where they do not tell."""

import numpy as np
import pytest
from repetitions import FULL
from scipy.linalg import eigh

from balancing import Labels
from rotorid.base.tables import csv
from rotorid.commands.identify import identify
from rotorid.files import read_harmonic_model, read_measurements
from rotorid.files.node_tables import read_modes
from rotorid.identify.answers import SteadyAnswers
from rotorid.identify.modes import fit_modes
from rotorid.identify.modes_result import Readings
from rotorid.samples import sample_data

TASK_7_1 = sample_data() / "identify" / "task_7_1" / "model.toml"
M = np.diag([20.0, 20.0, 10.0])
K = np.array([[3e4, -2e4, 0.0], [-2e4, 2.5e4, -5e3], [0.0, -5e3, 5e3]])
AT_3, AT_1 = np.eye(3)[[2, 0]]


def undamped(M, K):
    """Natural frequencies, and shapes with 1 at the first mass."""
    squares, shapes = eigh(K, M)
    return np.sqrt(squares), (shapes / shapes[0]).T


OMEGA, SHAPES = undamped(M, K)


def around(centres, readings=9, beta=4e-4):
    """Frequencies around resonances, three half-power widths of damping β K to each side."""
    steps = 3 * np.linspace(-1, 1, readings)
    return np.concatenate([w * (1 + beta / 2 * w * steps) for w in centres])


def amplitudes(omega, force, M=M, K=K, C=None):
    """By the dynamic stiffness, frequency by frequency; C = 4e-4 K."""
    C = 4e-4 * K if C is None else C
    return np.array([np.linalg.solve(K - w**2 * M + 1j * w * C, force) for w in omega])


def noise(share, Z, seed):
    return 1 + share * np.random.default_rng(seed).standard_normal((*Z.shape, 2)) @ (1, 1j)


def fitted(omega, Z, share=0.0, seed=None, *, stated=True, bands=None, load=None):
    """Modes of readings, with errors drawn along and across each where a seed is given."""
    Z = Z if seed is None else Z * noise(share, Z, seed)
    names, shares = tuple(f"X{i}" for i in range(1, 1 + Z.shape[1])), (share, share)
    labels = Labels(speed_unit="rad_s")
    readings = Readings("", None, omega, names, Z, labels=labels, shares=shares if share and stated else None)
    load = np.ones(len(omega)) if load is None else load
    return fit_modes(readings, SteadyAnswers(omega, load.astype(complex)), bands)


def near_first(omega, share=0.0, **options):
    """Readings about the first resonance of the chain."""
    return fitted(omega, amplitudes(omega, AT_3), share, 3, **options)


def test_exact_amplitudes_give_the_exact_modes():
    """Also in any order, with a row left blank, and one cell."""
    omega = np.random.default_rng(6).permutation(around(OMEGA))
    Z = amplitudes(omega, AT_3)
    Z[3], Z[5, 1] = np.nan, np.nan
    result = fitted(omega, Z)
    frequency, zeta = result.fit.estimate.solution.reshape(2, -1)
    np.testing.assert_allclose(frequency, OMEGA, rtol=1e-9)
    np.testing.assert_allclose(zeta, 2e-4 * OMEGA, rtol=1e-7)
    np.testing.assert_allclose(result.shapes, SHAPES, rtol=1e-7)
    assert result.warnings == ()


def test_modes_beyond_the_range_hardly_bias_those_in_it():
    springs = np.array([2e4, 1.5e4, 1e4, 2e4, 1.2e4])
    M5, K5 = np.diag([10.0, 15.0, 8.0, 12.0, 20.0]), np.diag(springs + np.append(springs[1:], 0.0))
    K5 = K5 - sum(np.diag(springs[1:], side) for side in (1, -1))
    omega0, shapes = undamped(M5, K5)
    omega = around(omega0[1:2], 15, 2e-4)
    result = fitted(omega, amplitudes(omega, np.eye(5)[0], M5, K5, 2e-4 * K5))
    np.testing.assert_allclose(result.fit.estimate.solution[0], omega0[1], rtol=1e-7)
    np.testing.assert_allclose(result.fit.estimate.solution[1], 1e-4 * omega0[1], rtol=1e-3)
    np.testing.assert_allclose(result.shapes[0], shapes[1], rtol=2e-3)


@pytest.mark.full
def test_a_chain_is_identified_from_its_modes_within_the_intervals(tmp_path, cli):
    """Lesson 7 whole: amplitudes around resonances, modes, stiffnesses; 40 drawn tests."""
    omega, truth = around(OMEGA), {"c1": 1e4, "c2": 2e4, "c3": 5e3}
    held, file, path = 0, read_harmonic_model(TASK_7_1), tmp_path / "modes.csv"
    for seed in range(40):
        path.write_bytes(csv(fitted(omega, amplitudes(omega, AT_3), 0.02, seed).file_table()))
        result = identify(file, read_measurements(path, file)).result
        low, high = result.ci95.T
        true = np.array([truth[name] for name in result.parameters])
        held += np.sum((low <= true) & (true <= high))
    assert abs(held / 120 - 0.95) < 4 * np.sqrt(0.95 * 0.05 / 120)
    output = cli("identify", TASK_7_1, path, "--json").json["parameters"]
    for name, value, std in zip(result.parameters, result.values, result.std, strict=True):
        assert output[name]["value"] == pytest.approx(value, abs=0.05 * std)
        assert output[name]["std"] == pytest.approx(std, rel=0.05)  # the error of the reference counts, too


def table(path, omega, Z, F=None):
    """A table in Hz whose second point is read as a velocity and whose third as µm pp."""
    scale = np.stack((1 + 0 * omega, 1e3j * omega, 2e6 + 0 * omega), 1)
    cells = [omega / 2 / np.pi, *(() if F is None else (F.real, F.imag))]
    cells += [part for z in (scale * Z).T for part in (z.real, z.imag)]
    head = f"frequency_Hz,{'' if F is None else 'F_re,F_im,'}"
    head += "X1_re,X1_im,X2_re_mm_s,X2_im_mm_s,X3_re_um_pp,X3_im_um_pp"
    np.savetxt(path, np.stack(cells, 1), "%.17g", ",", header=head, comments="")


def test_a_velocity_under_a_force_that_the_table_has_is_the_same_mode(tmp_path, cli):
    omega, path = around(OMEGA), tmp_path / "data.csv"
    force = np.linspace(5, 20, len(omega)) * np.exp(0.7j)
    table(path, omega, amplitudes(omega, AT_1) * force[:, None], force)
    document = cli("modes", path, "--json").json
    shapes = [row["shape"] for row in document["modes"]]
    np.testing.assert_allclose(shapes, SHAPES.ravel(), rtol=1e-6)
    np.testing.assert_allclose([row["frequency_rad_s"] for row in document["modes"][::3]], OMEGA, rtol=1e-8)
    table(path, omega, amplitudes(omega, AT_1))
    refused = cli("modes", path)
    assert refused.code == 2
    assert "--excitation force or unbalance" in refused.err


def test_a_resonance_read_on_one_side_is_not_told():
    with pytest.raises(ValueError, match="both sides"):
        near_first(np.linspace(0.9, 0.999, 12) * OMEGA[0])
    bands = [(0.8 * OMEGA[0], 1.2 * OMEGA[0])]
    result = near_first(np.linspace(0.9, 0.99, 12) * OMEGA[0], 0.02, bands=bands)
    assert result.undetermined
    assert result.to_dict()["modes"] == []
    assert result.to_dict()["parameters"]["ω1"]["value"] is None
    with pytest.raises(ValueError, match="no table of modes"):
        result.file_table()


@pytest.mark.parametrize(
    ("steps", "bands", "words"),
    [
        ([-2e-3, 0, 2e-3], [(0.0, 20.0)], "too few readings"),
        ([-1e-3, 1e-3] * 6, [(10.0, 14.0)], "3 frequencies"),
        (np.linspace(-6e-3, 6e-3, 9), [(1.0, 2.0)], "no readings in --bands"),
        (np.linspace(-6e-3, 6e-3, 9), [(10.0, 14.0), (11.0, 14.0)], "--bands overlap"),
    ],
)
def test_too_few_readings_are_refused(steps, bands, words):
    with pytest.raises(ValueError, match=words):
        near_first(OMEGA[0] * (1 + np.sort(steps)), 0.01, bands=bands)


def test_three_frequencies_do_not_tell_a_mode():
    omega = np.repeat(OMEGA[0] * np.array([0.998, 1.0, 1.002]), 4)
    assert "do not tell" in near_first(omega, 0.01, bands=[(10.0, 14.0)]).undetermined[0]


@pytest.mark.full
def test_peaks_of_noise_are_no_modes():
    """Run-ups under unbalance with an error of one size: over ω², low speeds show peaks of noise."""
    omega, silent = np.linspace(10, 110, 100), 0
    stiffness = np.array([[1e4, -200.0], [-200.0, 4e4]])
    Z = amplitudes(omega, [1.0, 0.5], np.eye(2), stiffness, 2 * np.eye(2)) * omega[:, None] ** 2
    for seed in range(6 if FULL else 3):
        error = 5e-3 * np.abs(Z).max(axis=0) * (noise(1.0, Z, seed) - 1)
        result = fitted(omega, Z + error, load=omega**2)
        assert len(result.ends) > 1
        assert result.warnings
        silent += not any("no more than noise" in words for words in result.undetermined)
    assert silent <= (2 if FULL else 1)


@pytest.mark.full
def test_few_readings_do_not_choose_what_errors_are_the_same_in():
    """Four readings with errors that are a share: chance alone makes one size fit better in half of all."""
    omega = around(OMEGA[:1], 4)
    kinds = [fitted(omega, amplitudes(omega, AT_3), 0.02, s, stated=False).same for s in range(30)]
    assert sum(kind.startswith("size") for kind in kinds) <= 3


def test_phases_that_lag_are_noticed():
    omega = around(OMEGA[:1])
    result = fitted(omega, amplitudes(omega, AT_3).conj(), 0.01, 3)
    assert "phases must be leads" in result.undetermined[0]


def test_complex_modes_are_told_as_such():
    """Two near modes, a damper at one mass: eigenvalues of the first-order form, and phases far from 0."""
    K2, C2 = np.array([[1e4, -200.0], [-200.0, 1.026e4]]), np.diag([2.0, 0.1])
    omega = np.linspace(97, 103, 81)
    result = fitted(omega, amplitudes(omega, [1.0, 0.3], np.eye(2), K2, C2), 0.005, 1)
    values = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K2, -C2]]))
    values = values[values.imag > 0][np.argsort(np.abs(values[values.imag > 0]))]
    low, high = result.fit.estimate.ci95.T
    truth = np.concatenate([np.abs(values), -values.real / np.abs(values)])
    assert ((2 * low - high < truth) & (truth < 2 * high - low)).all()
    assert [words[:17] for words in result.warnings] == ["mode 1 is complex", "mode 2 is complex"]


@pytest.mark.parametrize(("gap", "stated"), [(1.001, True), (1.002, False), (1.004, True), (1.01, False)])
def test_two_modes_in_one_peak_are_not_taken_for_one(gap, stated):
    omega = np.linspace(98, 102, 81)
    Z = amplitudes(omega, [1.0, 1.0], np.eye(2), np.diag([1e4, 1e4 * gap]), 0.4 * np.eye(2))
    result = fitted(omega, Z, 0.01, 1, stated=stated)
    assert len(result.ends) == 1
    assert any("another mode is in the range" in words for words in result.warnings)


def test_a_node_of_a_mode_stays_readable(tmp_path):
    """A shape that is 0 within its error is written with the largest error that the table can hold."""
    K3 = np.array([[2e4, -1e4, 0], [-1e4, 2e4, -1e4], [0, -1e4, 2e4]])
    omega = around(undamped(np.eye(3), K3)[0][:2])
    result = fitted(omega, amplitudes(omega, [1.0, 0.2, 0.0], np.eye(3), K3, 4e-4 * K3), 0.02, 4)
    path, written = tmp_path / "modes.csv", result.file_table()
    path.write_bytes(csv(written))
    percent = written.columns[written.headings.index("frequency_std_percent")].values
    np.testing.assert_allclose(
        percent[::3], 100 * result.fit.estimate.std[:2] / result.fit.estimate.solution[:2]
    )
    read = read_modes(path)
    share, size = read.shape_std[1, 1], abs(read.shapes[1, 1])
    assert 0.3 < share <= 10
    assert share * size > 1e-3  # of 2 % of noise


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("frequency_Hz,X_amplitude\n1,2\n", "columns X_amplitude and X_phase_deg"),
        ("frequency_Hz,F_re\n1,2\n", "amplitudes of points"),
        ("frequency_Hz,F_re,X_re\n1,0,1\n", "a force F that is not 0"),
        ("frequency_Hz,X_re\n0,1\n", "a frequency above 0"),
        ("frequency_Hz,X_re,Y_re\n1,1,\n2,1,\n", "a number in at least one row"),
    ],
)
def test_tables_that_cannot_be_are_refused(tmp_path, cli, text, words):
    (tmp_path / "data.csv").write_text(text)
    outcome = cli("modes", tmp_path / "data.csv", "--excitation", "force")
    assert outcome.code == 2
    assert words in " ".join(outcome.err.split())


def test_names_of_modes_and_halves_of_errors_are_refused(tmp_path, cli):
    path = tmp_path / "modes.csv"
    path.write_text("mode,frequency_rad_s,node,shape\n1,12,X1,1\n1,12,Y2,1\n")
    outcome = cli("identify", TASK_7_1, path)
    assert outcome.code == 2
    assert "an amplitude of the model: X1, X2 or X3" in outcome.err
    outcome = cli("modes", sample_data() / "modes/amplitudes.csv", "--excitation", "force", "--errors", "1")
    assert outcome.code == 2
    assert "percent of an amplitude and degrees" in outcome.err


def test_one_wild_reading_of_a_sweep_is_no_mode():
    """Between two resonances: a peak that stands on one frequency, however well it is fitted."""
    omega, stiffness = np.linspace(60, 330, 60), np.array([[4e4, -2e4], [-2e4, 4e4]])
    Z = amplitudes(omega, [1.0, 0.3], np.eye(2), stiffness, 8e-5 * stiffness)
    for k in range(22, 30):
        noisy = Z * noise(0.01, Z, k)
        assert fitted(omega, noisy, 0.01).warnings == ()
        noisy[k, k % 2] *= 10
        (why,) = fitted(omega, noisy, 0.01).undetermined
        assert "mode 2 (" in why
        assert "stands on one frequency" in why


def test_probes_a_quarter_turn_apart_read_a_real_mode():
    """A forward whirl: y = −i x, and a third probe on the other side of the node."""
    omega = np.linspace(90, 110, 61)
    g = 1e-6 * omega**2 / (1e4 - omega**2 + 2j * 0.02 * 100 * omega)
    result = fitted(omega, np.outer(g, [1.0, -1j, 0.3, 0.3j]), 0.01, 3, load=omega**2)
    assert result.warnings == ()
    np.testing.assert_allclose(result.shapes[0], [1, 1, 0.3, -0.3], rtol=0.01)
    assert result.notes[0].startswith("mode 1 whirls: X2 and X4 a quarter turn from X1")
    skew = fitted(omega, np.outer(g, [1.0, -1j * np.exp(0.5j)]), 0.01, 3, load=omega**2)
    assert skew.warnings[0].startswith("mode 1 is complex")


def test_a_point_that_was_mostly_not_read_keeps_its_weights():
    """Of amplitudes in µm: what lacks says nothing about how large the others are."""
    omega = around(OMEGA, 25)
    Z = 1e-6 * amplitudes(omega, AT_3)
    Z = Z * noise(0.02, Z, 8)
    whole = fitted(omega, Z, 0.02)
    Z[np.arange(len(omega)) % 3 > 0, 0] = np.nan
    some = fitted(omega, Z, 0.02)
    assert some.warnings == ()
    ratio = some.shape_std[:, 0] / whole.shape_std[:, 0]
    assert ((ratio > 1.2) & (ratio < 2.5)).all()  # of a third of the readings
