"""Identification from measured amplitudes: the methods behind one function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from rotorid.base.registry import Method, find
from rotorid.base.text import listing
from rotorid.harmonic.equation_error import Bounds, equation_error, limits
from rotorid.harmonic.experiments import Experiments
from rotorid.harmonic.operator_model import HarmonicModel
from rotorid.harmonic.output_identification import identify_outputs
from rotorid.harmonic.regression_rows import ask_about_case
from rotorid.harmonic.result import Identification
from rotorid.harmonic.unmeasured_amplitudes import hidden_outputs, without
from rotorid.regression.prior import Known

Identify = Callable[
    [HarmonicModel, Experiments, Bounds | None, str, Mapping[str, float] | None], Identification
]
"""Model, experiments, bounds, loss, start."""


def identify(
    model: HarmonicModel,
    experiments: Experiments,
    *,
    method: str = "equation-error",
    bounds: Bounds | None = None,
    loss: str = "linear",
    start: Mapping[str, float] | None = None,
    prior: Known | None = None,
    ridge: float = 0.0,
) -> Identification:
    """Identify a model's parameters from measured amplitudes.

    Parameters
    ----------
    model
        From `harmonic_model`.
    experiments
        Amplitudes of all signals; a row that needs one that was not measured (NaN) is left out.
    method
        One of `METHODS`. Equation error takes all rows alike as in [S] (9), (24); with stated errors of the
        amplitudes each row has the weight that follows from them. Output error starts from the linear
        estimate; it is unbiased where noise in the amplitudes makes the linear one biased.
    bounds
        Lowest and highest value by name, None: no limit. Output error keeps to them; with equation error
        they choose among several solutions.
    loss
        Of output error: one of `LOSSES` in `rotorid.regression.robust`.
    start
        Starting values by name for output error, where the linear estimate is not to be used.
    prior, ridge
        Of output error: what is known beside the data, or λ of a ridge towards where it begins.

    Raises
    ------
    ValueError
        For signals that were not measured at all, options that do not go together, unknown names.
    """
    chosen = find(METHODS, method, "method")
    for what, given in (("bounds", bounds), ("start", start), ("prior", prior)):
        for name in given or {}:
            if name not in model.parameters:
                raise ValueError(f"{what}: {name} is no parameter; those are {', '.join(model.parameters)}")
    for name, (low, high) in limits(bounds).items():
        if not low <= high:
            raise ValueError(f"the bounds of {name} must be (lowest, highest); got ({low}, {high})")
    if (prior or ridge) and chosen.function is not identify_outputs:
        raise ValueError("[prior] and --ridge belong to --method output-error")
    if prior and not experiments.stated:
        raise ValueError(
            "[prior] is weighed against the errors of the amplitudes: state them (--amplitude-error and "
            "--phase-error, or [errors] in the model file)"
        )
    ask_about_case(model, experiments)
    experiments, copies = experiments.without_copies()
    if prior or ridge:
        found = identify_outputs(model, experiments, bounds, loss, start, prior, ridge)
    else:
        found = chosen.function(model, experiments, bounds, loss, start)
    return replace(found, left_out=(*copies, *found.left_out))


def _by_equations(
    model: HarmonicModel,
    experiments: Experiments,
    bounds: Bounds | None,
    loss: str,
    start: Mapping[str, float] | None,
) -> Identification:
    if loss != "linear" or start:
        raise ValueError("loss and start belong to method='output-error'; linear regression has neither")
    hidden = hidden_outputs(model, experiments)
    seen = without(model, hidden) if hidden else None
    if seen is None:
        return equation_error(model, experiments, bounds=bounds)
    found = equation_error(seen, experiments, bounds=bounds)
    if not np.isfinite(found.condition_number):
        raise ValueError(
            f"these experiments do not determine the {len(seen.combinations.words)} combinations of the "
            f"equations without {listing(hidden, 'and')} (not measured): use the method "
            "output-error, or measure more"
        )
    note = f"{listing(hidden, 'and')} {'is' if len(hidden) == 1 else 'are'} not measured: eliminated"
    shown = () if found.identifiable else found.combinations
    return replace(found, combinations=shown, notes=(note, *found.notes))


METHODS: tuple[Method[Identify], ...] = (
    Method("equation-error", "linear regression of the equations", _by_equations),
    Method("output-error", "nonlinear least squares of the amplitudes, for noisy data", identify_outputs),
)
