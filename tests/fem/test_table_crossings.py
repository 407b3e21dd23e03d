"""Critical speeds over tabulated bearings: none is missed, also not two within one interval of the table."""

import dataclasses

import numpy as np
import pytest
from repetitions import FULL

import fem
from fem.assembly import assemble, dense

DRAWN = 200 if FULL else 25
SCAN = 1500 if FULL else 600


def drawn(rng):
    """A short rotor on tables with jumps and dips, isotropic or not, some with a pedestal."""
    n = int(rng.integers(2, 6))
    disc = rng.uniform(5, 60)
    tilting = disc * rng.uniform(0.005, 0.03)
    knots = np.cumsum(rng.uniform(40.0, 400.0, int(rng.integers(2, 7))))
    isotropic = rng.random() < 0.5
    falling = rng.random() < 0.3

    def stiffness():
        # Around m Ω², where the natural frequency meets the speed.
        k = disc / 2 * knots**2 * 10 ** rng.uniform(-0.7, 0.7, knots.size)
        if falling:
            k = np.sort(k)[::-1]
        if isotropic:
            return k.tolist()
        cross = 0.2 * rng.uniform(-1, 1, knots.size) * k
        side = k * rng.uniform(0.5, 2.0, knots.size)
        return [((x, c), (c * rng.choice([1, 0.5]), y)) for x, c, y in zip(k, cross, side, strict=True)]

    stand = fem.Pedestal(rng.uniform(0, 20), 1e7) if rng.random() < 0.2 else None
    return fem.Rotor(
        rng.uniform(0.05, 0.25, n),
        rng.uniform(0.03, 0.12),
        density=rng.choice([0.0, 7850.0]),
        discs=[fem.Disc(int(rng.integers(1, n + 2)), disc, tilting * rng.uniform(0.3, 2.0), tilting)],
        supports=[fem.Support(node, stiffness(), speeds=tuple(knots), pedestal=stand) for node in (1, n + 1)],
        model=fem.Model(rotary_inertia=True, gyroscopic=bool(rng.random() < 0.6)),
    )


def negative_eigenvalues(rotor, speeds):
    """How many eigenvalues of K(Ω) − Ω² M are below 0 at each speed, from dense matrices."""
    A = assemble(rotor)
    n, stands = A.size, [s for s in rotor.supports if s.pedestal is not None]
    planes = 1 if rotor.symmetric else 2
    size = planes * (n + len(stands))
    M, K0 = np.zeros((2, size, size), dtype=complex)
    for p in range(planes):
        part = slice(p * n, (p + 1) * n)
        K0[part, part], M[part, part] = dense(A.shaft), dense(A.mass)
    G = dense(A.gyroscopic)
    if planes == 1:
        M[:n, :n] -= G
    else:
        M[:n, n : 2 * n], M[n : 2 * n, :n] = -1j * G, 1j * G
    K = np.repeat(K0[None], speeds.size, axis=0)
    for s in rotor.supports:
        k = s.at(speeds)[0]
        k = ((k + np.swapaxes(k, 1, 2)) / 2)[:, :planes, :planes]
        node = [p * n + A.deflection(s.node) for p in range(planes)]
        ends = [(1.0, node)]
        if s.pedestal is not None:
            foot = [planes * n + planes * stands.index(s) + p for p in range(planes)]
            ends.append((-1.0, foot))
            K[:, foot, foot] += s.pedestal.xy("stiffness")[0]
            M[foot, foot] += s.pedestal.mass
        for a, one in ends:
            for b, other in ends:
                K[np.ix_(np.arange(speeds.size), one, other)] += a * b * k
    return (np.linalg.eigvalsh(K - (speeds**2)[:, None, None] * M) < 0).sum(axis=1)


def missed(rotor):
    """Crossings that a dense scan sees and the search does not, or the other way round."""
    first, last = rotor.supports[0].speeds[0], rotor.supports[0].speeds[-1]
    speeds = np.linspace(first, last, SCAN)
    seen = negative_eigenvalues(rotor, speeds)
    try:
        found = fem.critical_speeds(rotor, 100).frequencies
    except ValueError as problem:
        assert "no critical speed lies between" in str(problem)  # noqa: PT017
        found = np.zeros(0)
    there = np.histogram(found, speeds)[0]
    # In each step as many as the number of negative eigenvalues tells, or two more that cancel.
    extra = there - np.abs(np.diff(seen))
    return int((extra < 0).sum() + (extra % 2 != 0).sum())


def test_no_crossing_is_missed_in_drawn_tables():
    rng = np.random.default_rng(16)
    wrong = {number: count for number in range(DRAWN) if (count := missed(drawn(rng)))}
    assert wrong == {}


@pytest.mark.parametrize("dip", [False, True])
def test_two_crossings_within_one_interval(dip):
    """λ = 2 k / m is linear in speed, Ω² is not: closed form, tables as short as can be."""
    m = 20.0
    slope = 2500.0

    def rotor(low, high):
        return fem.Rotor(
            [0.05, 0.05],
            0.2,
            density=0.0,
            discs=[fem.Disc(2, m)],
            supports=[
                fem.Support(node, [99900.0 + slope * (v - 100.0) for v in (low, high)], speeds=(low, high))
                for node in (1, 3)
            ],
        )

    # 2 (99900 + s (Ω − 100)) / m = Ω², with the shaft's own compliance far below.
    roots = np.roots([1.0, -2 * slope / m, -2 * (99900 - 100 * slope) / m])
    low, high = (100.0, 200.0) if not dip else (110.0, 200.0)
    expected = sorted(v for v in roots if low < v < high)
    found = fem.critical_speeds(rotor(low, high), 3)
    np.testing.assert_allclose(found.frequencies, expected, rtol=1e-3)
    one = fem.critical_speeds(rotor(100.0, 200.0), 1)
    assert "the list is cut: 1 more critical speed in this range; -n 2 lists all" in one.cut


def test_rigid_body_motions_are_not_counted():
    free = fem.Rotor(np.full(8, 0.1), 0.05)
    held = dataclasses.replace(free, supports=[fem.Support(1, 1e7)])
    for rotor, rigid in ((free, 2), (held, 1)):
        found = fem.critical_speeds(rotor, 2)
        assert found.frequencies.size == rigid + 2
        assert (found.frequencies[:rigid] == 0).all()
        assert (found.frequencies[rigid:] > 0).all()


def test_inertias_of_impossible_size_are_refused_at_once():
    table = fem.Support(1, [((1e8, 0.0), (0.0, 2e8)), ((2e8, 0.0), (0.0, 3e8))], speeds=(100.0, 1000.0))
    discs = [fem.Disc(2, 10.0, 1e15, 0.1)]
    rotor = fem.Rotor([0.3, 0.7], 0.05, discs=discs, supports=[table, fem.Support(3, 1e8)])
    with pytest.raises(ValueError, match="differ by too many orders of size"):
        fem.critical_speeds(
            dataclasses.replace(rotor, model=fem.Model(rotary_inertia=True, gyroscopic=True)), 2
        )
