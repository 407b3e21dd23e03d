"""One sample of a study of machines: a drawn rotor, read, and balanced until its limit is met."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from balancing import Correction, RunScatter, Trials, UndeterminedError, correct, estimate_influence
from fem import InfluenceCoefficients, Rotor, influence
from fem.parameters import with_parameters
from rotorid.base.arrays import ComplexArray
from rotorid.study.study_file import MachineStudy

TRIAL = 0.5
"""By how much a trial moves one reading, by the rotor as its file has it: a share of the largest as built."""
UNSTABLE = "the drawn rotor is unstable, and has no steady response"


def nominal(study: MachineStudy) -> tuple[ComplexArray, tuple[str, ...]]:
    """Coefficients (S, C, P + U) of the rotor as its file has it, and warnings; refuses an unstable one."""
    found = _influence(study, study.rotor)
    if found.windows:
        raise ValueError("the rotor itself is unstable at the speeds of the study: it has no steady response")
    W = found.W * study.gains[..., None]
    if not W[..., : len(study.planes)].any(axis=(0, 1)).all():
        raise ValueError("no sensor sees one of the planes: there is no trial unbalance for it")
    return W, found.warnings


def _influence(study: MachineStudy, rotor: Rotor) -> InfluenceCoefficients:
    """Of unbalance in the planes and at the drawn nodes, (S, C, P + U)."""
    places = [*study.planes.values(), *study.unbalance]
    return influence(rotor, places, list(study.sensors.values()), study.speeds)


def draw_machine(given: tuple[MachineStudy, ComplexArray], rng: np.random.Generator) -> dict[str, Any]:
    """Draw one, read it as built and after each correction; `runs_needed` counts all runs of the machine.

    The first runs are the bare rotor and a trial in each plane. Each check run joins them in the next fit, as
    in `balancing.refine`. As long as what is read does not meet the limit, there is a next correction.
    """
    study, W = given
    P = len(study.planes)
    unit = 1 / np.abs(W[..., :P]).max(axis=(0, 1))  # moves one reading by its limit
    normal = rng.standard_normal(len(study.scatter))
    u = [*study.unbalance.values()] * _normal(rng, len(study.unbalance))
    if study.scatter:
        scattered = zip(study.scatter.items(), normal, strict=True)
        values = {path: value * float(np.exp(spread * x)) for (path, (value, spread)), x in scattered}
        drawn = _influence(study, with_parameters(study.rotor, values))
        if drawn.windows:
            return {"why": UNSTABLE}
        W = drawn.W * study.gains[..., None]
    W, bare = W[..., :P], W[..., P:] @ u
    weights: list[ComplexArray] = []
    readings: list[ComplexArray] = []

    def largest(mounted: ComplexArray) -> float:
        """Of the readings of a run with these weights."""
        weights.append(mounted)
        readings.append(_read(study, bare + W @ mounted, rng))
        return float(np.abs(readings[-1]).max())

    row: dict[str, Any] = {"ratio_0": largest(np.zeros(P, complex))}
    if row["ratio_0"] <= 1:
        return row | {"runs_needed": 1}
    if not study.corrections:
        return row
    for trial in np.diag(np.where(study.trials > 0, study.trials, TRIAL * row["ratio_0"] * unit)):
        largest(trial)
    try:
        for k in range(1, study.corrections + 1):
            estimate = estimate_influence(_trials(study, readings, weights))
            correction = correct(estimate)
            if k == 1 and (study.errors or study.run_error):
                true = correct(replace(estimate, W=W, baseline=bare))  # by the same weighing of readings
                row |= {"held": _holds(correction, true.weights), "warned": bool(correction.warnings)}
            row[f"ratio_{k}"] = largest(correction.weights)
            if row[f"ratio_{k}"] <= 1:
                return row | {"runs_needed": len(readings)}
    except UndeterminedError as error:
        row["why"] = str(error).partition("\n")[0]
    return row


def _read(study: MachineStudy, Y: ComplexArray, rng: np.random.Generator) -> ComplexArray:
    """What the sensors of a run say of (S, C), with the errors of the run and of the readings."""
    if study.run_error:
        common, own = _normal(rng), _normal(rng, *Y.shape)
        Y = Y * (1 + study.run_error * (common + own) / np.sqrt(2))
    if study.errors:
        a, b = rng.standard_normal((2, *Y.shape))
        Y = Y * (1 + study.errors.amplitude * a) * np.exp(1j * study.errors.phase * b)
        Y = Y + study.errors.floor * _normal(rng, *Y.shape)
    return np.asarray(Y)


def _normal(rng: np.random.Generator, *shape: int) -> ComplexArray:
    """Complex, of variance 1 in each direction."""
    return np.asarray(rng.standard_normal(shape) + 1j * rng.standard_normal(shape))


def _trials(study: MachineStudy, readings: list[ComplexArray], weights: list[ComplexArray]) -> Trials:
    """The runs so far, with the errors as they are."""
    return Trials(
        runs=tuple(f"run {r + 1}" for r in range(len(readings))),
        speeds=study.speeds,
        sensors=tuple(study.sensors),
        planes=tuple(study.planes),
        readings=np.array(readings),
        weights=np.array(weights),
        errors=study.errors,
        run_errors=RunScatter(study.run_error) if study.run_error else None,
    )


def _holds(found: Correction, D: ComplexArray) -> bool | None:
    """Whether the joint 95 % region of the weights holds D; None where there is none."""
    return bool(found.region().holds(D)) if found.region_known else None
