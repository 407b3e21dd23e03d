"""Amplitudes that are measured nowhere, eliminated from the equations in exact arithmetic."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from operator import mul
from typing import Any

import numpy as np

from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.parameter_combinations import Feature, P, split_features
from rotorid.harmonic.polynomial import Polynomial, as_data, times

MOST_TERMS = 400
"""More terms than that after an elimination are no model to fit."""


def hidden_outputs(model: HarmonicModel, experiments: Experiments) -> tuple[str, ...]:
    """Outputs that no experiment has measured, where others are."""
    never = np.isnan(experiments.table(model.outputs)).all(axis=0)
    lost = tuple(model.outputs[j] for j in np.flatnonzero(never))
    return () if len(lost) == len(model.outputs) else lost


def without(
    model: HarmonicModel, hidden: Collection[str], own: Mapping[str, int] | None = None
) -> HarmonicModel | None:
    """The same model without some outputs, fewer by as many equations; None where that becomes too long.

    An equation that loses outputs is multiplied by its common denominator, scaled to begin with 1: where the
    outputs are stiff supports without mass, it remains nearly the balance of forces that it was.

    Parameters
    ----------
    model
        Operator equations.
    hidden
        Outputs to eliminate.
    own
        Numbers of the equations that may be used up for it, by output. Default: any, the shortest first.
    """
    from sympy import QQ, field

    names = [P, *model.parameters, *model.varying]
    K, *generators = field(names, QQ)
    value = dict(zip(names, generators, strict=True))
    rows: dict[int, dict[str, Any]] = {i: {} for i in range(len(model.equations))}
    for f in model.features:
        for monomial, x in f.exact.items():
            factors = (value[n] ** e for n, e in (*monomial, *f.varying, (P, f.power)))
            term = reduce(mul, factors, K(QQ(x.numerator, x.denominator)))
            rows[f.equation][f.signal] = rows[f.equation].get(f.signal, K.zero) + term
    touched = {i for i, row in rows.items() if any(name in row for name in hidden)}
    usable = set(rows if own is None else own.values())
    for name in hidden:
        holding = [i for i in usable & set(rows) if rows[i].get(name)]
        if not holding:
            return None
        top = rows.pop(min(holding, key=lambda i: (_terms({name: rows[i][name]}), i)))
        for i, row in rows.items():
            factor = row.get(name, K.zero) / top[name]
            both = {s: row.get(s, K.zero) - factor * top.get(s, K.zero) for s in {**row, **top}}
            rows[i] = {s: x for s, x in both.items() if x and s != name}
        if own is None and sum(map(_terms, rows.values())) > MOST_TERMS:
            return None
    signals = tuple(s for s in model.signals if s not in hidden)
    features: list[Feature] = []
    for number, (i, row) in enumerate(rows.items()):
        if i in touched:
            features += _features(number, row, names, signals, model.varying)
        else:
            features += [replace(f, equation=number) for f in model.features if f.equation == i]
    return replace(
        model,
        equations=tuple(f"{model.equations[i]}, without {', '.join(hidden)}" for i in rows),
        signals=signals,
        outputs=tuple(o for o in model.outputs if o not in hidden),
        features=tuple(features),
    )


def _terms(row: Mapping[str, Any]) -> int:
    return sum(len(x.numer) + len(x.denom) for x in row.values())


def _features(
    number: int, row: Mapping[str, Any], names: Sequence[str], signals: Sequence[str], varying: Sequence[str]
) -> list[Feature]:
    """Features of an equation of rational functions."""
    bottom = reduce(lambda a, b: a.lcm(b), (x.denom for x in row.values()))
    unit = bottom.terms()[-1][1]
    whole: Polynomial = {}
    for signal, x in row.items():
        own = ((signal, 1),) if signal else ()
        numerator = as_data(x.numer * bottom.exquo(x.denom) / unit, names)
        whole |= {times(monomial, own): value for monomial, value in numerator.items()}
    return split_features(number, whole, {}, frozenset(signals), frozenset(varying))
