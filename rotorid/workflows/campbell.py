"""`campbell`: whirl frequencies, logarithmic decrements and damped critical speeds over speed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.text import counted
from rotorid.workflows.given import rotor_source
from rotorid.workflows.outcome import Outcome, log_rotor, phase, provenance, workflow
from rotorid.workflows.parameters import Band, Speeds, band, rising_speeds

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fem import Campbell, Rotor


@dataclass(frozen=True)
class CampbellOptions:
    """Options of `campbell`.

    Attributes
    ----------
    speeds
        FIRST:LAST:STEP or a list, rad/s; or with a unit: 500:15000:250rpm.
    number
        How many modes, by default 6; forward and backward whirl count apart.
    operating : A:B
        Operating speeds, such as 5300:6500rpm.
    """

    speeds: Speeds
    number: int | None = None
    operating: Band | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class CampbellDiagram(Outcome):
    """Whirl over speed, and the operating range, rad/s."""

    whirl: Campbell
    operating: tuple[float, float] | None

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance."""
        beside = self._separation()
        return self.whirl.to_dict() | ({} if beside is None else {"operating": beside})

    def summary(self) -> str:
        """For the terminal."""
        from fem.separation import separation_text

        beside = self._separation()
        return "\n".join([self.whirl.summary(), *([] if beside is None else [separation_text(beside)])])

    def to_frame(self) -> pd.DataFrame:
        """One row per speed and mode."""
        return self.whirl.to_frame()

    def figure(self) -> Figure:
        """The Campbell diagram over the logarithmic decrements."""
        from fem.plots import campbell_figure

        unstable = [(window.first, window.last) for window in self.whirl.windows]
        return campbell_figure(self.whirl, self.whirl.criticals, operating=self.operating, unstable=unstable)

    def _separation(self) -> dict[str, Any] | None:
        """Of the critical speeds that show a peak."""
        from fem.campbell import HEAVY
        from fem.separation import separation

        if self.operating is None:
            return None
        peaks = [speed for speed, damping in self.whirl.criticals if damping <= HEAVY]
        return separation(peaks, self.operating)


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

    operating = band(options.operating)
    model, files = rotor_source(rotor)
    speeds = rising_speeds(options.speeds)
    with phase(f"whirl at {counted(len(speeds), 'speed')}"):
        whirl = fem.campbell(model, speeds, options.number)
    log_rotor(model, speeds=len(speeds), estimated_relative_error=whirl.error)
    return CampbellDiagram(whirl=whirl, operating=operating, provenance=provenance(files, options))
