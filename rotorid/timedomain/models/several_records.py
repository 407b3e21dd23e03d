"""Several records: parameters that every record has for itself, such as its initial states."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any, TypeVar

from rotorid.timedomain.models.ode_model import OdeModel
from rotorid.timedomain.models.record import Record

T = TypeVar("T")


def models_of(model: OdeModel, count: int) -> tuple[OdeModel, ...]:
    """The model of each record, all with the same parameters: x0 of the second record is called x0_2.

    Parameters
    ----------
    model
        With `per_record`, the names of what every record has for itself.
    count
        Of records; with one there is nothing to tell apart.
    """
    own = model.per_record
    if not own or count < 2:
        return (model,) * count
    import sympy

    copies = _names(model, count)
    names = tuple(copy for name in model.parameters for copy in copies[name])
    place = [model.parameters.index(name) for name in model.parameters for _ in copies[name]]
    common: dict[str, Any] = {
        "parameters": names,
        "start": model.start[place],
        "bounds": model.bounds[place],
        "per_record": (),
    }
    out = []
    for i in range(count):
        put = {sympy.Symbol(name): sympy.Symbol(copies[name][i]) for name in own}
        parts: dict[str, Any] = {
            f.name: tuple(e.subs(put) for e in getattr(model, f.name))
            for f in fields(model)
            if f.name in ("rates", "initial", "observed", "inertia")
        }
        out.append(replace(model, **common, **parts))
    return tuple(out)


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
    copies, found = _names(model, len(records)), {}
    for name, output in model.recorded.items():
        for copy, record in zip(copies[name], records, strict=True):
            first = float(record.outputs[output][0]) if output in record.outputs else math.nan
            if math.isnan(first):
                raise ValueError(
                    f"{record.name}: {output} has no sample at the first time, t = {record.t[0]:g} s, where "
                    f"[initial] takes it from the record; give a number there, or a parameter"
                )
            found[copy] = first
    return found


def for_copies(model: OdeModel, count: int, given: Mapping[str, T]) -> dict[str, T]:
    """Values by name of the model, or of a copy, as values by name of the copies."""
    copies = _names(model, count)
    out: dict[str, T] = {}
    for name, value in given.items():
        out.update(dict.fromkeys(copies.get(name, (name,)), value))
    return out


def _names(model: OdeModel, count: int) -> dict[str, tuple[str, ...]]:
    """Copies of each parameter."""
    taken = {*model.parameters, *model.states, *model.inputs}
    out: dict[str, tuple[str, ...]] = {}
    for name in model.parameters:
        if name not in model.per_record or count < 2:
            out[name] = (name,)
            continue
        gap = "_"
        while taken & set(_numbered(name, gap, count)):
            gap += "_"
        out[name] = tuple(_numbered(name, gap, count))
    return out


def _numbered(name: str, gap: str, count: int) -> Iterable[str]:
    return (f"{name}{gap}{i + 1}" for i in range(count))
