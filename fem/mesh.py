"""How far the frequencies of a mesh are from those of the continuous shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fem._new.rotor import Rotor, refined
from fem.critical import critical_speeds
from rotorid.base.answer import Answer, Answered
from rotorid.base.arrays import FloatArray, read_only
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, text
from rotorid.base.rpm import RPM
from rotorid.base.tables import Column as Told
from rotorid.base.tables import Table
from rotorid.base.text import counted, percent, sentence

if TYPE_CHECKING:
    import pandas as pd

RATE = 4  # frequencies converge with this power of the element length, with and without shear
FINE = 1e-3  # relative error of a critical speed that needs no finer mesh


@dataclass(frozen=True, eq=False)
class MeshCheck(Answered):
    """Estimated discretisation errors of the critical speeds.

    Attributes
    ----------
    frequencies
        Of the model as it is, rad/s, shape (n,).
    extrapolated
        Estimate for infinitely fine elements, rad/s, shape (n,).
    errors
        Estimated relative error of `frequencies`, shape (n,); positive: they are too high.
    rates
        Observed power of the element length with which the error falls, shape (n,); NaN where the errors
        are below rounding. Near 4 the estimate is sound.
    elements
        Of the model.
    """

    frequencies: FloatArray
    extrapolated: FloatArray
    errors: FloatArray
    rates: FloatArray
    elements: int

    def to_frame(self) -> pd.DataFrame:
        """One row per critical speed."""
        modes = Column("mode", range(1, self.frequencies.size + 1))
        return frame((modes, Column("frequency_rad_s", self.frequencies), *self._estimates()))

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        estimates = {column.name: column.values for column in self._estimates()}
        return plain({"elements": self.elements, "frequencies_rad_s": self.frequencies, **estimates})

    def _estimates(self) -> tuple[Column, ...]:
        return (
            Column("extrapolated_rad_s", self.extrapolated),
            Column("relative_error", self.errors, "{:.1e}".format, "error of the mesh"),
            Column("rate", self.rates, "{:.2f}".format, "rate (none: rounding)"),
        )

    def tables(self) -> tuple[Table, ...]:
        """The errors, a row for each critical speed."""
        columns = (
            Told("mode", range(1, self.rates.size + 1)),
            Told("rpm", self.frequencies * RPM, "{:.2f}".format, "frequencies_rad_s.*", RPM),
            Told("error of the mesh", self.errors, "{:.1e}".format, "relative_error.*"),
            Told("rate (none: rounding)", self.rates, "{:.2f}".format, "rate.*"),
        )
        return (Table("errors of the mesh", columns),)

    def sentence(self) -> str:
        """Whether the mesh is fine enough."""
        return self.answer.judgement

    @property
    def answer(self) -> Answer:
        """Whether the mesh is fine enough, and what would be."""
        worst = int(np.abs(self.errors).argmax())
        size = abs(float(self.errors[worst]))
        said = (
            f"The mesh of {counted(self.elements, 'element')} changes these speeds by at most "
            f"{percent(size)} % (critical speed {worst + 1})"
        )
        if size > FINE:
            times = int(np.ceil((size / FINE) ** (1 / RATE)))
            said += f": elements {times} times shorter would bring all errors below {percent(FINE)} %"
        speeds = Column("rpm", self.frequencies * RPM, "{:.2f}".format)
        columns = (Column("mode", range(1, self.rates.size + 1), str), speeds, *self._estimates())
        return Answer(sentence(said), tables=(text(columns),), more="errors of the mesh")


def mesh_check(rotor: Rotor, n: int = 3) -> MeshCheck:
    """Estimate how much the mesh changes each of the n lowest critical speeds; the rotor stays as it is.

    The frequencies f(h) of the elements of this package converge as h⁴ (`fem.matrices.elements`); with
    elements cut in two, f(h) − f(0) ≈ 16/15 (f(h) − f(h/2)) (Richardson). A third solution with h/4 shows the
    rate.

    Parameters
    ----------
    rotor
        With the mesh to be judged.
    n
        How many critical speeds.

    Raises
    ------
    ValueError
        As `critical_speeds`.
    """
    lists = [critical_speeds(refined(rotor, times), n).frequencies for times in (1, 2, 4)]
    common = min(map(len, lists))  # bearing tables may end between
    coarse, middle, fine = (frequencies[:common] for frequencies in lists)
    first, second = coarse - middle, middle - fine
    share = 2.0**RATE / (2.0**RATE - 1)
    extrapolated = coarse - share * first
    scale = np.maximum(extrapolated, np.finfo(float).tiny)
    errors = np.where(extrapolated > 0, (coarse - extrapolated) / scale, 0.0)
    clear = (np.abs(second) > 1e-10 * scale) & (first * second > 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.where(clear, np.log2(np.abs(first / second)), np.nan)
    read_only(extrapolated, errors, rates)
    return MeshCheck(coarse, extrapolated, errors, rates, rotor.n_elements)
