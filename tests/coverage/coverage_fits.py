"""Do intervals of fits to records over time, and of modes from amplitudes, hold? Drawn data with known truth.

Run `python tests/coverage/coverage_fits.py [repetitions]`, of each line (1000). A record: x'' + d x' + k x,
k = 4, d = 0.4, unknown starts, 200 readings in 16 s with noise of 5 % of the first amplitude: white, each 0.8
of the one before and white noise, with an offset of half its size, or with hum of 1.5 times it. Modes: two of
5 % damping, 24 amplitudes around each resonance with errors of 2 % and 2° of each. *Cramér–Rao*: of the true
parameters by the true covariance of the noise.
"""

import sys

import numpy as np
from coverage_balance import percent
from scipy.linalg import solve_triangular, toeplitz

from balancing import Labels
from rotorid.identify.answers import SteadyAnswers
from rotorid.identify.fit_records import fit
from rotorid.identify.modes import fit_modes
from rotorid.identify.modes_result import Readings
from rotorid.identify.ode import ode_model
from rotorid.identify.records import Record
from rotorid.identify.simulation import simulate

NOISES = ("white", "in order", "offset", "hum")
TRUTH, TIMES, ERROR = np.array([4.0, 0.4, 1.0, 0.5]), np.linspace(0.0, 16.0, 200), 0.05
MODEL = ode_model(
    {"x": "v", "v": "-k*x - d*v"},
    initial={"x": "x0", "v": "v0"},
    outputs={"x": "x"},
    estimate=dict(zip(("k", "d", "x0", "v0"), (3.5, 0.3, 1.1, 0.6), strict=True)),
)
OMEGA, ZETA, LOAD, SHARE = np.array([100.0, 240.0]), 0.05, np.array([[1.0, 1.0], [0.8, -0.6]]), 0.02


def noise(rng, kind):
    """Of standard deviation 1, or besides, of the named kind."""
    white = rng.standard_normal(len(TIMES))
    if kind == "in order":
        return root_of_the_covariance() @ white
    turn = 11.0 * TIMES + 2 * np.pi * rng.random()
    return white + {"offset": 0.5, "hum": 1.5 * np.sin(turn)}.get(kind, 0.0)


def root_of_the_covariance():
    """Of noise whose neighbours are correlated by 0.8."""
    return np.linalg.cholesky(toeplitz(0.8 ** np.arange(len(TIMES))))


def one_record(rng, kind):
    """Errors of the parameters, their ±, those of Cramér and Rao, and warnings."""
    exact = simulate(MODEL, TRUTH, TIMES)
    made = fit(MODEL, Record(TIMES, {"x": exact.y[:, 0] + ERROR * noise(rng, kind)}))
    J = exact.y_theta[:, 0] / ERROR
    if kind == "in order":
        J = solve_triangular(root_of_the_covariance(), J, lower=True)
    bound = np.sqrt(np.diag(np.linalg.inv(J.T @ J)))
    return made.values - TRUTH, made.ci95, bound, made.warnings


def sweep(rng=None):
    """Modes fitted to amplitudes, exact or with errors."""
    w = np.concatenate([omega * (1 + 0.15 * np.linspace(-1, 1, 24)) for omega in OMEGA])
    exact = 1 / (OMEGA**2 - w[:, None] ** 2 + 2j * ZETA * OMEGA * w[:, None]) @ LOAD.T
    along, across = SHARE * rng.standard_normal((2, *exact.shape)) if rng else (0.0, 0.0)
    read = exact * (1 + along) * np.exp(1j * across)
    readings = Readings(
        "", None, w, ("A", "B"), read, labels=Labels(speed_unit="rad_s"), shares=(SHARE, SHARE)
    )
    return fit_modes(readings, SteadyAnswers(w, np.ones(len(w), dtype=complex)))


def modes(rng, bound):
    """The same of modes, `bound` of exact amplitudes."""
    made = sweep(rng)
    estimate = made.fit.estimate
    return estimate.solution - np.concatenate((OMEGA, [ZETA, ZETA])), estimate.ci95, bound, made.warnings


def line(name, drawn):
    """Shares of intervals that hold, median ± over that of Cramér and Rao: without a warning, with one."""
    shares = ""
    for warned in (False, True):
        some = [one for one in drawn if bool(one[3]) == warned]
        given = [(error, ci, bound) for error, ci, bound, _ in some if ci is not None]
        half = [np.ptp(ci, axis=1) / 2 for _, ci, _ in given]
        holds = [abs(error) <= reach for (error, *_), reach in zip(given, half, strict=True)]
        ratios = [reach / (1.96 * bound) for (*_, bound), reach in zip(given, half, strict=True)]
        ratio = f"{np.median(ratios):.2f}" if given else "–"
        shares += f"{percent(holds):>9}{ratio:>8}{len(given):6d}{len(some) - len(given):6d}"
    return f"{name:<24}{shares}"


def main(repetitions=1000):
    """Print the table."""
    print(f"{'':<24}{'silent: hold':>14}{'±/C–R':>7}{'of':>4}{'none':>6}{'warned: hold':>14}")
    for k, kind in enumerate(NOISES):
        rng = np.random.default_rng([51, k])
        print(line(f"record, {kind}", [one_record(rng, kind) for _ in range(repetitions)]), flush=True)
    rng, bound = np.random.default_rng(52), sweep().fit.estimate.std
    print(line("modes", [modes(rng, bound) for _ in range(repetitions)]))


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
