"""What may differ between machines by more than 1e-9 of the largest of its array, and why."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerance:
    """A place that may differ more.

    Attributes
    ----------
    case
        Pattern of names of cases.
    place
        Pattern (`fnmatch`) of the path of an array in a document, as `corrections.covariance`, or of a line
        of text with `#` for every decimal.
    reason
        Why.
    relative
        Of the largest of the array; in a text, of the number.
    absolute
        In its unit.
    """

    case: str
    place: str
    reason: str
    relative: float = 0.0
    absolute: float = 0.0


TOLERANCES: tuple[Tolerance, ...] = ()
