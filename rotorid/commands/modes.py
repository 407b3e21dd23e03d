"""`modes`: natural frequencies, damping and shapes from amplitudes measured around resonances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from rotorid.base.tables import Column, Table
from rotorid.base.text import SPEEDS, counted, error_figures, listing
from rotorid.commands.option_units import Errors, amplitude_errors
from rotorid.commands.option_values import Band, band, one_of
from rotorid.report.options import file_of
from rotorid.report.outcome import USUAL, Outcome, command

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.base.arrays import ComplexArray
    from rotorid.identify.modes_result import FittedModes, Readings

Excitation = Literal["force", "unbalance"]
"""What excites: the same, or as F, at every frequency; or growing with its square."""


@dataclass(frozen=True)
class ModesOptions:
    """Options of `modes`.

    Attributes
    ----------
    excitation
        A force (constant or in columns F; or a shaken base), or an unbalance, whose force grows with the
        square of the speed; default: force, where there are columns F.
    bands : LIST
        Around each resonance, one mode in each: 120:150,500:580 in rad/s, or 20:25Hz,80:90Hz; default:
        around each peak.
    errors : PERCENT,DEGREES
        One standard deviation of an amplitude and of a phase: 2,1.
    """

    excitation: Excitation | None = None
    bands: str | Sequence[Band] | None = None
    errors: Errors | None = None
    to = USUAL


@command
def modes(data: Path | str, options: ModesOptions | None = None) -> Outcome:
    """Natural frequencies, damping and shapes from amplitudes around resonances, with ±.

    The table of modes is for `reduce --measured`, and for `identify` in place of amplitudes.

    Example: rotorid modes sample_data/modes/amplitudes.csv --excitation force --errors 2,1
    --output modes.csv

    Parameters
    ----------
    data : AMPLITUDES
        Table, .csv or .xlsx: frequency, amplitude and phase (lead) at some points.
    options
        What excites, and how.

    Raises
    ------
    ValueError
        For a table or an option that cannot be, and for readings without a resonance.
    """
    from rotorid.identify.answers import SteadyAnswers
    from rotorid.identify.modes import fit_modes

    options = options or ModesOptions()
    file = file_of(data, "a table of amplitudes")
    readings, force = _read(file, options)
    fit = fit_modes(readings, SteadyAnswers(readings.speeds, force), bands(options.bands) or None)

    def picture() -> Figure:
        from rotorid.identify.plots import figure_modes

        return figure_modes(fit)

    lacking = next(iter(fit.undetermined), "")
    return Outcome(
        result=fit,
        sentences=(_sentence(fit),),
        tables=() if lacking else _tables(fit),
        file=f"there is no table of modes: {lacking}" if lacking else fit.file_table(),
        keys=fit.to_dict(),
        pictures={"Readings and fit around each resonance.": picture},
        title="Modes",
        warnings=fit.warnings,
        notes=() if lacking else fit.notes,
    )


def bands(given: str | Sequence[Band] | None, usual: str = "rad_s") -> list[tuple[float, float]]:
    """Read "120:150,500:580" as ranges around resonances, rad/s; nothing, where none is given."""
    parts = given.split(",") if isinstance(given, str) else given or []
    return [ends for part in parts if (ends := band(part, "--bands", usual)) is not None]


def _read(file: Path, options: ModesOptions) -> tuple[Readings, ComplexArray]:
    """The amplitudes, and what excites them."""
    import numpy as np

    from balancing import Labels
    from rotorid.files.measurements import read_amplitudes
    from rotorid.identify.modes_result import Readings

    errors = amplitude_errors(None, options.errors)
    table = read_amplitudes(file)
    if options.excitation is not None:
        one_of(options.excitation, "--excitation", get_args(Excitation))
    elif "F" not in table.signals:
        raise ValueError(
            "--excitation force or unbalance: the table has no columns F, and an unbalance excites with the "
            "square of the speed"
        )
    points = tuple(name for name in table.signals if name != "F")
    force = table.signals.get("F", np.ones(len(table), dtype=complex))
    power = 2 if options.excitation == "unbalance" else 0
    unit = next((table.units[name] for name in points if name in table.units), None)
    labels = Labels(
        vibration_unit=unit.word if unit else "unit of the data",
        vibration_scale=unit.scale if unit else 1.0,
        speed_unit=table.axis.word.rpartition(", ")[2].replace("/", "_"),
    )
    shares = (errors.relative, errors.phase) if errors else None
    return (
        Readings("", None, table.frequencies, points, table.table(points), labels=labels, shares=shares),
        force * table.frequencies**power,
    )


def _sentence(fit: FittedModes) -> str:
    """How many modes, and where."""
    if fit.undetermined:
        return "Not every mode is determined: no table of modes."
    labels = fit.readings.labels
    words = [f"{SPEEDS[labels.speed_unit][1] * omega:.5g}" for omega in fit.values[0]]
    return f"{counted(len(words), 'mode')}: {listing(words, 'and')} {labels.speed_in}."


def _tables(fit: FittedModes) -> tuple[Table, Table]:
    """Frequencies and damping, and shapes."""
    shapes = [Column("point", fit.readings.sensors)]
    for mode, (shape, std) in enumerate(zip(fit.shapes, fit.shape_std, strict=True), 1):
        shapes += (
            Column(f"shape {mode}", shape, "{:.4g}".format),
            Column("±", abs(shape) * std, error_figures),
        )
    return Table("modes", frequencies(fit, "ω, rad/s")), Table("shapes", tuple(shapes))


def frequencies(fit: FittedModes, heading: str, scale: float = 1.0) -> tuple[Column, ...]:
    """A row a mode: its frequency in a unit of which 1 rad/s has `scale`, and its damping."""
    omega, zeta, error, other = fit.values
    return (
        Column("mode", range(1, len(omega) + 1)),
        Column(heading, scale * omega, "{:.7g}".format),
        Column("±", scale * error, error_figures),
        Column("ζ, %", 100 * zeta, "{:.4g}".format),
        Column("± ", 100 * other, error_figures),
    )
