"""Groups of planes with weights of fixed ratios and angles, such as static and couple, as unknowns.

Shares G (P, U) of U unknowns put the weights D = G q into P planes. Readings see Y₀ + W D = Y₀ + (W G) q: to
a method an unknown is a plane with the coefficients W G, and (Y₀, W G) errs by the same linear map of what
(Y₀, W) errs by. Where G is square the unknowns are the weights in other coordinates: the planes are solved
for, and q = G⁻¹ D is shown. Otherwise D = G q is what the weights must keep to.

Trial weights in groups alone give V = W G. V G⁺ then stands for W: it is right for weights G q, and says
nothing of others.

Two planes without groups are shown as the static part S = D₁ + D₂ and the couple C = (D₁ − D₂)/2: S/2 in both
planes, and C in the first with −C in the second.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.linalg import norm

from balancing.influence import Influence
from balancing.trials import Limits, Trials
from rotorid.base.arrays import ComplexArray
from rotorid.base.choices import did_you_mean
from rotorid.base.text import listing, percent

Groups = Mapping[str, Mapping[str, complex]]
"""By group: the weight in each of its planes where that of the group is 1."""
ROUNDING = 1e-9
PIECES = 0.2
"""Share of what is mounted that may be beside groups: pieces are not exactly what they stand for."""


class Unknowns(NamedTuple):
    """Groups and planes whose weights are sought.

    Attributes
    ----------
    names
        Of U groups and planes.
    planes
        P, that they put weights into.
    shares
        G, (P, U).
    """

    names: tuple[str, ...]
    planes: tuple[str, ...]
    shares: ComplexArray

    @property
    def constrained(self) -> bool:
        """Whether they hold weights of planes together."""
        return len(self.names) < len(self.planes)

    @property
    def inverse(self) -> ComplexArray:
        """G⁺ (U, P)."""
        return np.asarray(np.linalg.pinv(self.shares))

    def limits(self, limits: Limits) -> Limits:
        """Limits as those of the unknowns.

        Parameters
        ----------
        limits
            Of the planes, in their order.

        Raises
        ------
        ValueError
            For a limited plane that is in several of them.
        """
        each = zip(self.planes, self.shares, limits.max_weight, limits.forbidden, strict=True)
        for plane, row, largest, forbidden in each:
            if np.count_nonzero(row) > 1 and (np.isfinite(largest) or forbidden):
                several = listing((repr(self.names[u]) for u in np.flatnonzero(row)), "and")
                raise ValueError(
                    f"plane {plane!r} is in {several}, so that its limits of weight and angles cannot be "
                    "kept: take these away, or leave one out"
                )
        with np.errstate(divide="ignore"):  # planes that an unknown leaves alone
            most = limits.max_weight[:, None] / np.abs(self.shares)
        arcs = [
            tuple(
                (start - np.angle(share), width)
                for share, forbidden in zip(column, limits.forbidden, strict=True)
                for start, width in (forbidden if share else ())
            )
            for column in self.shares.T
        ]
        return Limits(most.min(axis=0), limits.residual, tuple(arcs))

    def of_runs(self, trials: Trials, allowed: float = PIECES) -> Trials:
        """Runs with weights as those of the unknowns.

        Parameters
        ----------
        trials
            With weights in planes.
        allowed
            Share of the weights that may be beside the unknowns.

        Raises
        ------
        ValueError
            Where more is beside them.
        """
        planes = tuple(dict.fromkeys((*self.planes, *trials.planes)))
        weights = np.zeros((len(trials.runs), len(planes)), dtype=complex)
        weights[:, [planes.index(plane) for plane in trials.planes]] = trials.weights
        inside = weights[:, : len(self.planes)]
        q = inside @ self.inverse.T
        inside -= q @ self.shares.T
        beside = float(norm(weights) / (norm(trials.weights) or 1.0))
        if beside > max(allowed, ROUNDING):
            raise ValueError(
                f"{percent(beside)} % of what is mounted is beside {listing(map(repr, self.names), 'and')}, "
                "and what that does is not known: it takes trial weights in the planes themselves"
            )
        return replace(trials, planes=self.names, weights=q)


def held(groups: Groups, names: Sequence[str]) -> Unknowns | None:
    """Unknowns that do not tell planes apart; None: they do.

    Parameters
    ----------
    groups, names
        As of `unknowns`.
    """
    try:
        of = unknowns(groups, names)
    except ValueError:  # none, or more than the planes need
        return None
    return of if of.constrained else None


def members(groups: Groups, names: Sequence[str]) -> tuple[str, ...]:
    """The planes of groups and planes."""
    return tuple(dict.fromkeys(plane for name in names for plane in groups.get(name, (name,))))


def in_planes(trials: Trials, groups: Groups) -> Trials:
    """Runs with all weights in planes.

    Parameters
    ----------
    trials
        With weights in planes or groups.
    groups
        As of `unknowns`.
    """
    planes = members(groups, trials.planes)
    return replace(trials, planes=planes, weights=trials.weights @ _shares(groups, trials.planes, planes).T)


def _shares(groups: Groups, names: Sequence[str], planes: Sequence[str]) -> ComplexArray:
    """What groups and planes put into planes, (P, U)."""
    each = [[groups.get(name, {name: 1.0}).get(plane, 0.0) for name in names] for plane in planes]
    return np.reshape(np.array(each, dtype=complex), (len(planes), len(names)))


def unknowns(groups: Groups, names: Sequence[str], planes: Sequence[str] | None = None) -> Unknowns:
    """Groups and planes of these names as unknowns.

    Parameters
    ----------
    groups
        All groups.
    names
        Of groups, or else of planes.
    planes
        Those there are, in their order; None: those that the names put weights into.

    Raises
    ------
    ValueError
        For a name or a plane of a group that is not there, and for unknowns that depend on each other.
    """
    inside = members(groups, names)
    there = tuple(planes or inside)
    if lost := next((plane for plane in inside if plane not in there), None):
        of = next(name for name in names if lost in members(groups, [name]))
        what = f"in the group {of!r}" if of in groups else f"nor a group{did_you_mean(of, [*there, *groups])}"
        raise ValueError(f"there is no plane {lost!r}, {what}; the planes are {', '.join(map(repr, there))}")
    order = tuple(plane for plane in there if plane in inside)
    shares = _shares(groups, names, order)
    if np.linalg.matrix_rank(shares) < len(names):
        several = listing(map(repr, names), "and")
        raise ValueError(f"{several} are too many for planes {', '.join(map(repr, order))}: leave one out")
    return Unknowns(tuple(names), order, shares)


def static_and_couple(planes: Sequence[str]) -> Unknowns | None:
    """Of two planes."""
    shares = np.array([[0.5, 1.0], [0.5, -1.0]], dtype=complex)
    return Unknowns(("static", "couple"), tuple(planes), shares) if len(planes) == 2 else None


def mapped(
    influence: Influence, names: Sequence[str], shares: ComplexArray, first: Sequence[float] = (1.0,)
) -> Influence:
    """The coefficients W G of other unknowns, with their errors.

    Parameters
    ----------
    influence
        Of P planes.
    names, shares
        Of U unknowns, and G (P, U).
    first
        What the baseline is of Y₀, W₁, …; default Y₀.
    """
    change = np.zeros((shares.shape[1] + 1, shares.shape[0] + 1), dtype=complex)
    change[0, : len(first)], change[1:, 1:] = first, shares.T
    errors, there = influence.errors, influence.mounted
    mounted = there._replace(planes=tuple(names), weights=np.linalg.pinv(shares) @ there.weights)
    errors = errors._replace(noise=errors.noise.changed(change), mounted=mounted)
    baseline = first[0] * influence.baseline + influence.W @ change[0, 1:]
    W = influence.W @ shares
    return replace(influence, planes=tuple(names), W=W, baseline=baseline, errors=errors)
