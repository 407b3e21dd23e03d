"""`identify`: coefficients of a model from harmonic tests, natural frequencies and shapes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.answer import Answer
from rotorid.base.logs import workflows as log
from rotorid.base.text import listing
from rotorid.commands.amplitude_errors import amplitude_errors
from rotorid.commands.input_checks import check_choices, file_of, refuse
from rotorid.commands.outcome import EQUATIONS, WITH_REPORT, Parts, command, phase, provenance, text_of
from rotorid.commands.quantities import Speeds, speeds

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.base.registry import Method
    from rotorid.identify import Experiments, HarmonicModel, Identification
    from rotorid.identify.structures import StructureTest
    from rotorid.regression.d_optimal import Design
    from rotorid.report.equations import Equations
    from rotorid.tables import HarmonicFile

MOST_CANDIDATES = 2000
_NO_DATA = "give a table of measured amplitudes after the model file (only --design and --show do without)"


@dataclass(frozen=True)
class IdentifyOptions:
    """Options of `identify`.

    Attributes
    ----------
    loss : LOSS
        What a residual counts.
    amplitude_error : PERCENT
        One standard deviation of an amplitude, in place of the one that the model states.
    phase_error : DEGREES
        One standard deviation of a phase, in place of the one that the model states.
    ridge : LAMBDA
        Regularise: add λ times the diagonal of the normal matrix at the start, which pulls towards it; no
        intervals.
    against : OTHER.toml
        Another model of the same readings: the difference of AIC, and the F test of the further parameters.
    design : FIRST:LAST:STEP
        Which of these frequencies to measure next: rad/s, or with Hz or rpm at the end, such as 10:30:1.
    choose : N from 1
        How many of them; default: as many as the parameters, at least 2.
    """

    loss: str = "linear"
    amplitude_error: float | None = None
    phase_error: float | None = None
    ridge: float | None = None
    against: Path | None = None
    design: Speeds | None = None
    choose: int | None = None
    panels: ClassVar[Mapping[str, str]] = {"Method": "loss ridge against", "Next test": "design choose"}
    to: ClassVar[tuple[str, ...]] = (*WITH_REPORT, *EQUATIONS)


def choices() -> dict[str, tuple[Method[Any], ...]]:
    """What the options of these names choose from."""
    from rotorid.regression.robust import LOSSES

    return {"loss": LOSSES}


@dataclass(frozen=True, eq=False, kw_only=True)
class Coefficients(Parts):
    """What data say, and which frequencies to measure next, one perhaps missing; the model and its text."""

    identification: Identification | None
    design: Design | None
    model: HarmonicModel
    text: str = ""
    against: StructureTest | None = None

    @property
    def parts(self) -> Mapping[str, Any]:
        """Both of them."""
        return {"": self.identification, "design": self.design}

    @property
    def answer(self) -> Answer:
        """Those of the parts; without any, what data can determine at best."""
        if self.identification is None and self.design is None:
            words = self.model.combinations.words
            return Answer(f"Data can determine at best {listing(words, 'and')}.", notes=(_NO_DATA,))
        return super().answer

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; without data what these can determine at best."""
        if self.identification is None and self.design is None:
            return {"combinations": list(self.model.combinations.words)}
        more = {} if self.against is None else {"against": dataclasses.asdict(self.against)}
        return super().to_dict() | more

    def to_frame(self) -> pd.DataFrame:
        """The frequencies, or else one row per parameter."""
        if self.identification is None and self.design is None:
            raise ValueError(_NO_DATA)
        return super().to_frame() if self.design is None else self.design.to_frame()

    @property
    def equations(self) -> Equations:
        """K θ = Y, without data in symbols alone."""
        from rotorid.report.equations_of_results import equations_of

        return equations_of(self.identification or self.model)

    def figure(self) -> Figure:
        """Amplitudes, deviations and phases, or shapes; parameters and correlations."""
        from rotorid.identify.plots import figure_identification

        if self.identification is None:
            raise ValueError(_NO_DATA)
        return figure_identification(self.identification)

    def sheet(self) -> bytes:
        """To print or to send, one HTML file."""
        from rotorid.report.estimation import identification_report

        return identification_report(
            self.to_dict(), self.identification, self.design, provenance=self.provenance, model=self.text
        )


@command
def identify(
    model: HarmonicModel | HarmonicFile | Path | str,
    data: Experiments | Path | str | None = None,
    options: IdentifyOptions | None = None,
) -> Coefficients:
    """Coefficients of a model from harmonic tests, with ±, or what the data do tell.

    Example: rotorid identify sample_data/identify/task_5_1/model.toml sample_data/identify/task_5_1/data.csv

    Which frequencies to measure next:

    Example: rotorid identify sample_data/identify/task_5_1/model.toml sample_data/identify/task_5_1/data.csv
    --amplitude-error 2 --phase-error 1 --design 5:40:1 --choose 3

    Parameters
    ----------
    model : MODEL.toml
        Equations, known numbers, what to estimate.
    data : DATA
        Measured amplitudes, .csv or .xlsx; --design and --show equations do without.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For files, options or data that cannot be.
    """
    from rotorid.identify import Experiments, HarmonicModel
    from rotorid.identify import identify as estimate
    from rotorid.identify.structures import compare_structures
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
    result, source = None, data
    if data is not None:
        if not isinstance(data, Experiments):
            data = read_measurements(file_of(data, "a table of amplitudes"), file)
        with phase("identification"):
            result = estimate(
                file.model,
                data,
                bounds=file.bounds or None,
                loss=options.loss,
                start=file.start or None,
                prior=file.prior,
                ridge=options.ridge or 0.0,
            )
        log.info("degrees_of_freedom = %s", result.dof)
    compared = None
    if options.against is not None and result is not None:
        other = read_harmonic_model(options.against)
        rows = read_measurements(file_of(source, "a table of amplitudes"), replace(other, errors=file.errors))
        compared = compare_structures(result, estimate(other.model, rows, start=other.start or None))
        result = replace(result, notes=(compared.sentence(str(options.against)), *result.notes))
        files.append(options.against)
    return Coefficients(
        identification=result,
        design=None if options.design is None else _plan(file, result, options.design, options.choose),
        model=file.model,
        text=text,
        against=compared,
        provenance=provenance(files, options),
    )


def _check(options: IdentifyOptions, *, measured: bool) -> None:
    """Refuse names that are not known, and options that do not go together."""
    check_choices(options, choices())
    if not measured:
        refuse(options, ("loss", "ridge", "against"), "belongs to DATA: nothing is fitted without them")
    if options.design is None:
        refuse(options, ("choose",), "belongs to --design FIRST:LAST:STEP")


def _plan(file: HarmonicFile, found: Identification | None, candidates: Speeds, choose: int | None) -> Design:
    """Choose frequencies for a model whose parameters are known roughly.

    Its `[start]` guesses what is not identified. The excitation is that of the experiments; without them
    every input has the amplitude 1.
    """
    from rotorid.identify.design import design
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
