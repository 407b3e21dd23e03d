"""`campbell`: whirl frequencies, logarithmic decrements and damped critical speeds over speed."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rotorid.base.text import counted
from rotorid.commands.input_checks import rotor_source
from rotorid.commands.outcome import Outcome, command, log_rotor, phase, provenance
from rotorid.commands.quantities import Band, Speeds, band, rising_speeds

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.base.arrays import FloatArray


@dataclass(frozen=True)
class CampbellOptions:
    """Options of `campbell`.

    Attributes
    ----------
    speeds : SPEEDS
        FIRST:LAST:STEP or a list, rad/s; or with a unit: 500:15000:250rpm.
    number : -n N from 1
        How many modes, by default 6; forward and backward whirl count apart.
    operating : A:B
        Operating speeds, such as 5300:6500rpm.
    """

    speeds: Speeds
    number: int | None = None
    operating: Band | None = None


@command
def campbell(rotor: Rotor | Path | str, options: CampbellOptions) -> Outcome:
    """Whirl frequencies, decrements and directions over speed; damped critical speeds.

    The picture is a Campbell diagram with the 1× line, over the logarithmic decrements.

    Example: rotorid campbell sample_data/compressor/rotor.toml --speeds 1000:15000:250rpm --plot campbell.png

    Parameters
    ----------
    rotor : ROTOR
        Rotor table (.csv, .xlsx) or rotor file (.toml).
    options
        The speeds, and what differs from the defaults.

    Raises
    ------
    ValueError
        For a rotor or an option that cannot be.
    """
    import fem
    from fem.api684_separation import Separation, unsearched
    from fem.campbell import HEAVY
    from fem.parameter_bands import band as error_band
    from fem.parameter_bands import nearest_modes
    from fem.plots import campbell_figure

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
    asked = {}
    if operating:
        doubt = unsearched(speeds[0], speeds[-1], operating)
        doubt = doubt or ("the list may be cut, see the note" if whirl.cut else "")
        peaks = [speed for speed, damping in whirl.criticals if damping <= HEAVY]
        asked["operating"] = Separation(peaks, operating, doubt)
    criticals, *ends, every = whirl.tables()
    return Outcome(
        result=whirl,
        sentences=(
            *whirl.sentence().splitlines(),
            *(part.sentence() for part in asked.values()),
        ),
        tables=(criticals,) if whirl.critical_speeds.size else (),
        more=(*(one for part in asked.values() for one in part.tables()), *ends),
        file=every,
        keys={**whirl.to_dict(), **{key: part.to_dict() for key, part in asked.items()}},
        warnings=whirl.warnings,
        notes=(whirl.cut,) if whirl.cut else (),
        pictures={
            "Campbell diagram over the logarithmic decrements.": lambda: campbell_figure(whirl, operating)
        },
        title="Whirl",
        rotor={"rotor": model},
        provenance=provenance(files, options),
    )
