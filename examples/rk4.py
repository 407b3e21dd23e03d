"""A real rig with known weights: how large the errors are, and whether the regions of the weights hold them.

Run `python examples/rk4.py [METHOD]`. `BASE` is the bare rotor. The weights of a run are estimated from other
runs: what would have to be added for the bare rotor's vibration is minus what was mounted, and what corrects
the difference of both vibrations is minus the weights. Its regions hold the errors of both.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import balancing
from balancing.error_draws import run_noise
from rotorid import read_job

FOLDER = Path(__file__).parents[1] / "sample_data" / "rk4"
UM, G_MM, BARE, FEW = 1e6, 1e6, "BASE", ("BASE", "A007", "A015")
DISC_1_2_AND_SUM = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])


def main(method: str = "weighted") -> dict[str, float]:
    """Print how the runs scatter, then the weights of each run from others; return its key numbers."""
    trials = read_job(FOLDER / "job.toml").trials
    found = scatter(trials)
    others = [run for run in trials.runs if run != BARE]
    print("\nWeights of each run from all other runs (error and half the longest axis of the 95 % region):")
    table(trials, {run: [name for name in trials.runs if name != run] for run in others}, method)
    print(f"\nThe same from {', '.join(FEW)} only:")
    table(trials, {run: FEW for run in others if run not in FEW}, method)
    return found


def scatter(trials: balancing.Trials) -> dict[str, float]:
    """Of the readings of one run, and of the runs about Y = Y0 + W T, fitted with equal weights; µm."""
    Y, mean = UM * trials.readings[:, :, 0], UM * trials.mean[:, 0]  # (K, R, C), (R, C)
    K, R, C = Y.shape
    reading = np.sqrt(np.sum(np.abs(Y - mean) ** 2, axis=(0, 1)) / (2 * R * (K - 1)))
    A = np.column_stack([np.ones(R), trials.weights * G_MM])
    theta, _, rank, _ = np.linalg.lstsq(A, mean, rcond=None)
    left, W, dof = mean - A @ theta, theta[1:].T, R - rank
    run = np.sqrt(np.sum(np.abs(left) ** 2) / (2 * dof * C))
    S = left.T @ left.conj() / dof
    own = np.sqrt(np.diag(S).real)
    correlations = np.linalg.eigvalsh(S / np.outer(own, own))[::-1]
    U, sizes, _ = np.linalg.svd(W)
    shares, directions = np.linalg.eigh(S)
    both = abs(np.vdot(U[:, 0], directions[:, -1]))
    print("Readings of one run scatter by", ", ".join(f"{s:.3f}" for s in reading), "µm a component.")
    print(f"Runs scatter by {run:.2f} µm a component about the same linear machine,")
    print("  eigenvalues of their correlation:", ", ".join(f"{v:.2f}" for v in correlations))
    print(f"  {shares[-1] / shares.sum():.0%} of their variance stands in one direction of the sensors,")
    print(f"  at a cosine of {both:.2f} with the one in which both discs move them.")
    print("Singular values of W:", ", ".join(f"{s:.3f}" for s in sizes), "µm per g·mm.")
    numbers = (np.sqrt(np.mean(reading**2)), run, correlations[0], both, *sizes)
    names = ("reading_um", "run_um", "correlation", "cosine", "sum_um_per_g_mm", "couple_um_per_g_mm")
    return {name: float(value) for name, value in zip(names, numbers, strict=True)}


def table(trials: balancing.Trials, known: dict[str, Sequence[str]], method: str) -> None:
    """One line a run: error of disc 1, disc 2 and their sum, and whether the regions hold the truth."""
    lines(
        {run: (balancing.estimate_influence(of(trials, known[run])), of(trials, [run])) for run in known},
        method,
    )


def lines(runs: dict[str, tuple[balancing.Influence, balancing.Trials]], method: str) -> None:
    """The same, of coefficients with the bare rotor's vibration and each run itself."""
    print("  run        disk 1         disk 2         sum of both    (g·mm)")
    found = {run: estimated(influence, one, method) for run, (influence, one) in runs.items()}
    for run, (errors, sizes, inside, warned) in found.items():
        rows = zip(errors, sizes, inside, strict=True)
        cells = [f"{e:5.2f} ± {size:5.2f} {'in' if i else '--'}" for e, size, i in rows]
        print(f"  {run}  {'  '.join(cells)}  {'warned' if warned else 'silent'}")
    held, warned = (
        np.sum([getattr(one, name) for one in found.values()], axis=0) for name in ("inside", "warned")
    )
    counts = f"disk 1 {held[0]}, disk 2 {held[1]}, sum {held[2]}"
    print(f"  regions that hold the truth, of {len(found)}: {counts}; warned: {warned}")


class Estimated(NamedTuple):
    """Of disc 1, disc 2, their sum: errors, half the longest axes of the regions, g·mm; what these hold."""

    errors: NDArray[np.float64]
    sizes: NDArray[np.float64]
    inside: NDArray[np.bool_]
    warned: bool


def change_of_run(influence: balancing.Influence, run: balancing.Trials) -> balancing.Influence:
    """The coefficients with what a run differs from the bare rotor by as the vibration to correct."""
    P, of = len(influence.planes), influence.errors
    flip, first = np.diag([-1.0, *np.ones(P)]).astype(complex), np.eye(P + 1, 1).astype(complex)
    noise = of.noise.changed(flip).plus(run_noise(run, influence.W, first, of.reading, of.run))
    change = run.mean[0] - influence.baseline
    return replace(influence, baseline=change, errors=of._replace(noise=noise))


def estimated(influence: balancing.Influence, one: balancing.Trials, method: str) -> Estimated:
    """Weights of a run from what it differs from the bare rotor by, beside what was mounted."""
    correction = balancing.correct(change_of_run(influence, one), refuse=False, method=method)
    weights, draws = correction.weights @ DISC_1_2_AND_SUM.T, correction.draws @ DISC_1_2_AND_SUM.T
    true = -one.weights[0] @ DISC_1_2_AND_SUM.T
    regions = [balancing.Region.of(draws[:, [k]], weights[[k]]) for k in range(len(true))]
    inside = np.array([region.holds(true[[k]]) for k, region in enumerate(regions)])
    sizes = np.array([each.radius * np.sqrt(np.linalg.eigvalsh(each.covariance)[-1]) for each in regions])
    return Estimated(G_MM * np.abs(weights - true), G_MM * sizes, inside, bool(correction.warnings))


def of(trials: balancing.Trials, runs: Sequence[str]) -> balancing.Trials:
    """Some of the runs."""
    rows = [trials.runs.index(run) for run in runs]
    parts = {"readings": trials.readings[:, rows], "weights": trials.weights[rows]}
    return replace(trials, runs=tuple(runs), **parts, steps=np.asarray(trials.steps)[:, :, rows])


if __name__ == "__main__":
    main(*sys.argv[1:2])
