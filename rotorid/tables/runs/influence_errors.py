"""Columns of an influence table that hold the covariance of the coefficients.

The columns `std_re_<unit>` and `std_im_<unit>` hold one standard deviation of influence·cos(phase_deg) and
influence·sin(phase_deg), as the table itself writes them; `correlation_re_im_<plane>` the correlation of the
first of this row's coefficient with the second of the same sensor's and speed's coefficient of the named
plane. Correlations with the readings of a bare rotor are not stored: they belong to readings that a later
baseline run replaces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from balancing.coefficients.influence import Influence
from balancing.data.conventions import Labels
from rotorid.base.arrays import FloatArray, IndexArray
from rotorid.tables.reader.columns import Column, Table, must_be
from rotorid.tables.reader.grid import Grid, show
from rotorid.tables.reader.number import SMALLEST
from rotorid.tables.reader.problems import Problems
from rotorid.tables.reader.units import Unit, UnitError, UnitReader, ratio, spelt

PARTS = ("re", "im")
_ROUNDING = 1e-9
_INDEFINITE = 1e-6


def error_columns(grid: Grid, influence_unit: UnitReader) -> tuple[Column, ...]:
    """The columns of errors that a table must have, if it has any of them; else none."""
    if not any(name.startswith(("std_", "correlation_")) for name in grid.header):
        return ()
    unit = next((name.partition("_")[2] for name in grid.header if name.startswith("influence_")), "")

    def same(name: str) -> Unit:
        if spelt(name) != spelt(unit):
            raise UnitError(f"the unit of the coefficients, {unit}, not {name or 'none'}")
        return influence_unit(name)

    columns = [Column(f"std_{part}", same, (f"std_{part}_{unit}",)) for part in PARTS]
    for plane in _planes(grid):
        columns += [Column(_correlation(a, b, plane), ratio) for a in PARTS for b in PARTS]
    return tuple(columns)


def _planes(grid: Grid) -> list[str]:
    if "plane" not in grid.header:
        return []
    place = grid.header.index("plane")
    return list(dict.fromkeys(show(cells[place]) for _, cells in grid.rows if show(cells[place])))


def _correlation(a: str, b: str, plane: object) -> str:
    return f"correlation_{a}_{b}_{' '.join(str(plane).split())}"


def read_covariance(
    table: Table, places: IndexArray, planes: Sequence[str], sign: int, problems: Problems
) -> FloatArray | None:
    """Covariance of the coefficients in SI and phase lead, or None without such columns or with problems.

    Parameters
    ----------
    table
        With all columns of `error_columns`.
    places
        Index of the row of each coefficient, shape (S, C, P).
    planes
        Names, length P.
    sign
        −1 where the phases of the table lag.
    problems
        Collects the complaints.

    Returns
    -------
    (S, C, 2P + 2, 2P + 2) as `Influence.covariance`, zero where the reading of the bare rotor stands.
    """
    if "std_re" not in table:
        return None
    before = len(problems)
    for part in PARTS:
        std = table.numbers(f"std_{part}")
        must_be(table, f"std_{part}", std >= 0, "a standard deviation of 0 or more", problems)
        for other in PARTS:
            for plane in planes:
                stem = _correlation(part, other, plane)
                small = np.abs(table.numbers(stem)) <= 1 + _ROUNDING
                must_be(table, stem, small, "a correlation from -1 to 1", problems)
    if len(problems) > before:
        return None
    S, C, P = places.shape
    blocks = np.empty((S, C, P, 2, P, 2))
    for a, part in enumerate(PARTS):
        for b, other in enumerate(PARTS):
            for q, plane in enumerate(planes):
                blocks[..., a, q, b] = table.numbers(_correlation(part, other, plane))[places]
    R = blocks.reshape(S, C, 2 * P, 2 * P)
    _check_correlations(table, places, planes, R, problems)
    if len(problems) > before:
        return None
    std = np.stack([table.numbers(f"std_{part}")[places] for part in PARTS], axis=-1).reshape(S, C, 2 * P)
    std = std * np.tile([1.0, float(sign)], P)
    out = np.zeros((S, C, 2 * P + 2, 2 * P + 2))
    out[..., 2:, 2:] = (R + np.swapaxes(R, -1, -2)) / 2 * std[..., None] * std[..., None, :]
    return out


def _check_correlations(
    table: Table, places: IndexArray, planes: Sequence[str], R: FloatArray, problems: Problems
) -> None:
    """Complain about correlations with itself that are not 1, unequal halves, and impossible sets."""
    S, C, n, _ = R.shape
    diagonal = np.abs(np.einsum("scii->sci", R) - 1) > _ROUNDING
    for s, c, i in np.argwhere(diagonal):
        stem = _correlation(PARTS[i % 2], PARTS[i % 2], planes[i // 2])
        table.complain(
            problems, int(places[s, c, i // 2]), stem, "1, the correlation of a number with itself"
        )
    unequal = np.abs(R - np.swapaxes(R, -1, -2)) > _ROUNDING
    for s, c, i, j in np.argwhere(np.triu(unequal)):
        stem = _correlation(PARTS[j % 2], PARTS[i % 2], planes[i // 2])
        other = _correlation(PARTS[i % 2], PARTS[j % 2], planes[j // 2])
        row = places[s, c, i // 2]
        expected = (
            f"the same correlation as in row {table.rows[row]}, column {other}: {table.shown(other, row)}"
        )
        table.complain(problems, int(places[s, c, j // 2]), stem, expected)
    for s, c in np.ndindex(S, C):
        if diagonal[s, c].any() or unequal[s, c].any():
            continue
        smallest = float(np.linalg.eigvalsh(R[s, c])[0])
        if smallest < -_INDEFINITE:
            i, j = divmod(int(np.argmax(np.abs(np.triu(R[s, c], 1)))), n)
            stem = _correlation(PARTS[i % 2], PARTS[j % 2], planes[j // 2])
            expected = (
                "correlations that can stand together: those of this sensor and speed are no covariance "
                f"(smallest eigenvalue {smallest:.3g})"
            )
            table.complain(problems, int(places[s, c, i // 2]), stem, expected)


def error_values(influence: Influence, labels: Labels) -> Mapping[str, FloatArray]:
    """The columns of errors by their names, shape (S·C·P,) each; none where the errors are unknown."""
    if influence.covariance is None:
        return {}
    S, C, P = influence.W.shape
    scale = labels.vibration_scale / labels.weight_scale
    above = f"{labels.vibration_unit}_" if labels.vibration_unit else ""
    flip = np.tile([1.0, float(labels.phase_sign)], P)
    covariance = influence.covariance[..., 2:, 2:] * np.outer(flip, flip)
    std = np.sqrt(np.maximum(np.einsum("scii->sci", covariance), 0.0))
    std = np.where(std * scale < SMALLEST, 0.0, std)
    safe = np.where(std > 0, std, 1.0)
    R = np.where((std > 0)[..., None] & (std > 0)[..., None, :], covariance, 0.0)
    R = R / safe[..., None] / safe[..., None, :]
    R = np.where(np.abs(R) < SMALLEST, 0.0, np.clip(R, -1.0, 1.0))  # no reader accepts smaller ones
    R[..., np.arange(2 * P), np.arange(2 * P)] = 1.0
    each, blocks = std.reshape(S, C, P, 2) * scale, R.reshape(S, C, P, 2, P, 2)
    unit = f"{above}per_{labels.weight_unit}"
    out = {f"std_{part}_{unit}": each[..., a].ravel() for a, part in enumerate(PARTS)}
    for q, plane in enumerate(influence.planes):
        for a, b in np.ndindex(2, 2):
            out[_correlation(PARTS[a], PARTS[b], plane)] = blocks[..., a, q, b].ravel()
    return out
