"""Another model of the same readings: AIC and F, by hand and over draws where the smaller model holds."""

import numpy as np
import pytest
from harmonic_cases import simulate, two_masses

from rotorid.identify import AmplitudeErrors, experiments, harmonic_model, identify
from rotorid.identify.structures import compare_structures
from rotorid.samples import sample_data

TASK = sample_data() / "identify" / "task_5_1"
ONE = ["(m*p**2 + alpha*p + c)*X = F"]
ERRORS = AmplitudeErrors(0.02, 0.02)


def pair(X, w, stated):
    small = harmonic_model(ONE, known={"m": 10.0}, estimate=["c", "alpha"])
    large = harmonic_model(ONE, estimate=["c", "alpha", "m"])
    data = [experiments(m, w, {"F": 10.0, "X": X}, errors=ERRORS if stated else None) for m in (small, large)]
    return [identify(m, d) for m, d in zip((small, large), data, strict=True)]


@pytest.mark.parametrize("stated", [True, False])
def test_by_hand(stated):
    """Misfits of relative residuals at the larger model's amplitudes, minimised by a plain search."""
    from scipy.optimize import minimize
    from scipy.stats import f

    w, X = (
        np.array([8.0, 11.0, 20.0, 30.0]),
        np.array([0.026 - 0.006j, -0.04 - 0.022j, -3.3e-3 - 2.3e-4j, -1.2e-3 - 4e-5j]),
    )
    fits = pair(X, w, stated)
    size = np.abs(fits[1].predicted["X"]) * (0.02 if stated else 1.0)

    def least(mass, n):
        def misfit(v):
            m = v[2] * 10 if n == 3 else mass
            Z = 10 / (v[0] * 1000 - m * w**2 + 1j * v[1] * 10 * w)
            return np.sum(np.abs((Z - X) / size) ** 2)

        begin = [
            fits[n - 2].values[0] / 1000,
            fits[n - 2].values[1] / 10,
            *([fits[1].values[2] / 10] * (n == 3)),
        ]
        return minimize(
            misfit, begin, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12, "maxiter": 4000}
        ).fun

    a, b = least(10.0, 2), least(None, 3)
    found = compare_structures(*fits)
    assert pytest.approx((a - b) / (b / 5), rel=1e-4) == found.F
    assert found.chance == pytest.approx(f.sf(found.F, 1, 5), rel=1e-6)
    expected = a - b - 2 if stated else 8 * np.log(a / b) - 2
    assert found.delta_aic == pytest.approx(expected, rel=1e-4)
    assert compare_structures(*fits[::-1]).delta_aic == pytest.approx(-expected, rel=1e-4)


def test_chance_is_even_where_the_smaller_model_holds():
    model, truth, w, inputs = two_masses()
    small = harmonic_model(model.equations, known={**model.known, "a": -15.0}, estimate=["a1", "a2"])
    rng, chances = np.random.default_rng(5), []
    for _ in range(60):
        data = simulate(model, truth, w, inputs, ERRORS, rng, stated=ERRORS)
        chances.append(compare_structures(identify(small, data), identify(model, data)).chance)
    assert abs(np.mean(chances) - 0.5) < 4 * np.sqrt(1 / 12 / 60)
    assert 0.02 < np.mean(np.array(chances) < 0.25) < 0.48


def test_models_of_other_readings_are_refused(cli, tmp_path):
    (tmp_path / "other.toml").write_text('equations = ["(10*p**2 + c)*Y = F"]\nestimate = ["c"]\n')
    done = cli("identify", TASK / "model.toml", TASK / "data.csv", "--against", tmp_path / "other.toml")
    assert done.code == 2
    (tmp_path / "mass.toml").write_text(
        f"equations = {ONE}\nestimate = ['c', 'alpha', 'm']\n".replace("'(", '"(').replace("F'", 'F"')
    )
    options = ("--amplitude-error", 2, "--phase-error", 1, "--json")
    found = cli(
        "identify", TASK / "model.toml", TASK / "data.csv", *options, "--against", tmp_path / "mass.toml"
    ).json
    assert found["against"]["F"] == pytest.approx(5.276, abs=1e-3)
    assert found["against"]["freedom"] == [1, 3]
