"""A record: what was measured over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from rotorid.base.arrays import FloatArray
from rotorid.base.unit_words import Shown

if TYPE_CHECKING:
    from rotorid.timedomain.models.ode_model import OdeModel

SECONDS = Shown("time, s")


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
        Standard deviations of outputs by name, a number or shape (n,); None: unknown.
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
        t = _column(self.t, f"{self.name}: the times")
        _check_times(t, self.name)
        outputs = {key: self._samples(value, key, len(t)) for key, value in self.outputs.items()}
        inputs = {key: self._samples(value, key, len(t)) for key, value in self.inputs.items()}
        for key, value in inputs.items():
            if np.isnan(value).any():
                at = t[np.flatnonzero(np.isnan(value))[0]]
                raise ValueError(
                    f"{self.name}: the input {key} is missing at t = {at:g}; an input needs a value at "
                    "every time"
                )
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "outputs", outputs)
        object.__setattr__(self, "inputs", inputs)
        if self.sigma is not None:
            sigma = {key: self._deviation(value, key, len(t)) for key, value in self.sigma.items()}
            object.__setattr__(self, "sigma", sigma)

    def __len__(self) -> int:
        return len(self.t)

    def _samples(self, value: ArrayLike, key: str, n: int) -> FloatArray:
        column = _column(value, f"{self.name}: {key}")
        if len(column) != n:
            raise ValueError(f"{self.name}: {key} has {len(column)} values, but there are {n} times")
        if np.isinf(column).any():
            at = np.flatnonzero(np.isinf(column))[0]
            raise ValueError(f"{self.name}: {key} is infinite in row {at + 1}; leave missing samples empty")
        return column

    def _deviation(self, value: float | FloatArray, key: str, n: int) -> float | FloatArray:
        if key not in self.outputs:
            raise ValueError(f"{self.name}: a standard deviation is given for {key}, which is no output")
        array = np.array(value, dtype=float)
        if array.shape not in ((), (n,)):
            raise ValueError(
                f"{self.name}: the standard deviation of {key} is one number or {n}, one per time"
            )
        measured = ~np.isnan(self.outputs[key]) if array.ndim else np.array(True)
        if not np.all((np.isfinite(array) & (array > 0)) | ~measured):
            raise ValueError(f"{self.name}: the standard deviation of {key} must be above 0")
        if array.ndim == 0:
            return float(array)
        return array


def from_t0(model: OdeModel, record: Record) -> Record:
    """The record with one more time, without samples, where the initial values belong to an earlier one.

    Raises
    ------
    ValueError
        A record that begins before that time, or one with inputs, which are not known there.
    """
    if model.t0 is None or isinstance(model.t0, str) or model.t0 == record.t[0] or not model.states:
        return record
    if record.t[0] < model.t0:
        raise ValueError(
            f"{record.name} begins at t = {record.t[0]:g} s, before t0 = {model.t0:g} s of [initial]"
        )
    if model.driven:
        raise ValueError(
            f"{record.name} begins at t = {record.t[0]:g} s: its inputs are not known from t0 = "
            f"{model.t0:g} s on; begin the record there"
        )

    def longer(column: FloatArray, first: float) -> FloatArray:
        return np.append(first, column)

    sigma = record.sigma and {
        name: longer(s, np.nan) if isinstance(s, np.ndarray) else s for name, s in record.sigma.items()
    }
    outputs = {name: longer(column, np.nan) for name, column in record.outputs.items()}
    inputs = {name: longer(column, column[0]) for name, column in record.inputs.items()}
    return replace(record, t=longer(record.t, model.t0), outputs=outputs, inputs=inputs, sigma=sigma)


def record_names(names: Sequence[str]) -> list[str]:
    """Short names of records that tell them apart: ends of paths, numbers where they are the same.

    Examples
    --------
    >>> record_names(["a/run_1.csv", "a/run_2.csv"]), record_names(["a/x.csv", "b/x.csv"])
    (['run_1.csv', 'run_2.csv'], ['a/x.csv', 'b/x.csv'])
    >>> record_names(["the record", "the record"])
    ['record 1', 'record 2']
    """
    if len(set(names)) < len(names):
        return [f"record {k + 1}" for k in range(len(names))]
    parts = [PurePath(name).parts or (name,) for name in names]
    for depth in range(1, max(len(part) for part in parts) + 1):
        short = ["/".join(part[-depth:]) for part in parts]
        if len(set(short)) == len(short):
            return short
    return list(names)


def _column(value: ArrayLike, what: str) -> FloatArray:
    try:
        column = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} must be numbers") from error
    if column.ndim != 1:
        raise ValueError(f"{what} must be one column, not of shape {column.shape}")
    return column


def _check_times(t: FloatArray, name: str) -> None:
    if len(t) == 0:
        raise ValueError(f"{name} has no samples")
    bad = np.flatnonzero(~np.isfinite(t))
    if bad.size:
        raise ValueError(f"{name}: the time in row {bad[0] + 1} is missing or infinite")
    back = np.flatnonzero(np.diff(t) <= 0)
    if back.size:
        i = int(back[0])
        if t[i] == t[i + 1]:
            raise ValueError(
                f"{name}: the time {t[i]:g} is repeated in row {i + 2}; merge these samples, or use one "
                "record for each run"
            )
        raise ValueError(
            f"{name}: the times must increase, but t = {t[i + 1]:g} in row {i + 2} follows {t[i]:g}; "
            "sort the rows by time"
        )
