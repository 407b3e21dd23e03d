"""A program as a stranger writes it: `.ci/run` checks it by mypy --strict against the installed wheel."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import balancing
import fem
import rotorid
from rotorid.commands.balance import BalanceOptions, balance
from rotorid.samples import sample_data


def lowest(path: Path) -> float:
    """The lowest critical speed, rpm."""
    rotor: fem.Rotor = rotorid.read_rotor(path)
    modes: fem.Modes = fem.critical_speeds(rotor, 1)
    return float(modes.frequencies[0] * 30.0 / np.pi)


def weights(path: Path) -> dict[str, complex]:
    """Correction weights by plane, kg·m."""
    job: rotorid.Job = rotorid.read_job(path)
    correction: balancing.Correction = balancing.correct(balancing.estimate_influence(job.trials))
    return dict(zip(correction.planes, correction.weights.tolist(), strict=True))


def refused(path: Path) -> list[str]:
    """What is wrong with a file, each with its place."""
    try:
        rotorid.read_job(path)
    except rotorid.InputError as error:
        return [str(problem) for problem in error.problems]
    return []


def judged(path: Path) -> str:
    """Whether to mount, as `rotorid balance --method weighted` judges."""
    return balance(path, options=BalanceOptions(method="weighted")).answer.judgement


if __name__ == "__main__":
    samples = sample_data()
    print(f"{lowest(samples / 'rotor23.csv'):.1f} rpm")
    print(
        {
            plane: round(abs(weight) * 1e6)
            for plane, weight in weights(samples / "turbo_job" / "job.toml").items()
        }
    )
    print(judged(samples / "turbo_job" / "job.toml"))
    print(refused(samples / "nowhere.toml"))
