"""Which conventions of a job are assumed: those that nobody states, and that its numbers depend on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rotorid.base.arrays import ComplexArray
from rotorid.base.complex_numbers import off_axis
from rotorid.tables.job.job_data import Job


def with_assumed(job: Job) -> Job:
    """The job whose labels name what is assumed.

    Phases always matter. The direction of angles matters as soon as the job writes an angle other than 0° and
    180°: of a weight, a hole, a forbidden arc, or of a sensor or key phasor of the model.
    """
    matters = {"phase": True, "angles": any(off_axis(unit) for unit in _directions(job))}
    assumed = tuple(name for name in job.conventions.unstated if matters[name])
    if not assumed:
        return job
    labels = replace(job.trials.labels, assumed=assumed)
    return replace(
        job,
        trials=replace(job.trials, labels=labels),
        influence=None if job.influence is None else replace(job.influence, labels=labels),
        check=None if job.check is None else replace(job.check, labels=labels),
    )


def _directions(job: Job) -> Iterator[ComplexArray]:
    """Whatever the job writes with an angle, as complex numbers."""
    yield job.trials.weights
    if job.check is not None:
        yield job.check.weights
    for holes in job.holes.values():
        yield np.exp(1j * holes.angles)
    for arcs in () if job.limits is None else job.limits.forbidden:
        yield np.exp(1j * np.array([end for start, width in arcs for end in (start, start + width)]))
    if job.rotor is not None:
        yield np.exp(1j * np.radians([job.key_phasor, *job.sensor_angles.values()]))
