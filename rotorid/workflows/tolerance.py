"""`tolerance`: permissible residual unbalance of a rigid rotor (ISO 21940-11)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rotorid.commands.outcome import command, provenance
from rotorid.workflows.result_provenance import Found

if TYPE_CHECKING:
    from balancing.iso21940 import Tolerance
    from rotorid.workflows.option_quantities import Amount, Positions


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


@dataclass(frozen=True, eq=False, kw_only=True)
class PermissibleUnbalance(Found):
    """The tolerance of a rotor and of its planes."""

    found: Tolerance


@command
def tolerance(options: ToleranceOptions) -> PermissibleUnbalance:
    """Compute the permissible residual unbalance of a rigid rotor, and the share of each plane.

    Raises
    ------
    ValueError
        For an option that cannot be.
    """
    shaft = options.planes, options.bearings, options.centre
    found = permissible(options.mass, options.speed, options.grade, *shaft)
    return PermissibleUnbalance(found=found, provenance=provenance((), options))


def permissible(
    rotor_mass: Amount,
    speed: Amount,
    grade: str | float,
    planes: Positions | None,
    bearings: str | tuple[float, float] | None,
    centre: Amount | None,
    *,
    names: tuple[str, str] = ("--mass", "--speed"),
) -> Tolerance:
    """The tolerance of a rotor from quantities as people write them; `names` of the first two for complaints.

    Raises
    ------
    ValueError
        For a quantity or a grade that cannot be.
    """
    from balancing.iso21940 import tolerance as of_numbers
    from rotorid.workflows.option_quantities import length, mass, positions, speed_with_unit, two_positions

    return of_numbers(
        mass(rotor_mass, names[0]),
        speed_with_unit(speed, names[1]),
        grade,
        planes=None if planes is None else positions(planes),
        bearings=None if bearings is None else two_positions(bearings),
        centre=None if centre is None else length(centre, "--centre", "350mm"),
    )
