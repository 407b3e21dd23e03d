"""Free amounts in one hole or in two neighbouring ones: the vector nearest to a target.

In one or two neighbouring free holes less than half a turn apart, amounts a e^{iα} + b e^{iβ}, a, b ≥ 0,
fill the sector between them. With a step both are its multiples: for every possible a the best b follows by
rounding on a line, and only those a can be better than the best known error d whose line passes the target
within d.
"""

from __future__ import annotations

import numpy as np

from balancing.mounting.holes import WIDEST, Holes
from rotorid.base.arrays import FloatArray, IndexArray

_SLACK = 1e-12
_MOST = 1_000_000
_Parts = list[tuple[int, float]]  # (hole, amount)
_Found = tuple[float, _Parts]  # error first


def nearest_amounts(target: complex, holes: Holes) -> FloatArray:
    """Amounts (H,) of the nearest vector; of equally near ones that with fewer holes.

    Raises
    ------
    ValueError
        Where nothing is admissible, not even to mount nothing, or a step so fine that it means nothing.
    """
    best = _better(None, [], target, holes)
    wanted = nearest_allowed(target, holes)
    free = np.flatnonzero(holes.free)
    for k in free:
        alone = _on_ray(target, np.exp(1j * holes.angles[k]), 0j, holes)
        if alone is not None:
            best = _better(best, [(int(k), alone)], target, holes)
    for g, h in _neighbours(target, holes, free):
        if holes.step > 0:
            pairs = _lattice(target, g, h, holes, np.inf if best is None else best[0])
        else:
            pairs = [_coordinates(point, holes.angles[g], holes.angles[h]) for point in {target, wanted}]
        for a, b in pairs:
            if min(a, b) >= 0:
                best = _better(best, [(g, a), (h, b)], target, holes)
    if best is None:
        raise ValueError(
            "no admissible weight at all: what is mounted already exceeds the largest weight of the plane, "
            "and nothing that fits these holes makes it small enough"
        )
    amounts = np.zeros(len(holes.angles))
    for h, amount in best[1]:
        amounts[h] = amount
    return amounts


def nearest_allowed(target: complex, holes: Holes) -> complex:
    """The vector nearest to the target for which the plane's total stays within its largest weight."""
    total = holes.mounted + target
    if abs(total) <= holes.max_weight:
        return target
    return total / abs(total) * holes.max_weight - holes.mounted


def _better(best: _Found | None, parts: _Parts, target: complex, holes: Holes) -> _Found | None:
    """The best so far, or these amounts where they are nearer, or as near in fewer holes."""
    parts = [(h, a) for h, a in parts if a > 0]
    vector = sum((a * np.exp(1j * holes.angles[h]) for h, a in parts), 0j)
    if not holes.allows(vector):
        return best
    error, slack = abs(vector - target), _SLACK * max(abs(target), holes.step)
    if best is None or error < best[0] - slack:
        return error, parts
    return (error, parts) if error <= best[0] + slack and len(parts) < len(best[1]) else best


def _neighbours(target: complex, holes: Holes, free: IndexArray) -> list[tuple[int, int]]:
    """Pairs of neighbouring free holes at most `WIDEST` apart, the first one behind."""
    toward = np.cos(holes.angles - np.angle(target))
    turned = np.mod(holes.angles[free], 2 * np.pi)
    order = np.argsort(turned, kind="stable")
    pairs = []
    for k in range(len(order)):
        g, h = order[k], order[(k + 1) % len(order)]
        if g != h and np.mod(turned[h] - turned[g], 2 * np.pi) <= WIDEST:
            pairs.append((int(free[g]), int(free[h])))
    # the pair around the target first: its error leaves little to look for in the others
    return sorted(pairs, key=lambda pair: -(toward[pair[0]] + toward[pair[1]]))


def _coordinates(point: complex, alpha: float, beta: float) -> tuple[float, float]:
    """Amounts (a, b) with a e^{iα} + b e^{iβ} = point; what is only rounding is 0."""
    wide = np.sin(beta - alpha)
    a = (point * np.exp(-1j * beta)).imag / -wide
    b = (point * np.exp(-1j * alpha)).imag / wide
    tiny = 1e-14 * abs(point) / abs(wide)
    return (0.0 if abs(a) <= tiny else float(a)), (0.0 if abs(b) <= tiny else float(b))


def _on_ray(target: complex, way: complex, base: complex, holes: Holes) -> float | None:
    """The amount ≥ 0 in direction `way`, on top of `base`, nearest to the target; None: none is allowed.

    |m + a e| ≤ R with m = mounted + base is an interval of a, found from the quadratic equation.
    """
    wanted = ((target - base) * np.conj(way)).real
    low, high = 0.0, np.inf
    if np.isfinite(holes.max_weight):
        m = (holes.mounted + base) * np.conj(way)
        inside = (holes.max_weight * (1 + _SLACK)) ** 2 - m.imag**2
        if inside < 0:
            return None
        low, high = max(0.0, -m.real - np.sqrt(inside)), -m.real + np.sqrt(inside)
        if high < low:
            return None
    if holes.step == 0:
        return float(np.clip(wanted, low, high))
    first, last = np.ceil(low / holes.step - 1e-9), np.floor(high / holes.step + 1e-9)
    if last < first:
        return None
    return float(np.clip(np.round(wanted / holes.step), first, last) * holes.step)


def _lattice(target: complex, g: int, h: int, holes: Holes, known: float) -> list[tuple[float, float]]:
    """The best multiples (a, b) of the step in two holes whose error can be below a known one."""
    alpha, beta = holes.angles[g], holes.angles[h]
    wide = abs(np.sin(beta - alpha))
    middle = _coordinates(target, alpha, beta)[0]
    # the line of a fixed a passes the target at the distance |a − middle| wide
    reach = min(known, abs(target) + 2 * min(holes.max_weight + abs(holes.mounted), abs(target))) / wide
    first = max(0, int(np.ceil((middle - reach) / holes.step - 1e-9)))
    last = int(np.floor((middle + reach) / holes.step + 1e-9))
    if last - first > _MOST:
        raise ValueError("the step of the weights is too fine for this weight: use 0, any amount")
    found = []
    for k in sorted(range(first, last + 1), key=lambda k: abs(k * holes.step - middle)):
        a = k * holes.step
        if abs(a - middle) * wide > known * (1 + _SLACK):
            break
        b = _on_ray(target, np.exp(1j * beta), a * np.exp(1j * alpha), holes)
        if b is not None:
            known = min(known, abs(a * np.exp(1j * alpha) + b * np.exp(1j * beta) - target))
            found.append((a, b))
    return found
