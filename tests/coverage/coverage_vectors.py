"""How exact the vectors of a run-up are: `python tests/coverage/coverage_vectors.py [SEEDS]`.

A drawn record of 60 s at 5,120 samples a second: 600 → 3,600 rpm, one mode at 1,800 rpm with a damping
ratio of 0.03, a run-out of 5 µm, 1.5 µm of 2×, noise of 1 µm, a tacho that is high for 5 % of a turn; without
and with a ripple of ± 0.5 % of the speed at 0.5 Hz. The exact vector is the oscillator's answer to the
accelerated unbalance, integrated by DOP853. Errors are relative to its largest size, from 2 to 58 s; the
phase offset is the angle between all exact and all found vectors; coverage counts the components along and
across a vector that lie within 1.96 of their stated standard deviations.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy.integrate import solve_ivp

from rotorid.waveforms.record import Channel, TachoSettings, WaveformRecord
from rotorid.waveforms.vectors import find_vectors

RATE, SECONDS, MARK = 5120.0, 60.0, 0.05
FIRST, LAST, CRITICAL, DAMPING = 10.0, 60.0, 30.0, 0.03
ECCENTRICITY, RUN_OUT, TWICE, NOISE = 6e-6, 5e-6 * np.exp(0.7j), 1.5e-6, 1e-6
RIPPLE_FREQUENCY, RIPPLE = 0.5, 0.005
Array = np.ndarray


@dataclass(frozen=True)
class Machine:
    """A run-up: turns and speed (turns per s) over time, and the exact vector of 1×."""

    turns: Callable[[Array], Array]
    speed: Callable[[Array], Array]
    vector: Callable[[Array], Array]


def machine(ripple: float = 0.0, last: float = LAST, seconds: float = SECONDS) -> Machine:
    """The run-up with a ripple, a share of the speed."""
    w, p, a = 2 * np.pi * CRITICAL, 2 * np.pi * RIPPLE_FREQUENCY, (last - FIRST) / seconds

    def speed(t: Array) -> Array:
        return (FIRST + a * t) * (1 + ripple * np.sin(p * t))

    def turns(t: Array) -> Array:
        wave = FIRST * (1 - np.cos(p * t)) / p + a * (np.sin(p * t) / p - t * np.cos(p * t)) / p
        return FIRST * t + a * t**2 / 2 + ripple * wave

    def change(t: float, y: Array) -> list[complex]:
        omega = 2 * np.pi * speed(t)
        rate = 2 * np.pi * (a * (1 + ripple * np.sin(p * t)) + (FIRST + a * t) * ripple * p * np.cos(p * t))
        stiff = w**2 - omega**2 + 1j * rate + 2j * DAMPING * w * omega
        force = ECCENTRICITY * (omega**2 - 1j * rate)
        return [y[1], force - 2 * (DAMPING * w + 1j * omega) * y[1] - stiff * y[0]]

    omega = 2 * np.pi * FIRST
    start = ECCENTRICITY * omega**2 / (w**2 - omega**2 + 2j * DAMPING * w * omega)
    found = solve_ivp(change, (0, seconds), [start, 0j], "DOP853", dense_output=True, rtol=1e-9, atol=1e-15)
    return Machine(turns, speed, lambda t: found.sol(t)[0] + RUN_OUT)


def record(run: Machine, seed: int, seconds: float = SECONDS) -> WaveformRecord:
    """What a tacho and a sensor read of it."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(RATE * seconds)) / RATE
    turns = run.turns(t) + rng.uniform()
    x = (run.vector(t) * np.exp(2j * np.pi * turns)).real + TWICE * np.cos(4 * np.pi * turns + 0.3)
    x += NOISE * rng.standard_normal(len(t))
    pulse = np.where(turns % 1 < MARK, 5.0, 0.0)
    return WaveformRecord("run", f"seed {seed}", RATE, Channel("tacho", pulse), (Channel("A", x),))


@dataclass(frozen=True)
class Errors:
    """Of vectors: in per cent of the peak inside and at the ends; offset in degrees."""

    rms: float
    largest: float
    ends: float
    offset: float


def errors(run: Machine, times: Array, vector: Array, seconds: float = SECONDS) -> Errors:
    """Of vectors at these times."""
    exact = run.vector(times)
    error = abs(vector - exact) / peak(run, seconds) * 100
    inside = (times > 2) & (times < seconds - 2)
    return Errors(
        rms=float(np.sqrt(np.mean(error[inside] ** 2))),
        largest=float(error[inside].max()),
        ends=float(error[~inside].max()),
        offset=float(np.degrees(np.angle(np.vdot(exact[inside], vector[inside])))),
    )


def peak(run: Machine, seconds: float = SECONDS) -> float:
    """Largest size of the exact vector."""
    return float(abs(run.vector(np.linspace(0, seconds, 5000))).max())


@dataclass(frozen=True)
class Accuracy(Errors):
    """Of one record: coverage, and s, besides."""

    along: float
    across: float
    seconds: float


def accuracy(run: Machine, seed: int, seconds: float = SECONDS) -> Accuracy:
    """Of the vectors of one record."""
    measured = record(run, seed, seconds)
    begun = time.process_time()
    found = find_vectors(measured, TachoSettings(), (1, 2))
    took = time.process_time() - begun
    exact, vector = run.vector(found.times), found.vectors[:, 0, 0]
    turned = (vector - exact) * np.exp(-1j * np.angle(exact))
    return Accuracy(
        **asdict(errors(run, found.times, vector, seconds)),
        along=float(np.mean(abs(turned.real) < 1.96 * found.radial[:, 0, 0])),
        across=float(np.mean(abs(turned.imag) < 1.96 * found.tangential[:, 0, 0])),
        seconds=took,
    )


def worst(found: Sequence[Errors]) -> str:
    """The largest errors of several records, as the table has them."""
    names = ("rms", "largest", "ends", "offset")
    return "  ".join(f"{max(abs(getattr(one, name)) for one in found):7.3f}" for name in names)


def main(seeds: int) -> None:
    """Print the table."""
    print(f"{seeds} seeds each; the worst of them, coverage the mean of them, time the median")
    print("ripple   rms %  largest %  ends %  offset °  along %  across %  s")
    for ripple in (0.0, RIPPLE):
        run = machine(ripple)
        found = [accuracy(run, seed) for seed in range(seeds)]
        mean = (100 * np.mean([getattr(one, name) for one in found]) for name in ("along", "across"))
        covered = "  ".join(f"{value:7.1f}" for value in mean)
        took = np.median([one.seconds for one in found])
        print(f"{100 * ripple:4.1f} %  {worst(found)}  {covered}  {took:.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
