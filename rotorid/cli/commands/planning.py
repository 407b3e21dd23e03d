"""Design help of `rotorid identify`: which frequencies to measure next."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rotorid.workflows.parameters import speeds

if TYPE_CHECKING:
    from rotorid.harmonic.design import Design
    from rotorid.harmonic.result import Identification
    from rotorid.tables import HarmonicFile

MOST_CANDIDATES = 2000


def plan(file: HarmonicFile, found: Identification | None, candidates: str, choose: int | None) -> Design:
    """Choose frequencies for a model whose parameters are known roughly.

    Parameters
    ----------
    file
        The model; its `[start]` guesses what is not identified, its errors are those of the readings.
    found
        What data have told already, or None. The excitation is that of its experiments; without them every
        input has the amplitude 1.
    candidates
        "10:30:1", in rad/s, or with rpm or Hz at the end.
    choose
        How many; default as many as the parameters, at least 2.

    Raises
    ------
    ValueError
        If errors, guesses or the excitation are missing.
    """
    from rotorid.harmonic.design import design

    try:
        frequencies = speeds(candidates)
    except ValueError as error:
        raise ValueError(str(error).replace("--speeds", "--design").replace("speed", "frequency")) from None
    if len(frequencies) > MOST_CANDIDATES:
        raise ValueError(f"--design takes at most {MOST_CANDIDATES} frequencies, not {len(frequencies)}")
    if file.errors is None:
        raise ValueError(
            "--design needs the errors of the readings: --amplitude-error and --phase-error, or [errors] "
            "in the model file"
        )
    guess = dict(file.start)
    if found is not None:
        # of several solutions the first, where no guess says which is meant
        several = dict(found.solutions[0]) if found.solutions else {}
        single = dict(zip(found.parameters, found.values.tolist(), strict=True))
        for source in (several, file.start, single):
            guess.update({name: value for name, value in source.items() if math.isfinite(value)})
    lost = [name for name in file.model.parameters if name not in guess]
    if lost:
        raise ValueError(
            f"--design needs a guess of {', '.join(lost)}: put it under [start] in the model file"
        )
    number = choose if choose is not None else max(2, len(file.model.parameters))
    number = min(number, len(frequencies)) if choose is None else number
    return design(file.model, guess, frequencies, number, errors=file.errors, inputs=_inputs(file, found))


def _inputs(file: HarmonicFile, found: Identification | None) -> dict[str, complex]:
    """One amplitude of each input."""
    import numpy as np

    model = file.model
    if found is None:
        if len(model.inputs) > 1:
            raise ValueError(
                f"--design without DATA excites one input; this model has {', '.join(model.inputs)}: "
                "give a table that shows their amplitudes"
            )
        return dict.fromkeys(model.inputs, 1.0 + 0j)
    forced = np.flatnonzero(~found.experiments.free)
    if not len(forced):
        raise ValueError("--design is for harmonic tests; these data are free vibrations")
    table = {name: found.experiments.signals[name][forced] for name in model.inputs}
    complete = [i for i in range(len(forced)) if not any(np.isnan(z[i]) for z in table.values())]
    if not complete:
        raise ValueError("--design needs an experiment in which every input is known")
    return {name: complex(z[complete[0]]) for name, z in table.items()}
