"""Reduced models of one rotor by Guyan, IRS, SEREP and regression, side by side: result, text and JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import fem
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, text
from rotorid.base.text import counted, listing, percent

if TYPE_CHECKING:
    import pandas as pd


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
        return frame(self._columns())

    def _columns(self) -> tuple[Column, ...]:
        n, several = len(self.nodes), len(self.rows)
        frequency, share = "{:.4f}".format, "{:+.3%}".format

        def each(name: str) -> FloatArray:
            return np.concatenate([getattr(row, name) for row in self.rows])

        return (
            Column("method", np.repeat([row.name for row in self.rows], n), str),
            Column("mode", np.tile(np.arange(1, n + 1), several), str),
            Column("frequency_rad_s", each("frequencies"), frequency, "rad/s"),
            Column("rotor_frequency_rad_s", np.tile(self.rotor_frequencies, several), frequency, "rotor"),
            Column("relative_error", each("relative_error"), share, "error"),
            Column("mac", each("mac"), "{:.5f}".format, "MAC"),
            Column("diagonal", np.repeat([row.diagonal for row in self.rows], n)),
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
            f"{row.name} {percent(round(float(np.abs(row.relative_error).max()), 8))} %"
            if row.M is not None and np.isfinite(row.relative_error).all()
            else f"{row.name}: no model of all modes"
            for row in self.rows
        ]
        full = [row.name for row in self.rows if row.M is not None and not row.diagonal]
        said = "full mass matrices; they couple the nodes, and no single mass stands at a node"
        return Answer(
            f"Largest error of {counted(len(self.nodes), 'frequency', 'frequencies')}: {', '.join(worst)}.",
            warnings=self.warnings,
            notes=(f"{listing(full, 'and')}: {said}",) if full else (),
            tables=(text(self._columns()),),
            more="frequencies and shapes of each method",
        )
