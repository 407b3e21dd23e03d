"""`identify`: coefficients of a model from harmonic tests, natural frequencies and shapes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.text import listing
from rotorid.commands.option_units import Errors, amplitude_errors
from rotorid.report.options import file_of
from rotorid.report.outcome import EQUATIONS, WITH_REPORT, Outcome, command, outcome_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.files import HarmonicFile
    from rotorid.identify import Experiments, HarmonicModel

_NO_DATA = "give a table of measured amplitudes after the model file (only --show equations does without)"


@dataclass(frozen=True)
class IdentifyOptions:
    """Options of `identify`.

    Attributes
    ----------
    errors : PERCENT,DEGREES
        One standard deviation of an amplitude and of a phase, in place of those that the model states: 2,1.
    """

    errors: Errors | None = None
    to = (*WITH_REPORT, *EQUATIONS)


@command
def identify(
    model: HarmonicModel | HarmonicFile | Path | str,
    data: Experiments | Path | str | None = None,
    options: IdentifyOptions | None = None,
) -> Outcome:
    """Coefficients of a model from harmonic tests, with ±, or what the data do tell.

    Example: rotorid identify sample_data/identify/task_5_1/model.toml sample_data/identify/task_5_1/data.csv

    Parameters
    ----------
    model : MODEL.toml
        Equations, known numbers, what to estimate.
    data : DATA
        Measured amplitudes, .csv or .xlsx; --show equations does without.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For files, options or data that cannot be.
    """
    from rotorid.files import HarmonicFile, read_harmonic_model, read_measurements
    from rotorid.identify import Experiments, HarmonicModel
    from rotorid.identify import identify as estimate

    options = options or IdentifyOptions()
    if isinstance(model, HarmonicModel):
        model = HarmonicFile(model)
    elif not isinstance(model, HarmonicFile):
        model = read_harmonic_model(file_of(model, "a model"))
    file = replace(model, errors=amplitude_errors(model.errors, options.errors))
    if data is None:
        return _at_best(file.model)
    if not isinstance(data, Experiments):
        data = read_measurements(file_of(data, "a table of amplitudes"), file)
    result = estimate(
        file.model,
        data,
        bounds=file.bounds or None,
        start=file.start or None,
        prior=file.prior,
    )

    def picture() -> Figure:
        from rotorid.identify.plots import figure_identification

        return figure_identification(result)

    return outcome_of(
        result,
        pictures={"Amplitudes or shapes, measured and predicted.": picture},
        title="Coefficients from harmonic tests",
        solved=result,
    )


def _at_best(model: HarmonicModel) -> Outcome:
    """What data can determine at best."""
    words = list(model.combinations.words)
    return Outcome(
        result=model,
        sentences=(f"Data can determine at best {listing(words, 'and')}.",),
        notes=(_NO_DATA,),
        keys={"combinations": words},
        file=_NO_DATA,
        solved=model,
    )
