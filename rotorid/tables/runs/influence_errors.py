"""Columns of an influence table that hold the covariance of the coefficients.

The columns `std_re_<unit>` and `std_im_<unit>` hold one standard deviation of influence·cos(phase_deg) and
influence·sin(phase_deg), as the table itself writes them; `correlation_re_im_<plane>` the correlation of the
first of this row's coefficient with the second of the same sensor's and speed's coefficient of the named
plane. Rows of the plane `(baseline)` hold the vibration of the bare rotor that the coefficients were measured
with, in the unit of the vibration, and its correlations with them.

What readings have in common stands in pairs of columns `common_1_re`, `common_1_im`, `common_2_re`, …: an
error moves every coefficient by its column, as a complex share of the root mean square of the two standard
deviations, times one real number of variance 1 for all rows. Without the rows of `(baseline)` a later run has
errors of its own only; without the columns `common_…` readings count as independent.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from balancing import Influence, Labels
from rotorid.base.arrays import ComplexArray, FloatArray, IndexArray
from rotorid.files.columns import Column, Table
from rotorid.files.decimal_numbers import SMALLEST
from rotorid.files.grid import Grid, show
from rotorid.files.problems import Problems
from rotorid.files.units import Unit, UnitError, UnitReader, ratio, spelt
from rotorid.regression import stretch, unstretch

PARTS = ("re", "im")
BASELINE = "(baseline)"
"""In the column of the plane: the vibration without weights."""
_COMMON = re.compile(r"common_\d+_(re|im)")
_NOTHING = 1e-14
_ROUNDING = 1e-9
_INDEFINITE = 1e-6


def error_columns(grid: Grid, influence_unit: UnitReader) -> tuple[Column, ...]:
    """The columns of errors that a table must have, if it has any of them; else none."""
    if not any(name.startswith(("std_", "correlation_", "common_")) for name in grid.header):
        return ()
    unit = next((name.partition("_")[2] for name in grid.header if name.startswith("influence_")), "")

    def same(name: str) -> Unit:
        if spelt(name) != spelt(unit):
            raise UnitError(f"the unit of the coefficients, {unit}, not {name or 'none'}")
        return influence_unit(name)

    columns = [Column(f"std_{part}", same, (f"std_{part}_{unit}",)) for part in PARTS]
    planes = _planes(grid)
    for plane in dict.fromkeys((*planes, BASELINE)):
        needed = plane in planes
        columns += [Column(_correlation(a, b, plane), ratio, (), needed) for a in PARTS for b in PARTS]
    columns += [Column(name, ratio, (), False) for name in grid.header if _COMMON.fullmatch(name)]
    return tuple(columns)


def _planes(grid: Grid) -> list[str]:
    if "plane" not in grid.header:
        return []
    place = grid.header.index("plane")
    return list(dict.fromkeys(show(cells[place]) for _, cells in grid.rows if show(cells[place])))


def _correlation(a: str, b: str, plane: object) -> str:
    return f"correlation_{a}_{b}_{' '.join(str(plane).split())}"


def read_covariance(
    table: Table, places: IndexArray, planes: Sequence[str], labels: Labels, problems: Problems
) -> tuple[FloatArray, ComplexArray] | None:
    """Covariance in SI and phase lead, and what is common besides; None without columns or with problems.

    Parameters
    ----------
    table
        With all columns of `error_columns`.
    places
        Index of the row of each coefficient, shape (S, C, P).
    planes
        Names, length P, `BASELINE` among them or not.
    labels
        How the phases of the table count.
    problems
        Collects the complaints.

    Returns
    -------
    Covariance without what is common, (S, C, 2P, 2P), and columns of this, (M, S, C, P).
    """
    if "std_re" not in table:
        return None
    before = len(problems)
    for part in PARTS:
        std = table.numbers(f"std_{part}")
        table.must_be(f"std_{part}", std >= 0, "a standard deviation of 0 or more")
        for other in PARTS:
            for plane in planes:
                stem = _correlation(part, other, plane)
                small = np.abs(table.numbers(stem)) <= 1 + _ROUNDING
                table.must_be(stem, small, "a correlation from -1 to 1")
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
    sign = labels.phase_sign
    std = np.stack([table.numbers(f"std_{part}")[places] for part in PARTS], axis=-1).reshape(S, C, 2 * P)
    common = _read_common(table, places, sign) * np.sqrt(np.mean(std.reshape(S, C, P, 2) ** 2, axis=-1))
    std = std * np.tile([1.0, float(sign)], P)
    covariance = (R + np.swapaxes(R, -1, -2)) / 2 * std[..., None] * std[..., None, :]
    F = stretch(common[..., None])[..., 0]
    own, scale = covariance - np.einsum("mscp,mscq->scpq", F, F), np.where(std != 0, np.abs(std), 1.0)
    for s, c in np.ndindex(S, C):
        if np.linalg.eigvalsh(own[s, c] / np.outer(scale[s, c], scale[s, c]))[0] < -_INDEFINITE:
            stem = next(name for name in table.fields if name.startswith("common_"))
            expected = "no more in common than the standard deviations and correlations of this row say"
            table.complain(int(places[s, c, 0]), stem, expected)
            return None
    return own, common


def _read_common(table: Table, places: IndexArray, sign: int) -> ComplexArray:
    """Shares that errors have in common, (M, S, C, P); an im without a re counts, too."""
    out = [np.zeros((0, *places.shape), dtype=complex)]
    for name in sorted({name[:-3] for name in table.fields if name.startswith("common_")}):
        column = np.zeros((1, *places.shape), dtype=complex)
        for part, unit in zip(PARTS, (1, 1j * sign), strict=True):
            if f"{name}_{part}" in table:
                column += unit * table.numbers(f"{name}_{part}")[places]
        out.append(column)
    return np.concatenate(out)


def _check_correlations(
    table: Table, places: IndexArray, planes: Sequence[str], R: FloatArray, problems: Problems
) -> None:
    """Complain about correlations with itself that are not 1, unequal halves, and impossible sets."""
    S, C, n, _ = R.shape
    diagonal = np.abs(np.einsum("scii->sci", R) - 1) > _ROUNDING
    for s, c, i in np.argwhere(diagonal):
        stem = _correlation(PARTS[i % 2], PARTS[i % 2], planes[i // 2])
        table.complain(int(places[s, c, i // 2]), stem, "1, the correlation of a number with itself")
    unequal = np.abs(R - np.swapaxes(R, -1, -2)) > _ROUNDING
    for s, c, i, j in np.argwhere(np.triu(unequal)):
        stem = _correlation(PARTS[j % 2], PARTS[i % 2], planes[i // 2])
        other = _correlation(PARTS[i % 2], PARTS[j % 2], planes[j // 2])
        row = places[s, c, i // 2]
        expected = (
            f"the same correlation as in row {table.rows[row]}, column {other}: {table.shown(other, row)}"
        )
        table.complain(int(places[s, c, j // 2]), stem, expected)
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
            table.complain(int(places[s, c, i // 2]), stem, expected)


def error_values(influence: Influence, labels: Labels, rows: Sequence[str]) -> Mapping[str, FloatArray]:
    """The columns of errors by their names, shape (S·C·n,) each; none where the errors are unknown.

    Rows: the planes, after `BASELINE` where that is written.
    """
    if not influence.known_errors:
        return {}
    S, C = influence.W.shape[:2]
    n, first = len(rows), 1 + len(influence.planes) - len(rows)
    scale = (
        labels.vibration_scale * np.array([1.0, *(1 / labels.weight_scale for _ in influence.planes)])[first:]
    )
    above = f"{labels.vibration_unit}_" if labels.vibration_unit else ""
    flip = np.tile([1.0, float(labels.phase_sign)], n)
    covariance = influence.channels()[..., 2 * first :, 2 * first :] * np.outer(flip, flip)
    std = np.sqrt(np.maximum(np.einsum("scii->sci", covariance), 0.0))
    std = np.where(std * np.repeat(scale, 2) < SMALLEST, 0.0, std)
    safe = np.where(std > 0, std, 1.0)
    R = np.where((std > 0)[..., None] & (std > 0)[..., None, :], covariance, 0.0)
    R = R / safe[..., None] / safe[..., None, :]
    R = _written(np.clip(R, -1.0, 1.0))
    R[..., np.arange(2 * n), np.arange(2 * n)] = 1.0
    each, blocks = std.reshape(S, C, n, 2), R.reshape(S, C, n, 2, n, 2)
    unit = f"{above}per_{labels.weight_unit}"
    out = {f"std_{part}_{unit}": (each[..., a] * scale).ravel() for a, part in enumerate(PARTS)}
    for q, plane in enumerate(rows):
        for a, b in np.ndindex(2, 2):
            out[_correlation(PARTS[a], PARTS[b], plane)] = blocks[..., a, q, b].ravel()
    size = np.sqrt(np.mean(each**2, axis=-1))
    share = np.where(size > 0, influence.columns()[..., first:] / np.where(size > 0, size, 1.0), 0.0)
    for m, column in enumerate(_fewest(share.reshape(-1, S * C * n)), 1):
        out[f"common_{m}_re"] = _written(column.real)
        out[f"common_{m}_im"] = _written(labels.phase_sign * column.imag)
    return out


def _fewest(columns: ComplexArray) -> ComplexArray:
    """As few columns (M, n) as make the same covariance, times real numbers."""
    s, right = np.linalg.svd(stretch(columns[..., None])[..., 0], full_matrices=False)[1:]
    kept = s > _NOTHING * s.max(initial=0.0)
    return unstretch(s[kept, None] * right[kept])


def _written(values: FloatArray) -> FloatArray:
    """Without numbers so small that no reader accepts them."""
    return np.where(np.abs(values) < SMALLEST, 0.0, values)
