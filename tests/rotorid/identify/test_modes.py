"""Modes from amplitudes: against closed forms and drawn readings, and what is said where they do not tell."""

import numpy as np
import pytest
from repetitions import FULL
from scipy.linalg import eigh

from balancing import Labels
from rotorid.base.tables import csv
from rotorid.commands.modes import ModesOptions, modes
from rotorid.files.node_tables import read_modes
from rotorid.identify.answers import SteadyAnswers
from rotorid.identify.modes import fit_modes
from rotorid.identify.modes_result import Readings
from rotorid.samples import sample_data

M = np.diag([20.0, 20.0, 10.0])
K = np.array([[3e4, -2e4, 0.0], [-2e4, 2.5e4, -5e3], [0.0, -5e3, 5e3]])
TASK_7_1 = sample_data() / "identify" / "task_7_1" / "model.toml"
TRUTH = {"c1": 1e4, "c2": 2e4, "c3": 5e3}


def undamped(M, K):
    """Natural frequencies, and shapes with 1 at the first mass."""
    squares, shapes = eigh(K, M)
    return np.sqrt(squares), shapes / shapes[0]


def around(centres, damping, readings=9, widths=3.0):
    """Frequencies around resonances, so many half-power widths to each side."""
    steps = np.linspace(-widths, widths, readings)
    return np.concatenate([w * (1 + z * steps) for w, z in zip(centres, damping, strict=True)])


def amplitudes(omega, M, C, K, force):
    """By the dynamic stiffness, frequency by frequency."""
    return np.array([np.linalg.solve(K - w**2 * M + 1j * w * C, force) for w in omega])


def measured(omega, Z, errors=None, drawn=None):
    """Experiments, with errors drawn along and across each amplitude."""
    if drawn is not None:
        rng, share = drawn
        Z = Z * (1 + share * (rng.standard_normal(Z.shape) + 1j * rng.standard_normal(Z.shape)))
    names = tuple(f"X{i}" for i in range(1, 1 + Z.shape[1]))
    return Readings("", None, omega, names, Z, labels=Labels(speed_unit="rad_s"), shares=errors)


def fitted(omega, readings, bands=None):
    answers = SteadyAnswers(omega, np.ones(len(omega), dtype=complex))
    return fit_modes(readings, answers, bands)


def found(result):
    """Frequencies and damping, standard deviations and 95 % intervals, each (2, k)."""
    low, high = result.fit.ci95.T.reshape(2, 2, -1)
    return result.fit.estimate.solution.reshape(2, -1), result.fit.std.reshape(2, -1), low, high


def chain(masses, springs):
    return np.diag(masses), np.diag(springs + np.append(springs[1:], 0.0)) - sum(
        np.diag(springs[1:], side) for side in (1, -1)
    )


def test_exact_amplitudes_give_the_exact_modes():
    omega0, shapes = undamped(M, K)
    damping = 2e-4 * omega0  # C = 4e-4 K
    omega = around(omega0, damping)
    result = fitted(omega, measured(omega, amplitudes(omega, M, 4e-4 * K, K, [0.0, 0.0, 1.0])))
    frequency, zeta = result.fit.estimate.solution.reshape(2, -1)
    np.testing.assert_allclose(frequency, omega0, rtol=1e-9)
    np.testing.assert_allclose(zeta, damping, rtol=1e-7)
    np.testing.assert_allclose(result.shapes, shapes.T, rtol=1e-7)
    assert result.warnings == ()


def test_modes_beyond_the_range_hardly_bias_those_in_it():
    M5, K5 = chain(np.array([10.0, 15.0, 8.0, 12.0, 20.0]), np.array([2e4, 1.5e4, 1e4, 2e4, 1.2e4]))
    omega0, shapes = undamped(M5, K5)
    damping = 1e-4 * omega0
    omega = around(omega0[1:2], damping[1:2], 15)
    result = fitted(omega, measured(omega, amplitudes(omega, M5, 2e-4 * K5, K5, np.eye(5)[0])))
    frequency, zeta = result.fit.estimate.solution
    assert frequency == pytest.approx(omega0[1], rel=1e-7)
    assert zeta == pytest.approx(damping[1], rel=1e-3)
    np.testing.assert_allclose(result.shapes[0], shapes[:, 1], rtol=2e-3)


