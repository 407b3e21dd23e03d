"""Where natural frequencies over tabulated supports meet the speed: all crossings, also two in one interval.

Eigenvalues λ of the conservative rotor rise with each stiffness. Between two speeds a and b a matrix
that is linear in speed lies between bounds (those of its ends where it only rises or falls): modes whose λ on
the lower bound exceeds b², or on the upper one stays below a², do not cross there. The others are told by
g = λ − Ω² at both ends and its slope: a curve that does not turn has one root or none; one
that turns towards zero is followed to its turning point.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from fem.matrices.banded_matrices import Matrices, assemble
from fem.matrices.undamped_matrices import Pencil, static_stiffness, whole_rotor
from fem.model.rotor import Rotor
from fem.solvers.bracketed_roots import bracketed_root
from fem.solvers.eigen import finite_modes, lowest_modes
from rotorid.base.arrays import AnyArray, FloatArray

_STEP = 1e-5  # of an interval, for a slope
_SHAPES = 1e-8  # tolerance of mode shapes; that of frequencies is its square
_MODES, _MODES_A_KNOT = 3000, 150  # computed at most, ten times what a rotor needs
_DEEP = 7  # halvings of an interval in which a mode may cross, one at least


@dataclass(frozen=True, eq=False)
class Found:
    """Critical speeds squared, and vectors of the pencil they belong to."""

    squares: FloatArray
    vectors: AnyArray
    pencil: Pencil
    rounding: FloatArray

    def only(self, which: slice) -> Found:
        """Some of them."""
        return Found(self.squares[which], self.vectors[:, which], self.pencil, self.rounding[which])


def positive_modes(pencil: Pencil, n: int, top: float = 0.0) -> Found:
    """Modes of positive mass, ascending: n at least, and one above the square `top`, as far as there are."""
    available, m = finite_modes(pencil), max(n, 1)
    while True:
        m = min(m, available)
        spectrum = lowest_modes(pencil.rotor, pencil.matrices, m, pencil, _SHAPES)
        real = np.flatnonzero(spectrum.squares >= 0)
        enough = real.size >= n and bool((spectrum.squares > top).any())
        if enough or m == available:
            break
        m = 2 * m + 2
    real = real[np.argsort(spectrum.squares[real], kind="stable")]
    return Found(spectrum.squares[real], spectrum.vectors[:, real], pencil, spectrum.rounding[real])


class TableSearch:
    """Crossings of a rotor with its matrices."""

    def __init__(self, rotor: Rotor, A: Matrices) -> None:
        self.rotor, self.A = rotor, A
        self.top = 1.01 * min(s.speeds[-1] for s in rotor.supports if s.speeds) ** 2
        self.known: dict[float, tuple[int, Found]] = {}
        self.listed = 1  # modes up to the end of the tables, as far as is known
        self.room = _MODES + _MODES_A_KNOT * rotor.knots.size

    def solve(self, rotor: Rotor, speed: float, n: int = 1) -> Found:
        """Modes on other supports up to the end of the tables, n at least."""
        A = self.A if rotor is self.rotor else assemble(rotor)
        found = positive_modes(whole_rotor(rotor, A, speed), max(n, self.listed), self.top)
        self.listed = max(1, int((found.squares <= self.top).sum()) + 1)
        self.room -= found.squares.size
        if self.room < 0:
            raise ValueError(
                f"{self.listed - 1} modes lie among the speeds of the tables, too many to tell their "
                "crossings apart: check masses and stiffnesses, or shorten the tables"
            )
        return found

    def at(self, speed: float, n: int = 1) -> Found:
        """Modes at a speed up to the end of the tables, n at least if the model has so many."""
        asked, found = self.known.get(speed, (0, None))
        if found is None or (found.squares.size < n and asked < n):
            found = self.solve(self.rotor, speed, n)
            self.known[speed] = n, found
        return found

    def between(self, a: float, b: float) -> list[tuple[float, int]]:
        """Crossings in an interval of the tables, (speed, mode from 0), ascending, its upper end excluded."""
        return sorted(self._halves(a, b, 0) if self.below(a) != self.below(b) else self._part(a, b, 0))

    def below(self, speed: float) -> int:
        """How many modes lie below a speed."""
        return int(np.count_nonzero(self.at(speed).squares < speed * speed))

    def _halves(self, a: float, b: float, depth: int) -> Iterator[tuple[float, int]]:
        middle = (a + b) / 2
        yield from self._part(a, middle, depth + 1)
        yield from self._part(middle, b, depth + 1)

    def _part(self, a: float, b: float, depth: int) -> Iterator[tuple[float, int]]:
        soft, stiff = self._bounds(a, b)
        # Modes that are not listed on the stiffer supports lie above the tables.
        doubtful = [k for k in range(soft.size) if soft[k] <= b * b and not (stiff[k : k + 1] < a * a).any()]
        roots: list[tuple[float, int]] = []
        for k in doubtful:
            found = self._roots(k, a, b, last=depth == _DEEP) if depth else None
            if found is None:
                yield from self._halves(a, b, depth)
                return
            roots += [(speed, k) for speed in found]
        yield from roots

    def _roots(self, k: int, a: float, b: float, *, last: bool) -> list[float] | None:
        """Crossings of one mode; None if its curve may turn twice."""

        def excess(speed: float) -> float:
            squares = self.at(speed, k + 1).squares
            return float(squares[k] if k < squares.size else 4 * self.top) - speed * speed

        def slope(speed: float) -> float:
            step = _STEP * (b - a) if speed < (a + b) / 2 else -_STEP * (b - a)
            return (excess(speed + step) - excess(speed)) / step

        (ga, gb), (da, db) = (excess(a), excess(b)), (slope(a), slope(b))
        if ga == 0:
            return [a]
        if (ga > 0) != (gb > 0):
            plain = da * (gb - ga) > 0 and db * (gb - ga) > 0
            if not (plain or last or gb == 0):
                return None
            return [bracketed_root(excess, (a, b), (ga, gb), 1e-11 * b)]
        if not (da * ga < 0 < db * ga):
            return []
        turn = bracketed_root(slope, (a, b), (da, db), 1e-10 * b)
        gt = excess(turn)
        if (gt > 0) == (ga > 0):
            return []
        return [
            bracketed_root(excess, ends, values, 1e-11 * ends[1])
            for ends, values in (((a, turn), (ga, gt)), ((turn, b), (gt, gb)))
        ]

    def _bounds(self, a: float, b: float) -> tuple[FloatArray, FloatArray]:
        """Squares of frequencies on the least and the largest stiffness between two speeds."""
        signs = set()
        soft, stiff = [], []
        for s in self.rotor.supports:
            if s.constant:
                soft.append(s)
                stiff.append(s)
                continue
            k, other = static_stiffness(s, a), static_stiffness(s, b)
            values, turn = np.linalg.eigh(other - k)
            signs |= {float(v) for v in np.sign(values)}
            low, high = (
                (turn * part) @ turn.T for part in (np.minimum(values, 0.0), np.maximum(values, 0.0))
            )
            for supports, matrix in ((soft, k + low), (stiff, k + high)):
                value = float(matrix[0, 0]) if s.symmetric else tuple(map(tuple, matrix.tolist()))
                supports.append(replace(s, stiffness=value, damping=0.0, speeds=(), kind="seal"))
        if not {1.0, -1.0} <= signs:
            ends = (self.at(a).squares, self.at(b).squares)
            return ends if -1.0 not in signs else ends[::-1]
        try:
            one, two = (
                self.solve(replace(self.rotor, supports=supports), a).squares for supports in (soft, stiff)
            )
        except ValueError:  # the lower bound may be no stiffness that a rotor can stand on
            count = max(self.at(a).squares.size, self.at(b).squares.size)
            return np.zeros(count), np.full(count, np.inf)
        return one, two
