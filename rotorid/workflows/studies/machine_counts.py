"""Counts of a study of machines, part by part, so that memory does not grow with the samples."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from rotorid.base.arrays import AnyArray, FloatArray, IntArray

UNSTABLE = "the drawn rotor is unstable, and has no steady response"
UNDETERMINED = "the readings do not determine a correction"
EDGES = np.geomspace(1e-3, 1e3, 601)
"""Of the counted ratios, about 2.3 % wide; 1 is one of them."""


def count_machines(parts: Iterable[Mapping[str, AnyArray]], planes: int, most: int) -> dict[str, Any]:
    """Fields of `StudiedMachines` for so many planes and corrections."""
    runs = np.array([1, *(planes + 1 + k for k in range(1, most + 1))])
    met, held = np.zeros(len(runs), dtype=np.int64), np.zeros((2, 2), dtype=np.int64)
    ratios, reasons = np.zeros((2, EDGES.size - 1), dtype=np.int64), Counter[str]()
    for columns in parts:
        met += (columns["runs_needed"][:, None] <= runs).sum(axis=0)
        said = columns["warned"]
        for k in (0, 1):
            held[k] += int((columns["held"][said == k] == 1).sum()), int((said == k).sum())
        why = filter(None, columns["why"].tolist())
        reasons.update(UNSTABLE if one == UNSTABLE else UNDETERMINED for one in why)
        last = columns["ratio_0"].copy()
        ratios[0] += _histogram(last)
        for k in range(1, most + 1):
            last = np.where(np.isfinite(columns[f"ratio_{k}"]), columns[f"ratio_{k}"], last)
        ratios[1] += _histogram(last)
    return {"met": met, "runs": runs, "held": held, "reasons": dict(reasons), "ratios": ratios}


def _histogram(values: FloatArray) -> IntArray:
    known = values[np.isfinite(values)]
    return np.histogram(np.clip(known, EDGES[0], EDGES[-1]), EDGES)[0]