@pytest.mark.full
def test_a_chain_is_identified_from_its_modes_within_the_intervals(tmp_path, cli):
    """Lesson 7 whole: amplitudes around resonances, modes, stiffnesses; 40 drawn tests."""
    from rotorid.commands.identify import identify
    from rotorid.files import read_harmonic_model, read_measurements

    omega0, _ = undamped(M, K)
    omega = around(omega0, 2e-4 * omega0)
    exact = amplitudes(omega, M, 4e-4 * K, K, [0.0, 0.0, 1.0])
    rng, held, file = np.random.default_rng(5), 0, read_harmonic_model(TASK_7_1)
    for _ in range(40):
        experiments = measured(omega, exact, (0.02, 0.02), (rng, 0.02))
        path = tmp_path / "modes.csv"
        path.write_bytes(csv(fitted(omega, experiments).file_table()))
        result = identify(file, read_measurements(path, file)).result
        held += sum(
            low <= TRUTH[n] <= high for n, (low, high) in zip(result.parameters, result.ci95, strict=True)
        )
    assert abs(held / 120 - 0.95) < 4 * np.sqrt(0.95 * 0.05 / 120)
    output = cli("identify", TASK_7_1, path, "--json").json["parameters"]
    for name, value, std in zip(result.parameters, result.values, result.std, strict=True):
        assert output[name]["value"] == pytest.approx(value, abs=0.05 * std)
        assert output[name]["std"] == pytest.approx(std, rel=0.05)  # the error of the reference counts, too


def test_a_velocity_under_a_given_force_is_the_same_mode(tmp_path):
    omega0, shapes = undamped(M, K)
    omega = around(omega0, 2e-4 * omega0)
    force = np.linspace(5, 20, len(omega)) * np.exp(0.7j)
    Z = amplitudes(omega, M, 4e-4 * K, K, [1.0, 0.0, 0.0]) * force[:, None]
    rows = ["frequency_Hz,F_re,F_im,X1_re,X1_im,X2_re_mm_s,X2_im_mm_s,X3_re_um_pp,X3_im_um_pp"]
    for w, f, (x1, x2, x3) in zip(omega, force, Z, strict=True):
        z = (w / 2 / np.pi, f.real, f.imag, x1, 1e3j * w * x2, 2e6 * x3)
        rows.append(
            ",".join(str(part) for x in z[:3] for part in [x])
            + ","
            + ",".join(f"{x.real},{x.imag}" for x in z[3:])
        )
    path = tmp_path / "data.csv"
    path.write_text("\n".join(rows))
    result = modes(path, ModesOptions(excitation="force"))
    np.testing.assert_allclose(result.result.shapes, shapes.T, rtol=1e-6)
    np.testing.assert_allclose(result.result.values[0], omega0, rtol=1e-8)
    assert result.answer.judgement.endswith("Hz.")


def near_one(omega=None, C=4e-4 * K, share=0.0, seed=3, bands=None, conjugate=False):
    """The first resonance of the chain."""
    omega0, _ = undamped(M, K)
    omega = around(omega0[:1], 2e-4 * omega0[:1]) if omega is None else omega
    Z = amplitudes(omega, M, C, K, [0.0, 0.0, 1.0])
    drawn = (np.random.default_rng(seed), share) if share else None
    errors = (share, share) if share else None
    return fitted(omega, measured(omega, Z.conj() if conjugate else Z, errors, drawn), bands)


