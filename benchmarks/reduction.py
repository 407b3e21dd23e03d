"""Reduced models of the reference rotor: all places for three masses, and Guyan's reduction against ROSS.

Ranking all 2024 triples of the 24 nodes beside a loop as a user of NumPy would write it: for each triple
`lstsq` of formula (50), `eigh` of the three masses, frequency errors and MAC; compliances and modes of the
rotor are computed once, by the same `fem` calls. Compared are masses, frequencies and MAC of all triples
with positive masses, after these are found to be the same ones.

Guyan's reduction of ROSS always keeps the nodes of bearings and discs, so these are kept in both programs.
ROSS has six unknowns per node: one axial and one torsional unknown, without which it could not invert its
stiffness, are kept too and left out afterwards, as is the second plane. rotorid sets the frequencies of the
reduced model beside those of the whole rotor; so does the peer here, with SciPy's `eigh` of the plane's part
of ROSS's own matrices (its `run_modal` takes longer). All of both are compared.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from itertools import combinations
from typing import Any

import numpy as np
from scipy.linalg import eigh

import fem
from benchmarks.rotors import ROSS, SIZES, Bearing, ross, ross_rotor, rotorid_rotor, table
from benchmarks.timing import Row, best_of, relative_difference
from rotorid.reduction import compare_methods, reduce
from rotorid.reduction.placement import rank_nodes

MASSES, MODES = 3, 2
Triple = tuple[int, ...]


def plain_loop(rotor: fem.Rotor) -> dict[Triple, np.ndarray]:
    """Masses, frequencies and MAC (each three numbers) of every triple whose masses are positive."""
    full = fem.critical_speeds(rotor, MASSES)
    alpha = fem.compliance(rotor, range(1, rotor.n_nodes + 1))
    lam = 1.0 / full.frequencies**2
    found, rank = {}, []
    for triple in combinations(range(rotor.n_nodes), MASSES):
        place = np.array(triple)
        A = alpha[np.ix_(place, place)]
        shapes = full.shapes[place]
        U = shapes / shapes[0]
        B = np.vstack([A * U[:, k] for k in range(MODES)])
        D = np.concatenate([lam[k] * U[:, k] for k in range(MODES)])
        m = np.linalg.lstsq(B, D, rcond=None)[0]
        if (m <= 0).any():
            continue
        root = np.sqrt(m)
        values, vectors = np.linalg.eigh(root[:, None] * A * root)
        if values[0] <= 0:
            continue
        omega = 1.0 / np.sqrt(values[::-1])
        own = vectors[:, ::-1] / root[:, None]
        mac = (own * shapes).sum(axis=0) ** 2 / ((own**2).sum(axis=0) * (shapes**2).sum(axis=0))
        found[tuple(int(i) + 1 for i in triple)] = np.array([m, omega, mac])
        rank.append((np.abs(omega / full.frequencies - 1).max(), -mac.min(), triple))
    rank.sort()
    return {tuple(i + 1 for i in triple): found[tuple(i + 1 for i in triple)] for _, _, triple in rank}


def apart(rotor: fem.Rotor) -> float:
    """Largest relative difference between both rankings; infinite where they rank other triples."""
    ours, theirs = rank_nodes(rotor, MASSES, MODES), plain_loop(rotor)
    triples = [tuple(map(int, nodes)) for nodes in ours.nodes[: ours.ranked]]
    if set(triples) != set(theirs) or triples[0] != next(iter(theirs)):
        return float("inf")
    answers = np.array([theirs[triple] for triple in triples])
    # of MAC rotorid keeps the smallest one only
    return max(
        relative_difference(ours.masses[: ours.ranked], answers[:, 0]),
        relative_difference(ours.frequencies[: ours.ranked], answers[:, 1]),
        relative_difference(ours.mac[: ours.ranked], answers[:, 2].min(axis=1)),
    )


def ranking() -> Row:
    rows = table(SIZES[23])
    make = lambda: rotorid_rotor(rows, Bearing())  # noqa: E731
    seconds = best_of(make, lambda rotor: rank_nodes(rotor, MASSES, MODES), 10)
    return Row(
        task="All 2024 choices of 3 nodes ranked, 23 elements",
        ours="rotorid",
        our_seconds=seconds,
        peer="loop of lstsq and eigh",
        peer_seconds=best_of(make, plain_loop, 2),
        difference=apart(make()),
        allowed=1e-6,
        required_ratio=3.0,
    )


def with_ross(rotor: Any) -> np.ndarray:
    """Frequencies of Guyan's model in the plane x and as many of the whole rotor, rad/s, (2, nodes)."""
    model = ross.ModelReduction(rotor=rotor, speed=0.0, method="guyan", include_dofs=[2, 5])
    K, M = model.reduce_matrix(model.K), model.reduce_matrix(model.M)
    x = [i for i, unknown in enumerate(model.selected_dofs) if unknown % rotor.number_dof == 0]
    plane = [i for i in range(rotor.ndof) if i % rotor.number_dof in (0, 4)]  # x and the slope in it
    reduced = eigh(K[np.ix_(x, x)], M[np.ix_(x, x)], eigvals_only=True)
    whole = eigh(model.K[np.ix_(plane, plane)], model.M[np.ix_(plane, plane)], eigvals_only=True)
    return np.sqrt([reduced, whole[: len(x)]])


def with_rotorid(rotor: fem.Rotor, kept: list[int]) -> np.ndarray:
    model = compare_methods(reduce(rotor, kept, modes=1)).rows[0]
    return np.array([model.frequencies, model.frequencies / (1.0 + model.relative_error)])


def condensation() -> Row:
    rows = table(SIZES[23])
    kept = [n for n, row in enumerate(rows, 1) if row["mass_kg"] or row["support_stiffness_N_per_m"]]
    ours = lambda: rotorid_rotor(rows, Bearing())  # noqa: E731
    theirs = lambda: ross_rotor(rows, Bearing())  # noqa: E731
    return Row(
        task=f"Guyan reduction (ours: with IRS and formula 50) to {len(kept)} nodes, 23 elements",
        ours="rotorid",
        our_seconds=best_of(ours, lambda rotor: with_rotorid(rotor, kept), 30),
        peer=f"{ROSS} Guyan",
        peer_seconds=best_of(theirs, with_ross, 5),
        difference=relative_difference(with_rotorid(ours(), kept), with_ross(theirs())),
        allowed=1e-6,
        required_ratio=0.5,
        goal=2.0,
    )


def run() -> list[Row]:
    return [ranking(), condensation()]
