"""Split of one given weight on the holes of one plane: the nearest vector that can be mounted.

The vector Σ_h a_h e^{iφ_h} nearest to a target, where a_h is what can stand in hole h, is found exactly
(`balancing.mounting.piece_sums`). Where there are too many of them (some thirty holes at odd angles with
several sizes of pieces), only so many holes vary about the rounded answer of the continuous problem; what a
few pieces make in all holes is tried besides, and `bound`, the error with free amounts up to the largest
content of each hole, says how much better anything could be.

This minimises the error of one weight. What is left of the vibration is minimised over all planes together in
`balancing.mounting.discrete_weights`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from balancing.data.conventions import Labels
from balancing.mounting.fewest_pieces import FEW, LITTLE
from balancing.mounting.free_amounts import FreeAmounts
from balancing.mounting.holes import Holes, Mounting, equal_together, mounting
from balancing.mounting.mountable_vectors import MOST, Attainable, nearest
from balancing.mounting.piece_sums import PieceSums
from rotorid.base.answer import Answer
from rotorid.base.arrays import IntArray
from rotorid.base.text import capital, counted, percent

_PROVEN = 1e-9
_TIE = 1e-10
_FEW = 4
"""So many pieces are tried in all holes where not every choice can be."""


@dataclass(frozen=True, eq=False)
class Split:
    """A weight split on holes.

    Attributes
    ----------
    target
        Wanted, kg or kg·m.
    holes
        What can be mounted.
    mounting
        What is to be mounted.
    error
        Mounted vector minus target.
    relative_error
        |error| by the size of the target (a target of 0: by what is mounted, or 0).
    bound
        No other choice has a smaller |error| than this.
    proven
        Whether nothing better exists: `bound` is |error|.
    best
        The nearest, where this one is of fewer pieces: `bound` is then its own, and `proven` says as well
        that no fewer pieces are good enough. None: this one.
    """

    target: complex
    holes: Holes
    mounting: Mounting
    error: complex
    relative_error: float
    bound: float
    proven: bool
    best: Split | None = None

    @property
    def pieces(self) -> int:
        """Number of pieces mounted; where amounts are free, of holes in use."""
        counts = self.mounting.counts
        return int(counts.sum()) if counts.shape[1] else int(np.count_nonzero(self.mounting.amounts))

    def lines(self, labels: Labels) -> list[str]:
        """What goes where, hole by hole, such as "2 × 10 g in hole 7 (at 120°)"."""
        out = []
        for h in np.flatnonzero(self.mounting.amounts):
            (angle,) = labels.directions(self.holes.angles[[h]])
            out.append(
                f"{self._content(int(h), labels)} in hole {self.holes.names[h]} (at {_degrees(angle)})"
            )
        why = "" if self.best else ": nothing that fits these holes is nearer to the wanted weight"
        return out or [f"nothing is mounted{why}"]

    def _content(self, h: int, labels: Labels) -> str:
        unit = labels.weight_in
        if self.holes.free_amounts:
            return f"{self.mounting.amounts[h] * labels.weight_scale:.6g} {unit}"
        return " + ".join(
            f"{n} × {piece * labels.weight_scale:.6g} {unit}"
            for n, piece in zip(self.mounting.counts[h], self.holes.pieces, strict=True)
            if n
        )

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, in the labels' unit and angles."""
        rows = []
        for h in np.flatnonzero(self.mounting.amounts):
            entry = labels.weight_entry(self.mounting.amounts[h] * np.exp(1j * self.holes.angles[h]))
            counts = self.mounting.counts[h]
            rows.append(
                {
                    "hole": self.holes.names[h],
                    "angle_deg": entry["angle_deg"],
                    "mass": entry["mass"],
                    "pieces": [
                        {"count": int(n), "mass": labels.weight_entry(piece)["mass"]}
                        for n, piece in zip(counts, self.holes.pieces, strict=bool(counts.size))
                        if n
                    ],
                }
            )
        return {
            "unit": labels.weight_unit,
            "angles": labels.angles,
            "target": labels.weight_entry(self.target),
            "holes": rows,
            "mounted": labels.weight_entry(self.mounting.vector),
            "error": labels.weight_entry(self.error),
            "relative_error": self.relative_error,
            "bound": self.bound * labels.weight_scale,
            "proven": self.proven,
            "number_of_pieces": self.pieces,
        }

    def in_holes(self, labels: Labels) -> list[str]:
        """The same with equal contents together: "1 × 10 g in holes 7 (120°), 9 (150°)"."""
        used = [int(h) for h in np.flatnonzero(self.mounting.amounts)]
        angles = labels.directions(self.holes.angles[used])
        return equal_together(
            (self._content(h, labels), f"{self.holes.names[h]} ({_degrees(angle)})")
            for h, angle in zip(used, angles, strict=True)
        )

    def answer(self, labels: Labels) -> Answer:
        """What goes where, what it makes, and what is missing."""
        made, wanted = labels.weight_at(self.mounting.vector), labels.weight_at(self.target)
        error = f"error {percent(self.relative_error)} %"
        error += f" ({labels.weight_at(self.error)})" if self.error else ""
        many = counted(self.pieces, "hole" if self.holes.free_amounts else "piece")
        what = f"in {many}" if self.holes.free_amounts else many
        lines = [f"  {words}" for words in self.in_holes(labels)]
        if self.best is not None:
            less = f"an error of {percent(self.best.relative_error)} %"
            lines.append(f"{counted(self.best.pieces, 'piece')} would leave {less} (--best).")
        if not self.proven:
            lines.append(
                f"These holes have more combinations than can be tried: nothing better than an error of "
                f"{self.bound * labels.weight_scale:.2g} {labels.weight_in} exists."
            )
        if not self.pieces:
            return Answer(f"{capital(self.lines(labels)[0])}, for {wanted}.", "\n".join(lines))
        return Answer(f"Mount {what}: {made} together, for {wanted}; {error}.", "\n".join(lines))