def test_a_resonance_read_on_one_side_is_not_told():
    omega0 = undamped(M, K)[0][0]
    with pytest.raises(ValueError, match="both sides"):
        near_one(np.linspace(0.9, 0.999, 12) * omega0)
    result = near_one(np.linspace(0.9, 0.99, 12) * omega0, share=0.02, bands=[(0.8 * omega0, 1.2 * omega0)])
    assert result.undetermined
    assert result.to_dict()["modes"] == []
    assert result.to_dict()["parameters"]["ω1"]["value"] is None
    with pytest.raises(ValueError, match="no table of modes"):
        result.file_table()


def test_too_few_readings_are_refused():
    omega0, _ = undamped(M, K)
    with pytest.raises(ValueError, match="too few readings"):
        near_one(omega0[0] * (1 + 2e-3 * np.array([-1, 0, 1])), bands=[(0.0, 20.0)])
    band = [(0.9 * omega0[0], 1.1 * omega0[0])]
    with pytest.raises(ValueError, match="3 frequencies"):
        near_one(np.repeat(omega0[0] * np.array([0.999, 1.001]), 6), share=0.01, bands=band)
    thrice = near_one(np.repeat(omega0[0] * np.array([0.998, 1.0, 1.002]), 4), share=0.01, bands=band)
    assert "do not tell" in thrice.undetermined[0]
    with pytest.raises(ValueError, match="no readings in --bands"):
        near_one(bands=[(1.0, 2.0)])
    with pytest.raises(ValueError, match="--bands overlap"):
        near_one(bands=[(10.0, 14.0), (11.0, 14.0)])


def test_readings_that_lack_are_left_out():
    """Rows in any order, one of them blank, one blank at one point: the exact modes all the same."""
    omega0, shapes = undamped(M, K)
    omega = np.random.default_rng(6).permutation(around(omega0, 2e-4 * omega0))
    Z = amplitudes(omega, M, 4e-4 * K, K, [0.0, 0.0, 1.0])
    Z[3], Z[5, 1] = np.nan, np.nan
    result = fitted(omega, measured(omega, Z))
    np.testing.assert_allclose(result.fit.values[:3], omega0, rtol=1e-9)
    np.testing.assert_allclose(result.shapes, shapes.T, rtol=1e-7)


@pytest.mark.full
def test_peaks_of_noise_are_no_modes():
    """Run-ups under unbalance with an error of one size: over ω², low speeds show peaks of noise."""
    omega, told = np.linspace(10, 110, 100), 0
    stiffness = np.array([[1e4, -200.0], [-200.0, 4e4]])
    Z = amplitudes(omega, np.eye(2), 2 * np.eye(2), stiffness, [1.0, 0.5]) * omega[:, None] ** 2
    rng = np.random.default_rng(0)
    for _ in range(6 if FULL else 3):
        noise = rng.standard_normal(Z.shape) + 1j * rng.standard_normal(Z.shape)
        experiments = measured(omega, Z + 5e-3 * np.abs(Z).max(axis=0) * noise)
        result = fit_modes(experiments, SteadyAnswers(omega, omega**2 + 0j))
        assert len(result.ends) > 1
        assert result.warnings
        told += any("no more than noise" in words for words in result.undetermined)
    assert told >= (4 if FULL else 2)


@pytest.mark.full
def test_few_readings_do_not_choose_what_errors_are_the_same_in():
    """Four readings with errors that are a share: chance alone makes one size fit better in half of all."""
    omega0, _ = undamped(M, K)
    omega, rng = around(omega0[:1], 2e-4 * omega0[:1], 4), np.random.default_rng(0)
    exact = amplitudes(omega, M, 4e-4 * K, K, [0.0, 0.0, 1.0])
    kinds = [fitted(omega, measured(omega, exact, None, (rng, 0.02))).same for _ in range(30)]
    assert sum(kind.startswith("size") for kind in kinds) <= 3


def test_phases_that_lag_are_found_out():
    result = near_one(share=0.01, conjugate=True)
    assert "phases must be leads" in result.undetermined[0]


