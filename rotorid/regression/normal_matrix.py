"""The normal matrix KᵀK of the last step, [Q] (2.28), to look at: nothing is solved by it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotorid.base.answer import Column, text
from rotorid.base.arrays import FloatArray
from rotorid.base.json import plain
from rotorid.regression.linear import least_squares
from rotorid.regression.search import RCOND


@dataclass(frozen=True, eq=False)
class NormalMatrix:
    """KᵀK (n, n) of the data's rows, over their errors where known, in the units of the unknowns.

    Its condition number has four digits; it is infinite where the rows do not determine all unknowns.
    """

    names: tuple[str, ...]
    matrix: FloatArray
    condition_number: float

    def text(self) -> str:
        """As a table."""
        columns = (Column(n, row, "{:.6g}".format) for n, row in zip(self.names, self.matrix, strict=True))
        title = f"normal matrix of the last step, condition number {self.condition_number:.4g}"
        return f"{title}\n{text((Column('', self.names, str), *columns), width=10_000)}"

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return plain(vars(self))


def normal_matrix(names: tuple[str, ...], K: FloatArray) -> NormalMatrix:
    """That of rows K (m, n)."""
    s = np.linalg.svd(K, compute_uv=False)
    full = least_squares(K, np.zeros(len(K)), rcond=RCOND).full_rank
    return NormalMatrix(names, K.T @ K, float(f"{(s[0] / s[-1]) ** 2:.4g}") if full else np.inf)