@dataclass(frozen=True, eq=False)
class OnHoles:
    """The vector chosen in the holes, and the nearest ones of fewer pieces."""

    nearest: Split
    fewer: tuple[Split, ...]

    def to_dict(self, labels: Labels) -> dict[str, Any]:
        """As JSON types, in the labels' unit and angles."""
        return {
            "method": "holes",
            **self.nearest.to_dict(labels),
            "words": self.nearest.lines(labels),
            "best": None if self.nearest.best is None else self.nearest.best.to_dict(labels),
            "fewer_pieces": [one.to_dict(labels) for one in self.fewer],
        }

    def rows(self, labels: Labels) -> list[dict[str, Any]]:
        """Each hole in use."""
        found = self.to_dict(labels)
        return [
            {
                "hole": row["hole"],
                "angle_deg": row["angle_deg"],
                f"mass_{labels.weight_unit}": row["mass"],
                "pieces": words.partition(" in hole")[0],
            }
            for row, words in zip(found["holes"], found["words"], strict=False)
        ]

    def answer(self, labels: Labels) -> Answer:
        """What goes where, and what fewer pieces can do."""
        nearest = self.nearest.answer(labels)
        lines = [nearest.found, *(["", "With fewer pieces:"] if self.fewer else [])]
        for one in self.fewer:
            words = "; ".join(one.in_holes(labels))
            lines.append(f"  {one.pieces}: error {percent(one.relative_error)} %: {words}")
        return replace(nearest, found="\n".join(lines))


def split_on_holes(
    target: complex,
    holes: Holes,
    *,
    most_pieces: int | None = None,
    good_enough: float = 0.0,
    within: float = FEW,
) -> OnHoles:
    """`split` and `fewer_pieces` together; where `within` is above 1 a fifth of the target is good enough."""
    good_enough = good_enough or (LITTLE if within > 1 else 0.0)
    found = split(target, holes, most_pieces=most_pieces, good_enough=good_enough, within=within)
    return OnHoles(found, tuple(fewer_pieces(found)))


def split(
    target: complex,
    holes: Holes,
    *,
    most_pieces: int | None = None,
    good_enough: float = 0.0,
    within: float = 1.0,
) -> Split:
    """Mount what makes the vector nearest to a target, with the fewest pieces among equally near ones.

    Parameters
    ----------
    target
        Wanted in addition to what is taken, kg or kg·m.
    holes
        What can be mounted.
    most_pieces
        At most so many pieces altogether; None: as many as help. Has no meaning for free amounts.
    good_enough
        Relative error that needs no more pieces: the nearest vector of the fewest pieces that keep to it; 0:
        the nearest of all. Has no meaning for free amounts.
    within
        So many times the least |error| needs no more pieces, either.

    Raises
    ------
    ValueError
        For a target that is not finite, a number of pieces below 1, a negative error, or where
        nothing admissible exists, not even mounting nothing.

    Examples
    --------
    >>> from balancing.mounting.holes import equal_holes, from_list
    >>> found = split(0.035j, from_list(equal_holes(12), [0.01, 0.02]), most_pieces=2)
    >>> found.lines(Labels(weight_unit="g", weight_scale=1e3))
    ['1 × 20 g in hole 3 (at 60°)', '1 × 20 g in hole 5 (at 120°)']
    """
    if not np.isfinite(target):
        raise ValueError(f"the weight to be split must be finite, not {target!r}")
    if most_pieces is not None and most_pieces < 1:
        raise ValueError(f"the number of pieces must be 1 or more, not {most_pieces!r}")
    if not good_enough >= 0:
        raise ValueError(f"the relative error that is good enough must not be negative, not {good_enough!r}")
    best = _nearest(complex(target), holes, most_pieces)
    size = abs(best.error)
    enough = max(size * within, good_enough * abs(target), size + _TIE * _scale(best.target, holes))
    if max(within - 1, good_enough) == 0 or holes.free_amounts or best.pieces == 0:
        return best
    few = _few(best, most_pieces, enough)
    if few.pieces == best.pieces:
        return best
    more = best if size < abs(few.error) else None  # otherwise it was not the nearest
    return replace(few, bound=best.bound, proven=best.proven and few.proven, best=more)


