"""Reduced models of one rotor by Guyan, IRS, SEREP and regression, side by side: result, text and JSON."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import fem
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame
from rotorid.base.text import counted, listing, percent

if TYPE_CHECKING:
    import pandas as pd


_ACROSS = 3
"""Modes beside one another in a table that fits a page."""


@dataclass(frozen=True, eq=False)
class Method:
    """One reduced model M x″ + K x = f, x the deflections of the n masters, and how well it does.

    Attributes
    ----------
    name
        As titled in `METHODS` of `rotorid.reduction.guyan_irs_serep`; "regression, k modes".
    M, K
        Mass, kg, and stiffness, N/m, shape (n, n); None where the method fails at these masters.
    T
        Unknowns of the rotor from those of the model, shape (R, n): the rows stand as the coordinates of
        `fem.equations_of_motion` of the plane x, and M and K are Tᵀ M T and Tᵀ K T of its matrices. None for
        the regression: its masses are no projection.
    frequencies
        rad/s, ascending, shape (n,); NaN for a mode that does not vibrate.
    shapes
        At the masters, a column per mode, each scaled to fit the rotor's, shape (n, n).
    relative_error
        Of each frequency against the rotor's of the same number, shape (n,).
    mac
        Of each shape with the rotor's of the same number, at the masters, shape (n,).
    diagonal
        Whether the mass matrix is diagonal: only then does a mass stand at a node.
    reason
        Why there is no model, or what to know about it; empty where nothing is to be said.
    """

    name: str
    M: FloatArray | None
    K: FloatArray | None
    T: FloatArray | None
    frequencies: FloatArray
    shapes: FloatArray
    relative_error: FloatArray
    mac: FloatArray
    diagonal: bool
    reason: str = ""

    @property
    def masses(self) -> FloatArray | None:
        """The masses at the masters, kg, shape (n,); None where the mass matrix is not diagonal."""
        return np.diag(self.M).copy() if self.diagonal and self.M is not None else None

    def to_dict(self) -> dict[str, Any]:
        """As JSON types; the transformation T is left to Python."""
        masses = self.masses
        return plain(
            {
                "method": self.name,
                "mass_matrix_kg": self.M,
                "stiffness_matrix_N_per_m": self.K,
                "masses_kg": masses,
                "diagonal": self.diagonal,
                "natural_frequencies_rad_s": self.frequencies,
                "relative_error": self.relative_error,
                "mac": self.mac,
                "mode_shapes": self.shapes.T,
                "reason": self.reason or None,
            }
        )


@dataclass(frozen=True, eq=False)
class Methods(Answered):
    """Reduced models of the same rotor at the same nodes by different methods.

    Attributes
    ----------
    rotor
        The rotor; its plane x at rest is reduced.
    nodes
        Masters, n of them.
    positions
        Of the masters, m from the left end, shape (n,).
    rotor_modes
        The rotor's own first n modes.
    rows
        A `Method` each.
    warnings
        What a user should know before choosing.
    """

    rotor: fem.Rotor
    nodes: tuple[int, ...]
    positions: FloatArray
    rotor_modes: fem.Modes
    rows: tuple[Method, ...]
    warnings: tuple[str, ...]

    @property
    def rotor_frequencies(self) -> FloatArray:
        """The rotor's first n natural frequencies, rad/s."""
        return self.rotor_modes.frequencies

    def row(self, name: str) -> Method:
        """The model of one method; "regression" finds the regression however many modes it used.

        Raises
        ------
        ValueError
            For a method that was not compared.
        """
        for row in self.rows:
            if row.name == name or row.name.split(",")[0].lower() == name.lower():
                return row
        raise ValueError(f"no method {name!r}: there are {', '.join(row.name for row in self.rows)}")

    def to_frame(self) -> pd.DataFrame:
        """A row per method and mode."""
        n, several = len(self.nodes), len(self.rows)
        return frame(
            (
                Column("method", np.repeat([row.name for row in self.rows], n)),
                Column("mode", np.tile(np.arange(1, n + 1), several)),
                Column("frequency_rad_s", np.concatenate([row.frequencies for row in self.rows])),
                Column("rotor_frequency_rad_s", np.tile(self.rotor_frequencies, several)),
                Column("relative_error", np.concatenate([row.relative_error for row in self.rows])),
                Column("mac", np.concatenate([row.mac for row in self.rows])),
                Column("diagonal", np.repeat([row.diagonal for row in self.rows], n)),
            )
        )

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return plain(
            {
                "nodes": self.nodes,
                "positions_m": self.positions,
                "rotor_frequencies_rad_s": self.rotor_frequencies,
                "methods": [row.to_dict() for row in self.rows],
                "warnings": self.warnings,
            }
        )

    @property
    def answer(self) -> Answer:
        """The largest error of each method; behind it frequencies, errors and MAC by method and mode."""
        worst = [
            f"{row.name} {percent(round(float(np.nanmax(np.abs(row.relative_error))), 8))} %"
            for row in self.rows
            if np.isfinite(row.relative_error).any()
        ]
        full = [row.name for row in self.rows if row.M is not None and not row.diagonal]
        said = (
            f"{listing(full, 'and')}: full mass matrices; they couple the nodes, and no single mass stands "
            "at a node"
        )
        return Answer(
            f"Largest error of {counted(len(self.nodes), 'frequency', 'frequencies')}: {', '.join(worst)}.",
            warnings=self.warnings,
            notes=(said,) if full else (),
            tables=("\n".join(self._table()),),
            more="frequencies and shapes of each method",
        )

    def _table(self) -> list[str]:
        n = len(self.nodes)
        lines = [
            f"The rotor reduced to {counted(n, 'unknown')}, the deflections of nodes "
            f"{', '.join(map(str, self.nodes))}",
            "in each cell: frequency in rad/s, its error, MAC with the rotor's mode at these nodes",
        ]
        for first in range(0, n, _ACROSS):
            modes = range(first, min(n, first + _ACROSS))
            lines.append(f"{'method':<20}" + "".join(f"{f'mode {k + 1}':>10}{'':19}" for k in modes).rstrip())
            own = "".join(f"{_number(self.rotor_frequencies[k]):>10}{'':19}" for k in modes)
            lines.append(f"{'rotor':<20}{own}".rstrip())
            for row in self.rows:
                cells = "".join(_cell(row, k) for k in modes)
                lines.append(f"{row.name:<20}{cells}".rstrip())
        for row in self.rows:
            if row.masses is not None:
                pairs = ", ".join(
                    f"{m:.4g} kg at node {node}" for m, node in zip(row.masses, self.nodes, strict=True)
                )
                lines += textwrap.wrap(f"{row.name}: {pairs}", 100, subsequent_indent="  ")
        return lines


def _cell(row: Method, k: int) -> str:
    if row.M is None:
        return f"{'no model':>10}{'':19}"
    if not np.isfinite(row.frequencies[k]):
        return f"{'does not vibrate':>18}{'':11}"
    return f"{_number(row.frequencies[k]):>10} {_percent(row.relative_error[k])} {row.mac[k]:8.5f}"


def _number(omega: float) -> str:
    """Seven digits or more, as the book prints frequencies."""
    return f"{omega:.4f}" if omega < 1e4 else f"{omega:.7g}"


def _percent(error: float) -> str:
    """Signed, 9 characters wide; what rounding alone makes is 0."""
    percent = 100 * error
    size = abs(percent)
    if size < 5e-5:
        return f"{'0 %' if size < 1e-9 else '<0.0001 %':>9}"
    if size >= 100:
        return f"{percent:+7.3g} %"
    return f"{percent:+7.3f} %" if size >= 0.01 else f"{percent:+7.4f} %"
