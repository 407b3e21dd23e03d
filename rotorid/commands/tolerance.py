"""`tolerance`: permissible residual unbalance of a rigid rotor (ISO 21940-11)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rotorid.commands.option_units import grade, length, mass, positions, speed_with_unit, two_positions
from rotorid.report.outcome import WITHOUT_FILE, Outcome, command, outcome_of

if TYPE_CHECKING:
    from balancing import Tolerance
    from rotorid.commands.option_units import Amount, Positions


@dataclass(frozen=True)
class ToleranceOptions:
    """Options of `tolerance`.

    Attributes
    ----------
    mass : MASS
        Of the rotor, such as 500kg.
    speed : SPEED
        Highest service speed, such as 3000rpm.
    grade : GRADE
        Balance quality grade, G0.4 to G4000.
    planes : LIST
        One or two correction planes, with positions along the shaft or without: left=100mm,right=600mm.
    bearings : A,B
        Positions of both bearings, 0mm,700mm; default: the planes are the tolerance planes.
    centre : POSITION
        Of the centre of mass, such as 350mm.
    """

    mass: Amount
    speed: Amount
    grade: str | float
    planes: Positions | None = None
    bearings: str | tuple[float, float] | None = None
    centre: Amount | None = None
    to = WITHOUT_FILE


@command
def tolerance(options: ToleranceOptions) -> Outcome:
    """Permissible residual unbalance of a rigid rotor (ISO 21940-11), plane by plane.

    Positions count along the shaft from any point. Two planes without positions share it in equal parts.

    Example: rotorid tolerance --mass 500kg --speed 3000rpm --grade G2.5

    Example: rotorid tolerance --mass 500kg --speed 3000rpm --grade G2.5
    --planes left=100mm,right=600mm --bearings 0mm,700mm --centre 320mm --plot tolerance.png

    Parameters
    ----------
    options
        The rotor, its speed and its grade.

    Raises
    ------
    ValueError
        For an option that cannot be.
    """
    from balancing.plots import draw_tolerance
    from rotorid.base.plot_style import on_figure

    result = permissible(options)
    return outcome_of(
        result,
        pictures={"Permissible unbalance.": lambda: on_figure(lambda ax: draw_tolerance(result, ax))},
        title="Tolerance",
    )


def permissible(options: ToleranceOptions, names: tuple[str, str] = ("--mass", "--speed")) -> Tolerance:
    """The tolerance of a rotor; `names` of mass and speed for complaints.

    Raises
    ------
    ValueError
        For a quantity or a grade that cannot be.
    """
    import balancing

    planes, bearings, centre = options.planes, options.bearings, options.centre
    return balancing.tolerance(
        mass(options.mass, names[0]),
        speed_with_unit(options.speed, names[1]),
        grade(options.grade),
        planes=None if planes is None else positions(planes),
        bearings=None if bearings is None else two_positions(bearings),
        centre=None if centre is None else length(centre, "--centre", "350mm"),
    )
