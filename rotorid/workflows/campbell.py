"""`campbell`: whirl frequencies, logarithmic decrements and damped critical speeds over speed."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.text import counted
from rotorid.workflows.input_checks import rotor_source
from rotorid.workflows.option_values import Band, Speeds, band, rising_speeds
from rotorid.workflows.result_provenance import Parts, log_rotor, phase, provenance, workflow

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fem import Campbell, Rotor
    from rotorid.base.arrays import FloatArray


@dataclass(frozen=True)
class CampbellOptions:
    """Options of `campbell`.

    Attributes
    ----------
    speeds : SPEEDS
        FIRST:LAST:STEP or a list, rad/s; or with a unit: 500:15000:250rpm.
    number : N
        How many modes, by default 6; forward and backward whirl count apart.
    operating : A:B
        Operating speeds, such as 5300:6500rpm.
    """

    speeds: Speeds
    number: int | None = None
    operating: Band | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class CampbellDiagram(Parts):
    """Whirl over speed, and the operating range, rad/s."""

    whirl: Campbell
    operating: tuple[float, float] | None

    @property
    def parts(self) -> Mapping[str, Any]:
        """Whirl, and the critical speeds that show a peak beside the operating range."""
        from fem._new.campbell import HEAVY
        from fem.api684_separation import Separation, unsearched

        peaks = [speed for speed, damping in self.whirl.criticals if damping <= HEAVY]
        doubt = unsearched(self.whirl.speeds[0], self.whirl.speeds[-1], self.operating)
        doubt = doubt or ("the list may be cut, see the note" if self.whirl.cut else "")
        return {"": self.whirl, "operating": self.operating and Separation(peaks, self.operating, doubt)}

    def figure(self) -> Figure:
        """The Campbell diagram over the logarithmic decrements."""
        from fem.plots import campbell_figure

        return campbell_figure(self.whirl, self.operating)


@workflow
def campbell(rotor: Rotor | Path | str, options: CampbellOptions) -> CampbellDiagram:
    """Compute whirl frequencies, logarithmic decrements, directions and damped critical speeds.

    Parameters
    ----------
    rotor
        A rotor, a rotor table or a rotor file.
    options
        The speeds, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be.
    """
    import fem
    from fem.parameter_bands import band as error_band
    from fem.parameter_bands import nearest_modes

    operating = band(options.operating)
    model, files = rotor_source(rotor)
    speeds = rising_speeds(options.speeds)
    with phase(f"whirl at {counted(len(speeds), 'speed')}"):
        whirl = fem.campbell(model, speeds, options.number)

    def frequencies(other: Rotor) -> FloatArray:
        found = whirl if other is model else fem.campbell(other, speeds, options.number)
        return nearest_modes(whirl.frequencies, found.frequencies)

    std, said = error_band(model, "the frequencies", frequencies)
    whirl = dataclasses.replace(whirl, std=std, warnings=(*whirl.warnings, *said))
    log_rotor(model, speeds=len(speeds), estimated_relative_error=whirl.error)
    return CampbellDiagram(whirl=whirl, operating=operating, provenance=provenance(files, options))
