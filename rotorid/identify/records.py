"""Records: what was measured over time, and what every one of several records has for itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray, IntArray
from rotorid.base.text import Shown
from rotorid.identify.ode import OdeModel

T = TypeVar("T")
SECONDS = Shown("time, s")
SAME_STEP = 4e-15
"""Steps that differ by less than this share of the largest time are one step (rounded times)."""


@dataclass(frozen=True, eq=False)
class Record:
    """Samples of outputs and inputs over time.

    Attributes
    ----------
    t
        Shape (n,), s, increasing; the initial values of a model belong to t[0].
    outputs
        Measured outputs by name, shape (n,) each; NaN = missing.
    inputs
        Measured inputs by name, shape (n,) each, without gaps; straight lines between samples.
    sigma
        Standard deviations of outputs by name, shape (n,), or a number for all samples; None: unknown.
    name
        For messages.
    axis
        How people see the times.

    Raises
    ------
    ValueError
        Times that do not increase or are not numbers; columns of another length; infinite values; missing
        inputs; standard deviations that are not above 0.
    """

    t: FloatArray
    outputs: Mapping[str, FloatArray] = field(default_factory=dict)
    inputs: Mapping[str, FloatArray] = field(default_factory=dict)
    sigma: Mapping[str, float | FloatArray] | None = None
    name: str = "the record"
    axis: Shown = SECONDS

    def __post_init__(self) -> None:
        name, t = self.name, _column(self.t, f"{self.name}: the times", np.shape(self.t))
        if not len(t):
            raise ValueError(f"{name} has no samples")
        for i in np.flatnonzero(np.diff(t) <= 0)[:1]:
            raise ValueError(
                f"{name}: the times must increase, but t = {t[i + 1]:g} in row {i + 2} follows {t[i]:g}"
            )
        outputs, inputs, sigma = (
            {key: _column(x, f"{name}: {key}", t.shape, gaps) for key, x in (columns or {}).items()}
            for columns, gaps in ((self.outputs, True), (self.inputs, False), (self.sigma, True))
        )
        for key, std in sigma.items():
            if key not in outputs:
                raise ValueError(f"{name}: a standard deviation is given for {key}, which is no output")
            if not ((std > 0) | np.isnan(outputs[key])).all():
                raise ValueError(f"{name}: the standard deviation of {key} must be above 0")
        columns = {"t": t, "outputs": outputs, "inputs": inputs, "sigma": sigma or None}
        for kind, value in columns.items():
            object.__setattr__(self, kind, value)

    def __len__(self) -> int:
        return len(self.t)

    @cached_property
    def steps(self) -> tuple[FloatArray, IntArray]:
        """Lengths of the kinds of steps from sample to sample, s, and the kind of each step, (n − 1,)."""
        steps = np.diff(self.t)
        # of steps that differ by rounding the mean is taken: an error of one would add up over the record
        kinds = np.round((steps - steps[:1]) / (SAME_STEP * np.abs(self.t).max()))
        _, which, count = np.unique(kinds, return_inverse=True, return_counts=True)
        return steps[:1] + np.bincount(which, steps - steps[:1]) / count, which


def refined(record: Record, every: int) -> tuple[Record, IntArray]:
    """The times of a record and others between them, with its inputs, and where its own stand.

    Samples are usually so many steps apart, and further ones in proportion.
    """
    if len(record) == 1:
        return record, np.arange(1)
    gaps = np.diff(record.t)
    steps = np.ceil((every - 1e-6) * np.clip(gaps / np.median(gaps), 1.0 / every, 1e3)).astype(int)
    at = np.append(0, np.cumsum(steps))
    t = np.interp(np.arange(at[-1] + 1), at, record.t)
    inputs = {name: np.interp(t, record.t, u) for name, u in record.inputs.items()}
    return Record(t, {}, inputs, None, record.name), at


def inputs_of(model: OdeModel, record: Record) -> FloatArray:
    """Inputs of the model in its order, (n, n_u)."""
    if missing := [name for name in model.inputs if name not in record.inputs]:
        have = ", ".join(record.inputs) or "none"
        raise ValueError(f"{record.name}: the input {missing[0]} is missing; inputs are: {have}")
    return np.array([record.inputs[name] for name in model.inputs]).reshape(-1, len(record)).T


def models_of(model: OdeModel, count: int) -> tuple[OdeModel, ...]:
    """The model of each record, all with the same parameters: x0 of the second record is called x0_2.

    Parameters
    ----------
    model
        With `per_record`, the names of what every record has for itself.
    count
        Of records; with one there is nothing to tell apart.
    """
    if not model.per_record or count < 2:
        return (model,) * count
    import sympy

    copies = _copies(model, count)
    place = [i for i, each in enumerate(copies.values()) for _ in each]
    new: dict[str, Any] = {"parameters": sum(copies.values(), ()), "per_record": ()}
    new |= {"start": model.start[place], "bounds": model.bounds[place]}
    models = []
    for i in range(count):
        put = {sympy.Symbol(name): sympy.Symbol(copies[name][i]) for name in model.per_record}
        for kind in ("rates", "initial", "observed", "inertia"):
            new[kind] = tuple(e.subs(put) for e in getattr(model, kind))
        models.append(replace(model, **new))
    return tuple(models)


def recorded_starts(model: OdeModel, records: Sequence[Record]) -> dict[str, float]:
    """What the first samples say of initial states taken from the record, by name of the copies.

    They are starting values alone. [F] holds y(t0) at its sample ȳ0 = y0 + e, so that the estimate of θ
    carries e without saying so. Here y0 is estimated, too: the row of the sample, (y0 − ȳ0)/σ0, is its
    measurement, and a prior of the same value would count it twice. With A = ∂y/∂θ and V = ∂y/∂y0 of all
    samples over their σ the covariance of θ is the inverse of AᵀA − AᵀV (VᵀV)⁻¹ VᵀA, never less than
    (AᵀA)⁻¹, which takes y0 as known. From an exact record this finds what [F] finds.

    Raises
    ------
    ValueError
        A record without that sample.
    """
    copies, starts = _copies(model, len(records)), {}
    for name, output in model.recorded.items():
        for copy, record in zip(copies[name], records, strict=True):
            starts[copy] = float(record.outputs[output][0]) if output in record.outputs else np.nan
            if np.isnan(starts[copy]):
                raise ValueError(f"{record.name}: {output} has no sample at the first time for [initial]")
    return starts


def for_copies(model: OdeModel, count: int, given: Mapping[str, T]) -> dict[str, T]:
    """Values by name of the model, or of a copy, as values by name of the copies."""
    copies = _copies(model, count)
    return {copy: value for name, value in given.items() for copy in copies.get(name, (name,))}


def _copies(model: OdeModel, count: int) -> dict[str, tuple[str, ...]]:
    """Copies of each parameter."""
    taken = {*model.parameters, *model.states, *model.inputs}
    copies: dict[str, tuple[str, ...]] = {name: (name,) for name in model.parameters}
    for name in model.per_record if count > 1 else ():
        base = f"{name}_"
        while taken & {f"{base}{i + 1}" for i in range(count)}:
            base += "_"
        copies[name] = tuple(f"{base}{i + 1}" for i in range(count))
    return copies


def _column(value: ArrayLike, what: str, shape: tuple[int, ...], gaps: bool = False) -> FloatArray:
    """A copy as finite numbers, one a time, NaN where there may be gaps; one number is that of all times."""
    try:
        column = np.array(value, dtype=float)
        column = np.full(shape, column) if not column.ndim else column
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} must be numbers") from error
    if column.shape != shape or column.ndim != 1:
        raise ValueError(f"{what} must be one column of a number for each time, not {column.shape}")
    for i in np.flatnonzero(np.isinf(column) | (np.isnan(column) & (not gaps)))[:1]:
        raise ValueError(f"{what}: the value in row {i + 1} is {column[i]:g}")
    return column
