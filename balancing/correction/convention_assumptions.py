"""What is assumed about phases and angles, what the runs say to it, and what the other reading would give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from balancing.coefficients.convention_test import ConventionTest
from balancing.data.conventions import Labels
from rotorid.base.arrays import ComplexArray

_WHY = {
    "no redundant run": "The runs cannot tell: none is more than the planes need.",
    "weights in line": (
        "The runs cannot tell: the weights of each plane stand on one line through the shaft; one run with a "
        "weight at another angle would decide."
    ),
}


@dataclass(frozen=True, eq=False)
class OtherReading:
    """Weights that the same numbers give if a convention is otherwise.

    Attributes
    ----------
    words
        What is otherwise: "lag", "lag or against" (either of both alone).
    labels
        To print in: the angles are those that the job would write.
    weights, to_add
        As in `Correction`.
    """

    words: str
    labels: Labels
    weights: ComplexArray
    to_add: ComplexArray | None = None


def contradiction(test: ConventionTest, labels: Labels) -> tuple[str, ...]:
    """The warning where the runs contradict their conventions, stated or assumed."""
    if test.verdict != "contradicted":
        return ()
    own, other = _names(labels)
    fits = "fits" if test.other_fits else "is far nearer"
    return (
        f"these runs contradict {own!r}: χ² {test.chi_square:.3g} of {test.degrees_of_freedom}; "
        f"{other!r} {fits}: {test.chi_square_other:.3g}. Phases or angles count the other way than "
        f"{'is assumed' if labels.assumed else 'the job says'}, and the weights would go to wrong places",
    )


def assumptions(
    labels: Labels, test: ConventionTest | None, others: Sequence[OtherReading]
) -> tuple[str, ...]:
    """The first sentences of an answer: what is assumed, what the runs say to it, what to do otherwise."""
    if not labels.assumed:
        return ()
    said = [labels.assumed_in_words()]
    if test is not None:
        said.append(_told(test, labels))
    said += [f"If it is {o.words}, the weights go to the angles under “if {o.words}”." for o in others]
    if len(labels.assumed) == 2 and len(others) == 1:
        turned = labels.otherwise(labels.assumed)
        said.append(f"With {turned.phase} and {turned.angles} together the angles stay as they are.")
    return tuple(said)


def _told(test: ConventionTest, labels: Labels) -> str:
    if test.chi_square is None:
        return _WHY[test.verdict]
    own, other = _names(labels)
    sums = f"χ² {test.chi_square:.3g} of {test.degrees_of_freedom}; {other!r}: {test.chi_square_other:.3g}"
    both = f" for angles {labels.angle_words}" if len(labels.assumed) == 2 else ""
    return {
        "confirmed": f"The runs themselves confirm {own!r}{both}: {sums}.",
        "contradicted": f"The runs contradict it: {sums}.",
        "not told": f"The runs fit both, and cannot tell: {sums}.",
    }[test.verdict]


def _names(labels: Labels) -> tuple[str, str]:
    """The tested convention and its opposite: how angles count where that alone is assumed, else phases."""
    other = labels.otherwise(labels.assumed if labels.assumed == ("angles",) else ("phase",))
    return (labels.angles, other.angles) if labels.assumed == ("angles",) else (labels.phase, other.phase)