def _few(best: Split, most_pieces: int | None, enough: float) -> Split:
    """The nearest of the fewest pieces whose |error| is at most `enough`."""
    target, holes = best.target, best.holes
    sums = PieceSums(holes, holes.free, holes.max_weight, most_pieces)
    sums.aim(target)
    hit = sums.near(target, -1.0, enough, MOST) if sums.complete else None
    if hit is not None:
        number, distance = sums.pieces(hit[1]), np.abs(hit[0] - target)
        distance[number > number.min()] = np.inf
        tied = hit[1][distance <= distance.min() + _TIE * _scale(target, holes)]
        return _of(target, holes, _lightest(sums, tied, target), np.inf)
    if abs(target) <= enough and holes.allows(0.0):
        return _of(target, holes, mounting(holes), np.inf)
    each = (_nearest(target, holes, n) for n in range(1, best.pieces))
    return next((one for one in each if abs(one.error) <= enough), best)


def _nearest(target: complex, holes: Holes, most_pieces: int | None) -> Split:
    return _of(target, holes, *_mounted(target, holes, most_pieces))


def _of(target: complex, holes: Holes, mounted: Mounting, bound: float) -> Split:
    error = mounted.vector - target
    size = abs(error)
    bound = min(bound, size)
    against = abs(target) or abs(mounted.vector)
    return Split(
        target=target,
        holes=holes,
        mounting=mounted,
        error=error,
        relative_error=size / against if against > 0 else 0.0,
        bound=bound,
        proven=bool(size - bound <= _PROVEN * _scale(target, holes)),
    )


def _scale(target: complex, holes: Holes) -> float:
    return max(abs(target), holes.step, float(holes.pieces.max(initial=0.0)))


def _mounted(target: complex, holes: Holes, most_pieces: int | None) -> tuple[Mounting, float]:
    """The nearest vector, and a distance within which there is nothing else."""
    scale = _scale(target, holes)
    if not holes.free_amounts:
        sums = PieceSums(holes, holes.free, holes.max_weight, most_pieces)
        sums.aim(target)
        found = _lightest(sums, nearest(sums, target, _TIE * scale)[1], target)
        if sums.complete:
            return found, np.inf
        if most_pieces is None or most_pieces > _FEW:
            found = min((*_of_few(target, holes), found), key=lambda one: abs(one.vector - target))
        return found, sums.bound(target)
    needed = np.inf if np.isfinite(holes.max_weight) else 2 * scale
    amounts = FreeAmounts(holes, holes.free, holes.max_weight, needed)
    if not holes.step:
        return amounts.place_nearest(target), np.inf
    return _lightest(amounts, nearest(amounts, target, _TIE * scale)[1], target), np.inf


def _of_few(target: complex, holes: Holes) -> tuple[Mounting, ...]:
    """The nearest vector of a few pieces, if these make the plane light enough."""
    try:
        return (_mounted(target, holes, _FEW)[0],)
    except ValueError:
        return ()


def _lightest(one: Attainable, keys: IntArray, target: complex) -> Mounting:
    """Of these vectors that of the fewest pieces (or holes in use), then of the least weight."""
    scale = _scale(target, one.holes)
    toward = np.conj(target) / (abs(target) or 1.0)

    def cost(found: Mounting) -> tuple[float, ...]:
        number = found.counts.sum() if found.counts.size else np.count_nonzero(found.amounts)
        along = (toward * found.vector).real  # of equal weights that nearest to the direction of the target
        return float(number), round(found.amounts.sum() / scale, 9), round(-along / scale, 9)

    return min(map(one.mount, keys), key=cost)


def fewer_pieces(found: Split, most: int = _FEW) -> list[Split]:
    """The nearest vectors with 1, 2, … `most` pieces, as long as these are fewer than `found` has.

    Each is listed only where it is nearer to the target than those with fewer pieces; empty for free amounts.
    """
    out: list[Split] = []
    if found.holes.free_amounts:
        return out
    for n in range(1, min(most, found.pieces - 1) + 1):
        one = split(found.target, found.holes, most_pieces=n)
        if one.pieces == n:
            out.append(one)
    return out


def _degrees(angle: float) -> str:
    return f"{round(angle, 2) % 360:g}°"