def test_complex_modes_are_told_as_such():
    """Two near modes, a damper at one mass: eigenvalues of the first-order form, and phases far from 0."""
    K2, C2 = np.array([[1e4, -200.0], [-200.0, 1.026e4]]), np.diag([2.0, 0.1])
    omega = np.linspace(97, 103, 81)
    Z = amplitudes(omega, np.eye(2), C2, K2, [1.0, 0.3])
    result = fitted(omega, measured(omega, Z, (0.005, 0.005), (np.random.default_rng(1), 0.005)))
    values = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-K2, -C2]]))
    values = values[values.imag > 0][np.argsort(np.abs(values[values.imag > 0]))]
    _, _, low, high = found(result)
    truth = np.array([np.abs(values), -values.real / np.abs(values)])
    assert ((2 * low - high < truth) & (truth < 2 * high - low)).all()
    assert [words[:17] for words in result.warnings] == ["mode 1 is complex", "mode 2 is complex"]


@pytest.mark.parametrize("gap", [1.001, 1.002, 1.004, 1.01])
@pytest.mark.parametrize("errors", [(0.01, 0.01), None])
def test_two_modes_in_one_peak_are_not_taken_for_one(gap, errors):
    omega = np.linspace(98, 102, 81)
    Z = amplitudes(omega, np.eye(2), 0.4 * np.eye(2), np.diag([1e4, 1e4 * gap]), [1.0, 1.0])
    result = fitted(omega, measured(omega, Z, errors, (np.random.default_rng(1), 0.01)))
    assert len(result.ends) == 1
    assert any("another mode is in the range" in words for words in result.warnings)


def test_a_node_of_a_mode_stays_readable(tmp_path):
    """A shape that is 0 within its error is written with the largest error that the table can hold."""
    M3, K3 = np.eye(3), np.array([[2e4, -1e4, 0], [-1e4, 2e4, -1e4], [0, -1e4, 2e4]])
    omega0 = undamped(M3, K3)[0]
    omega = around(omega0[:2], 2e-4 * omega0[:2])
    Z = amplitudes(omega, M3, 4e-4 * K3, K3, [1.0, 0.2, 0.0])
    result = fitted(omega, measured(omega, Z, (0.02, 0.02), (np.random.default_rng(4), 0.02)))
    path, table = tmp_path / "modes.csv", result.file_table()
    path.write_bytes(csv(table))
    percent = table.columns[table.headings.index("frequency_std_percent")].values
    read = read_modes(path)
    of_frequency = result.fit.std[:2] / result.fit.estimate.solution[:2]
    np.testing.assert_allclose(percent[::3], 100 * of_frequency)
    assert 0.3 < read.shape_std[1, 1] <= 10
    assert abs(read.shapes[1, 1]) < 4 * read.shape_std[1, 1] * abs(read.shapes[1, 1])
    assert read.shape_std[1, 1] * abs(read.shapes[1, 1]) > 1e-3  # of 2 % of noise


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
    path = tmp_path / "data.csv"
    path.write_text(text)
    outcome = cli("modes", path, "--excitation", "force")
    assert outcome.code == 2
    assert words in " ".join(outcome.err.split())


def test_a_table_of_modes_needs_the_names_of_the_model(tmp_path, cli):
    path = tmp_path / "modes.csv"
    path.write_text("mode,frequency_rad_s,node,shape\n1,12,X1,1\n1,12,Y2,1\n")
    outcome = cli("identify", TASK_7_1, path)
    assert outcome.code == 2
    assert "an amplitude of the model: X1, X2 or X3" in outcome.err


def test_one_stated_error_needs_the_other(cli):
    outcome = cli(
        "modes", sample_data() / "modes" / "amplitudes.csv", "--excitation", "force", "--errors", "1"
    )
    assert outcome.code == 2
    assert "percent of an amplitude and degrees" in outcome.err


