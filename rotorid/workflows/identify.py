"""`identify`: coefficients of a model from harmonic tests, natural frequencies and shapes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.logs import workflows as log
from rotorid.commands.amplitude_errors import amplitude_errors
from rotorid.commands.input_checks import check_choices, file_of, refuse
from rotorid.commands.outcome import Found, Parts, command, phase, provenance, text_of
from rotorid.commands.quantities import Speeds, speeds

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.base.registry import Method
    from rotorid.harmonic import Experiments, HarmonicModel, Identification
    from rotorid.regression.d_optimal import Design
    from rotorid.tables import HarmonicFile

MOST_CANDIDATES = 2000
_NO_DATA = "give a table of measured amplitudes after the model file (only --design does without)"


@dataclass(frozen=True)
class IdentifyOptions:
    """Options of `identify`.

    Attributes
    ----------
    method : METHOD
        How the coefficients are found.
    loss : LOSS
        What a residual counts, with output-error.
    amplitude_error : PERCENT
        One standard deviation of an amplitude, in place of the one that the model states.
    phase_error : DEGREES
        One standard deviation of a phase, in place of the one that the model states.
    ridge : LAMBDA
        Regularise (with output-error): add λ times the diagonal of the normal matrix at the start, which
        pulls towards it; no intervals.
    design : FIRST:LAST:STEP
        Which of these frequencies to measure next: rad/s, or with Hz or rpm at the end, such as 10:30:1.
    choose : N
        How many of them; default: as many as the parameters, at least 2.
    """

    method: str = "equation-error"
    loss: str = "linear"
    amplitude_error: float | None = None
    phase_error: float | None = None
    ridge: float | None = None
    design: Speeds | None = None
    choose: int | None = None


def choices() -> dict[str, tuple[Method[Any], ...]]:
    """What the options of these names choose from."""
    from rotorid.harmonic.identification import METHODS
    from rotorid.regression.robust import LOSSES

    return {"method": METHODS, "loss": LOSSES}


@dataclass(frozen=True, eq=False, kw_only=True)
class Coefficients(Parts):
    """What data told, and which frequencies to measure next, one perhaps missing; the text of the model."""

    identification: Identification | None
    design: Design | None
    model: str = ""

    @property
    def parts(self) -> Mapping[str, Any]:
        """Both of them."""
        return {"": self.identification, "design": self.design}

    def to_frame(self) -> pd.DataFrame:
        """The frequencies, or else one row per parameter."""
        return super().to_frame() if self.design is None else self.design.to_frame()

    def figure(self) -> Figure:
        """Amplitudes, deviations and phases, or shapes; parameters and correlations."""
        from rotorid.harmonic.plots import figure_identification

        if self.identification is None:
            raise ValueError(_NO_DATA)
        return figure_identification(self.identification)

    def sheet(self) -> bytes:
        """To print or to send, one HTML file."""
        from rotorid.report.estimation import identification_report

        return identification_report(
            self.to_dict(), self.identification, self.design, provenance=self.provenance, model=self.model
        )


@command
def identify(
    model: HarmonicModel | HarmonicFile | Path | str,
    data: Experiments | Path | str | None = None,
    options: IdentifyOptions | None = None,
) -> Coefficients:
    """Identify coefficients from measured amplitudes, with intervals, or say what the data do tell.

    Parameters
    ----------
    model
        A model, or its file.
    data
        Measured amplitudes, or their table; only the choice of frequencies does without.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For files, options or data that cannot be.
    """
    from rotorid.harmonic import Experiments, HarmonicModel
    from rotorid.harmonic import identify as estimate
    from rotorid.tables import HarmonicFile, read_harmonic_model, read_measurements

    options = options or IdentifyOptions()
    _check(options, measured=data is not None)
    files = [Path(given) for given in (model, data) if isinstance(given, Path | str)]
    text = text_of(model)
    if isinstance(model, HarmonicModel):
        model = HarmonicFile(model)
    elif not isinstance(model, HarmonicFile):
        model = read_harmonic_model(file_of(model, "a model"))
    file = replace(model, errors=amplitude_errors(model.errors, options.amplitude_error, options.phase_error))
    result = None
    if data is not None:
        if not isinstance(data, Experiments):
            data = read_measurements(file_of(data, "a table of amplitudes"), file)
        with phase("identification"):
            result = estimate(
                file.model,
                data,
                method=options.method,
                bounds=file.bounds or None,
                loss=options.loss,
                start=(file.start or None) if options.method == "output-error" else None,
                prior=file.prior,
                ridge=options.ridge or 0.0,
            )
        log.info("degrees_of_freedom = %s", result.dof)
    return Coefficients(
        identification=result,
        design=None if options.design is None else _plan(file, result, options.design, options.choose),
        model=text,
        provenance=provenance(files, options),
    )


class TwoStructures(Found):
    """The comparison of two models."""

    def figure(self) -> Figure:
        """None."""
        raise ValueError("two models beside each other have no picture: --plot belongs to one model")

    def sheet(self) -> bytes:
        """None."""
        raise ValueError("two models beside each other have no sheet: --report belongs to one model")


@command
def compare(
    models: Sequence[Path | str], data: Path | str, options: IdentifyOptions | None = None
) -> TwoStructures:
    """Fit two structures to the same readings by output error, and test whether the smaller one is enough.

    Errors of the readings are the only options; ValueError for models that do not predict the same readings.
    """
    from rotorid.harmonic.structure_comparison import Structure, compare_structures
    from rotorid.tables import read_harmonic_model, read_measurements

    options = options or IdentifyOptions()
    if len(models) != 2:
        raise ValueError(f"two models are compared, not {len(models)}")
    refuse(options, {*vars(options)} - {"method", "amplitude_error", "phase_error"}, "belongs to one model")
    pair = []
    for model in models:
        file = read_harmonic_model(model)
        if file.prior:
            raise ValueError(f"{model}: two models are compared by the data alone, without [prior]")
        errors = amplitude_errors(file.errors, options.amplitude_error, options.phase_error)
        rows = read_measurements(data, replace(file, errors=errors)).without_copies()[0]
        pair.append(Structure(str(model), file.model, rows, file.bounds, file.start))
    if pair[0].data.errors != pair[1].data.errors:
        raise ValueError(
            "the model files state different errors: give --amplitude-error and --phase-error for both"
        )
    with phase("comparison"):
        found = compare_structures(pair)
    return TwoStructures(found=found, provenance=provenance(map(Path, (*models, data)), options))


def _check(options: IdentifyOptions, *, measured: bool) -> None:
    """Refuse names that are not known, no data, and options that do not go together."""
    check_choices(options, choices())
    if not measured and options.design is None:
        raise ValueError(_NO_DATA)
    if not measured:
        refuse(options, ("method", "loss", "ridge"), "belongs to DATA: nothing is fitted without them")
    if options.method != "output-error":
        refuse(options, ("loss",), "belongs to --method output-error: linear regression has none")
    if options.design is None:
        refuse(options, ("choose",), "belongs to --design FIRST:LAST:STEP")


def _plan(file: HarmonicFile, found: Identification | None, candidates: Speeds, choose: int | None) -> Design:
    """Choose frequencies for a model whose parameters are known roughly.

    Its `[start]` guesses what is not identified. The excitation is that of the experiments; without them
    every input has the amplitude 1.
    """
    from rotorid.harmonic.experiment_design import design
    from rotorid.regression.d_optimal import WITHOUT_PRIOR

    frequencies = speeds(candidates, what="--design")
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
    usual = min(max(2, len(file.model.parameters)), len(frequencies))
    number = usual if choose is None else choose
    read = [name for name in file.model.outputs if name not in file.unmeasured]
    inputs = _inputs(file, found)
    plan = design(file.model, guess, frequencies, number, errors=file.errors, inputs=inputs, measured=read)
    return replace(plan, notes=WITHOUT_PRIOR) if file.prior else plan


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
