"""Do the intervals of a run-up's critical speeds and damping hold the truth? Drawn rotors of two modes.

Run `python tests/coverage/coverage_runup.py [seed] [rotors]`, rotors at each acceleration (1 and 500).

A rotor has critical speeds of 900 to 1500 rpm and 1.7 to 2.4 times that, damping of 1 to 5 %, and unbalance
of both modes at angles of their own. It runs up from 300 rpm to 1.25 times its second critical speed, or
down, and 150 vectors of two sensors are read at uneven times, with an error of 1 µm in each direction, on
run-out of 5 µm; speeds are written to 0.1 rpm. The vectors are exact: z'' + 2ζω z' + ω² z = −(e^{iθ})'' has
for a constant acceleration a closed form with the error function of a complex number.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import wofz

from balancing import Labels
from rotorid.identify.modes import fit_sweep
from rotorid.identify.modes_result import Readings

RPM = np.pi / 30
ACCELERATIONS = (20.0, 60.0, 180.0, -60.0)
"""rpm a second."""
NOISE, RUN_OUT, VECTORS = 1e-6, 5e-6, 150
NORMAL = 1.96


class Rotor(NamedTuple):
    """ω and ζ of its modes (2,), what each moves of each sensor (2, C), and run-out (C,)."""

    omega: NDArray[np.float64]
    zeta: NDArray[np.float64]
    moved: NDArray[np.complex128]
    run_out: NDArray[np.complex128]


class Outcome(NamedTuple):
    """Errors of ω and ζ over their standard deviations, relative ones of a steady fit, (4,); warnings.

    NaN where there is not one value for each.
    """

    errors: NDArray[np.float64]
    steady: NDArray[np.float64]
    words: tuple[str, ...]


def draw_rotor(random: np.random.Generator) -> Rotor:
    """Draw one."""
    first = random.uniform(900, 1500) * RPM
    shapes = np.array([[1.0, random.uniform(0.4, 1.0)], [1.0, -random.uniform(0.4, 1.0)]])
    unbalance = random.uniform(5e-6, 15e-6, 2) * np.exp(2j * np.pi * random.uniform(size=2))
    run_out = RUN_OUT * random.standard_normal((2, 2)) @ (1, 1j)
    omega = np.array([first, first * random.uniform(1.7, 2.4)])
    return Rotor(omega, random.uniform(0.01, 0.05, 2), unbalance[:, None] * shapes, run_out)


def swept(
    omega: float, zeta: float, first: float, rate: float, time: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Vectors (n,) of one mode under unit unbalance, from steady motion at the first speed, at times from 0.

    With E = e^{iθ}, z_s' = s z_s − E'' is met by z_s = −E' − s E + y, y' = s y − s² E, and by
    y = −s² E √(π / (−2iα)) w(−i u), u = √(−iα/2) (Ω + i s) / α, plus a free motion.
    """
    s = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
    z0 = first**2 / (omega**2 - first**2 + 2j * zeta * omega * first)

    def forced(pole: complex, t: NDArray[np.float64]) -> NDArray[np.complex128]:
        speed, E = first + rate * t, np.exp(1j * (first * t + rate * t**2 / 2))
        u = np.sqrt(-0.5j * rate) * (speed + 1j * pole) / rate
        return np.asarray(
            -(1j * speed + pole) * E - pole**2 * E * np.sqrt(np.pi / (-2j * rate)) * wofz(-1j * u)
        )

    def first_order(pole: complex, start: complex) -> NDArray[np.complex128]:
        free = start - forced(pole, np.zeros(1))
        return np.asarray(forced(pole, time) + np.exp(pole * time) * free)

    # z_s = z' − s̄ z
    both = [first_order(pole, (1j * first - np.conj(pole)) * z0) for pole in (s, np.conj(s))]
    return np.asarray((both[0] - both[1]) / (2j * s.imag) * np.exp(-1j * (first * time + rate * time**2 / 2)))


def draw_sweep(random: np.random.Generator, rotor: Rotor, rate: float, noise: float = NOISE) -> Readings:
    """Read a run-up, or a run-down, of a rotor; rate in rad/s²; without noise speeds are exact, too."""
    ends = 300 * RPM, 1.25 * float(rotor.omega[1])
    first = ends[0] if rate > 0 else ends[1]
    time = np.sort(random.uniform(0, (ends[1] - ends[0]) / abs(rate), VECTORS))
    time -= time[0]
    answers = [swept(*mode, first, rate, time) for mode in zip(rotor.omega, rotor.zeta, strict=True)]
    exact = np.transpose(answers) @ rotor.moved + rotor.run_out
    errors = random.standard_normal((*exact.shape, 2)) @ (1, 1j)
    speeds = first + rate * time
    if noise:
        speeds = np.round(speeds / RPM, 1) * RPM
    covariances = np.broadcast_to((noise or NOISE) ** 2 * np.eye(2), (*exact.shape, 2, 2))
    return Readings("run-up", time, speeds, ("A", "B"), exact + noise * errors, covariances, Labels())


def one_rotor(random: np.random.Generator, rate: float) -> Outcome:
    """Draw a rotor and its sweep, rpm a second, and fit it."""
    rotor = draw_rotor(random)
    truth = np.concatenate((rotor.omega, rotor.zeta))
    modes = fit_sweep(draw_sweep(random, rotor, rate * RPM))
    found, std = modes.fit.estimate.solution, modes.fit.estimate.std
    if len(found) != len(truth) or std is None or modes.steady is None:
        return Outcome(np.full(4, np.nan), np.full(4, np.nan), modes.warnings)
    steady = modes.steady.fit.estimate.solution / truth - 1
    return Outcome((found - truth) / std, steady, modes.warnings)


def simulate(rotors: int, seed: int, rate: float) -> list[Outcome]:
    """So many rotors at an acceleration."""
    key = [seed, ACCELERATIONS.index(rate)]
    return [one_rotor(np.random.default_rng([*key, k]), rate) for k in range(rotors)]


def line(rate: float, word: str, found: Sequence[Outcome]) -> str:
    """Shares of intervals that hold the truth, and the median of the steady fit's bias."""
    if not found:
        return f"{rate:5.0f} {word:<8}{0:5d}"
    held = [abs(one.errors) < NORMAL for one in found]  # no value holds nothing
    shares = "".join(f"{100 * share:8.1f}" for share in np.mean(held, axis=0))
    bias = "".join(f"{100 * off:9.2f}" for off in np.nanmedian([one.steady for one in found], axis=0))
    return f"{rate:5.0f} {word:<8}{len(found):5d}{shares}  {bias}"


def main(seed: int = 1, rotors: int = 500) -> None:
    """Print the table."""
    print(f"{'':<19}{'95 % intervals that hold, %':>32}  {'bias of the steady fit, %':>36}")
    print(f"{'rpm/s':<19}{'ω1':>8}{'ω2':>8}{'ζ1':>8}{'ζ2':>8}  {'ω1':>9}{'ω2':>9}{'ζ1':>9}{'ζ2':>9}")
    for rate in ACCELERATIONS:
        found = simulate(rotors, seed, rate)
        for said, word in ((False, "silent"), (True, "warned")):
            print(line(rate, word, [one for one in found if bool(one.words) == said]), flush=True)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
