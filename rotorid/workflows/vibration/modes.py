"""`modes`: natural frequencies, damping and shapes from amplitudes measured around resonances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from rotorid.commands.amplitude_errors import amplitude_errors
from rotorid.commands.input_checks import file_of
from rotorid.commands.outcome import Found, command, phase, provenance
from rotorid.commands.quantities import Band, band, one_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.harmonic.modal.modal_result import FittedModes

Excitation = Literal["force", "unbalance"]
"""What excites: the same, or as F, at every frequency; or growing with its square."""


@dataclass(frozen=True)
class ModesOptions:
    """Options of `modes`.

    Attributes
    ----------
    excitation
        A force (constant or in columns F; or a shaken base), or an unbalance, whose force grows with the
        square of the speed.
    bands : LIST
        Around each resonance, one mode in each: 120:150,500:580 in rad/s, or 20:25Hz,80:90Hz; default:
        around each peak.
    amplitude_error : PERCENT
        One standard deviation of an amplitude.
    phase_error : DEGREES
        One standard deviation of a phase.
    """

    excitation: Excitation
    bands: str | Sequence[Band] | None = None
    amplitude_error: float | None = None
    phase_error: float | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class ModesOfReadings(Found):
    """The modes that explain the readings."""

    found: FittedModes

    def figure(self) -> Figure:
        """Readings and fit around each resonance, in the complex plane and over frequency."""
        from rotorid.harmonic.modal.modal_plot import figure_modes

        return figure_modes(self.found)


@command
def modes(data: Path | str, options: ModesOptions) -> ModesOfReadings:
    """Fit natural frequencies, damping and shapes to amplitudes measured around resonances.

    Parameters
    ----------
    data
        Table of amplitudes and phases at some points.
    options
        What excites, and how.

    Raises
    ------
    ValueError
        For a table or an option that cannot be, and for readings without a resonance.
    """
    import numpy as np

    from rotorid.harmonic.modal.modal_fit import fit_modes
    from rotorid.harmonic.modal.modal_readings import SteadyAnswers
    from rotorid.tables.data.measurements import read_amplitudes

    one_of(options.excitation, "--excitation", get_args(Excitation))
    if (options.amplitude_error is None) != (options.phase_error is None):
        raise ValueError("--amplitude-error and --phase-error belong together")
    given = options.bands.split(",") if isinstance(options.bands, str) else options.bands or []
    sections = [found for each in given if (found := band(each, "--bands")) is not None]
    file = file_of(data, "a table of amplitudes")
    errors = amplitude_errors(None, options.amplitude_error, options.phase_error)
    experiments = read_amplitudes(file, errors)
    excitation = experiments.signals.get("F", np.ones(len(experiments), dtype=complex))
    if options.excitation == "unbalance":
        excitation = excitation * experiments.frequencies**2
    points = [name for name in experiments.signals if name != "F"]
    with phase("modes"):
        answers = SteadyAnswers(experiments.frequencies, excitation)
        fitted = fit_modes(experiments, points, answers, sections or None)
    return ModesOfReadings(found=fitted, provenance=provenance([file], options))
