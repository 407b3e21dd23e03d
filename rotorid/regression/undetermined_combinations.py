"""Parameters that the data do not determine: their combinations that are determined, and these in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rotorid.base.arrays import FloatArray
from rotorid.base.text import listing

WORD_TOLERANCE = 1e-7
"""A parameter whose share in the null space is below this is taken as determined."""


@dataclass(frozen=True)
class FoundCombination:
    """A combination of parameters that the data determine.

    Attributes
    ----------
    words
        The combination, such as "b − 0.5·d" or "b*(1 - delta)".
    value, std
        Its estimate and one standard deviation, None where that is unknown.
    """

    words: str
    value: float
    std: float | None

    def line(self) -> str:
        """One line of text: "b − 0.5·d = 3.1 ± 0.2"."""
        return f"{self.words} = {self.value:.6g}" + ("" if self.std is None else f" ± {self.std:.2g}")


@dataclass(frozen=True)
class Combination(FoundCombination):
    """A linear one.

    Attributes
    ----------
    words, value, std
        As in `FoundCombination`.
    coefficients
        Shape (n,), one per parameter.
    """

    coefficients: FloatArray


def combination_words(coefficients: FloatArray, names: Sequence[str]) -> str:
    """Write a linear combination as an engineer would: "b − 0.5·d"."""
    text = ""
    for c, name in zip(coefficients, names, strict=True):
        if c == 0:
            continue
        sign = ("−" if c < 0 else "") if not text else (" − " if c < 0 else " + ")
        size = f"{abs(c):.4g}"
        text += sign + (name if size == "1" else f"{size}·{name}")
    return text


def only_determined(parameters: Sequence[str], lost: Sequence[str], words: Sequence[str]) -> str:
    """Say which parameters and combinations, in words, are determined and which parameters are not."""
    seen = [name for name in parameters if name not in lost]
    seen += [w for w in words if w not in seen and any(name in w for name in lost)]
    verb = "is" if len(seen) == 1 else "are"
    text = f"only {listing(seen, 'and')} {verb} determined" if seen else "nothing is determined"
    itself = "itself is" if len(lost) == 1 else "themselves are"
    return f"{text}; {listing(lost, 'and')} by {itself} not"


def echelon(rows: FloatArray) -> list[FloatArray]:
    """Reduced row echelon form with clean zeros; columns are compared after scaling to unit length."""
    norms = np.linalg.norm(rows, axis=0)
    scale = np.where(norms > 0, norms, 1.0)
    A = rows / scale
    pivots: list[int] = []
    for column in range(A.shape[1]):
        r = len(pivots)
        if r == A.shape[0]:
            break
        best = r + int(np.argmax(np.abs(A[r:, column])))
        if abs(A[best, column]) <= WORD_TOLERANCE:
            continue
        A[[r, best]] = A[[best, r]]
        A[r] /= A[r, column]
        others = np.arange(A.shape[0]) != r
        A[others] -= np.outer(A[others, column], A[r])
        pivots.append(column)
    A[np.abs(A) <= WORD_TOLERANCE] = 0.0
    back = A * scale
    return [_snap(back[i] / back[i, p]) for i, p in enumerate(pivots)]


def _snap(row: FloatArray) -> FloatArray:
    """Whole and half numbers that rounding has blurred become exact again."""
    near = np.round(2 * row) / 2
    return np.where(np.abs(row - near) <= WORD_TOLERANCE * np.maximum(1.0, np.abs(row)), near, row)
