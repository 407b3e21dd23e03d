"""`identify`: coefficients of a model from harmonic tests, natural frequencies and shapes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.base.answer import Answer
from rotorid.base.logs import workflows as log
from rotorid.base.text import listing
from rotorid.commands.amplitude_errors import amplitude_errors
from rotorid.report.options import check_choices, file_of, refuse
from rotorid.report.outcome import EQUATIONS, WITH_REPORT, Parts, command, phase, provenance, text_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from rotorid.base.registry import Method
    from rotorid.identify import Experiments, HarmonicModel, Identification
    from rotorid.report.equations import Equations
    from rotorid.tables import HarmonicFile

_NO_DATA = "give a table of measured amplitudes after the model file (only --show equations does without)"


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
    """

    loss: str = "linear"
    amplitude_error: float | None = None
    phase_error: float | None = None
    ridge: float | None = None
    panels: ClassVar[Mapping[str, str]] = {"Method": "loss ridge"}
    to: ClassVar[tuple[str, ...]] = (*WITH_REPORT, *EQUATIONS)


def choices() -> dict[str, tuple[Method[Any], ...]]:
    """What the options of these names choose from."""
    from rotorid.regression.robust import LOSSES

    return {"loss": LOSSES}


@dataclass(frozen=True, eq=False, kw_only=True)
class Coefficients(Parts):
    """What data say, or without them what these can determine at best; the model and its text."""

    identification: Identification | None
    model: HarmonicModel
    text: str = ""

    @property
    def parts(self) -> Mapping[str, Any]:
        """That one."""
        return {"": self.identification}

    @property
    def answer(self) -> Answer:
        """The identification, or what data can determine at best."""
        if self.identification is None:
            words = self.model.combinations.words
            return Answer(f"Data can determine at best {listing(words, 'and')}.", notes=(_NO_DATA,))
        return super().answer

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; without data what these can determine at best."""
        if self.identification is None:
            return {"combinations": list(self.model.combinations.words)}
        return super().to_dict()

    def to_frame(self) -> pd.DataFrame:
        """One row per parameter."""
        if self.identification is None:
            raise ValueError(_NO_DATA)
        return super().to_frame()

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

        if self.identification is None:
            raise ValueError(_NO_DATA)
        return identification_report(
            self.to_dict(), self.identification, provenance=self.provenance, model=self.text
        )


@command
def identify(
    model: HarmonicModel | HarmonicFile | Path | str,
    data: Experiments | Path | str | None = None,
    options: IdentifyOptions | None = None,
) -> Coefficients:
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
    from rotorid.identify import Experiments, HarmonicModel
    from rotorid.identify import identify as estimate
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
                bounds=file.bounds or None,
                loss=options.loss,
                start=file.start or None,
                prior=file.prior,
                ridge=options.ridge or 0.0,
            )
        log.info("degrees_of_freedom = %s", result.dof)
    return Coefficients(
        identification=result,
        model=file.model,
        text=text,
        provenance=provenance(files, options),
    )


def _check(options: IdentifyOptions, *, measured: bool) -> None:
    """Refuse names that are not known, and options that do not go together."""
    check_choices(options, choices())
    if not measured:
        refuse(options, ("loss", "ridge"), "belongs to DATA: nothing is fitted without them")