def test_one_wild_reading_of_a_sweep_is_no_mode():
    """Between two resonances: a peak that stands on one frequency, however well it is fitted."""
    omega = np.linspace(60, 330, 60)
    stiffness = np.array([[4e4, -2e4], [-2e4, 4e4]])
    Z = amplitudes(omega, np.eye(2), 8e-5 * stiffness, stiffness, [1.0, 0.3])
    rng = np.random.default_rng(4)
    errors = (0.01, 0.01)
    for k in range(22, 30):
        noisy = measured(omega, Z, errors, (rng, 0.01)).vectors
        assert fitted(omega, measured(omega, noisy, errors)).warnings == ()
        noisy[k, k % 2] *= 10
        (why,) = fitted(omega, measured(omega, noisy, errors)).undetermined
        assert "mode 2 (" in why
        assert "stands on one frequency" in why


def test_columns_of_a_force_say_what_excites(tmp_path, cli):
    omega0, _ = undamped(M, K)
    omega = around(omega0, 2e-4 * omega0)
    Z = amplitudes(omega, M, 4e-4 * K, K, [0.0, 0.0, 1.0])[:, 0]
    rows = [f"{w},1,0,{z.real},{z.imag}" for w, z in zip(omega, Z, strict=True)]
    path = tmp_path / "data.csv"
    path.write_text("\n".join(["frequency_rad_s,F_re,F_im,X_re,X_im", *rows]))
    found = cli("modes", path, "--json").json
    assert found == cli("modes", path, "--excitation", "force", "--json").json | {
        "provenance": found["provenance"]
    }
    path.write_text("\n".join(["frequency_rad_s,X_re,X_im", *(row.replace(",1,0", "") for row in rows)]))
    refused = cli("modes", path)
    assert refused.code == 2
    assert "--excitation force or unbalance" in refused.err


def test_probes_a_quarter_turn_apart_read_a_real_mode():
    """A forward whirl: y = −i x, and a third probe on the other side of the node."""
    omega = np.linspace(90, 110, 61)
    g = omega**2 / (1e4 - omega**2 + 2j * 0.02 * 100 * omega)
    Z = np.outer(g, [1.0, -1j, 0.3, 0.3j]) * 1e-6
    noise = np.random.default_rng(3).standard_normal((*Z.shape, 2)) @ (1, 1j)
    readings = Readings("", None, omega, ("X", "Y", "U", "V"), Z * (1 + 0.01 * noise), shares=(0.01, 0.01))
    result = fit_modes(readings, SteadyAnswers(omega, omega**2 + 0j))
    assert result.warnings == ()
    np.testing.assert_allclose(result.shapes[0], [1, 1, 0.3, -0.3], rtol=0.01)
    assert result.notes[0].startswith("mode 1 whirls: Y and V a quarter turn from X")
    skew = fit_modes(
        Readings("", None, omega, ("X", "Y"), Z[:, :2] * [1.0, np.exp(0.5j)] * (1 + 0.01 * noise[:, :2]),
                 shares=(0.01, 0.01)),
        SteadyAnswers(omega, omega**2 + 0j),
    )  # fmt: skip
    assert skew.warnings[0].startswith("mode 1 is complex")


def test_a_point_that_was_mostly_not_read_keeps_its_weights():
    """Of amplitudes in µm: what lacks says nothing about how large the others are."""
    omega0, _ = undamped(M, K)
    omega = around(omega0, 2e-4 * omega0, 25)
    Z = 1e-6 * amplitudes(omega, M, 4e-4 * K, K, [0.0, 0.0, 1.0])
    rng = np.random.default_rng(8)
    Z = Z * (1 + 0.02 * (rng.standard_normal(Z.shape) + 1j * rng.standard_normal(Z.shape)))
    whole = fitted(omega, measured(omega, Z, (0.02, 0.02)))
    Z[np.arange(len(omega)) % 3 > 0, 0] = np.nan
    some = fitted(omega, measured(omega, Z, (0.02, 0.02)))
    assert some.warnings == ()
    ratio = some.shape_std[:, 0] / whole.shape_std[:, 0]
    assert (ratio > 1.2).all()
    assert (ratio < 2.5).all()  # of a third of the readings
