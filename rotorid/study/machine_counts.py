"""Counts of a study of machines, part by part, so that memory does not grow with the samples."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.study.drawn_machine import UNSTABLE

if TYPE_CHECKING:
    import pandas as pd

UNDETERMINED = "the readings do not determine a correction"
EDGES = np.geomspace(1e-3, 1e3, 601)
"""Of the counted ratios, about 2.3 % wide; 1 is one of them."""


def count_machines(parts: Iterable[pd.DataFrame], planes: int, most: int) -> dict[str, Any]:
    """Fields of `StudiedMachines` for so many planes and corrections; one part after the other is read."""
    runs = np.array([1, *range(planes + 2, planes + 2 + most)])
    met, held = np.zeros(most + 1, dtype=np.int64), np.zeros((2, 2), dtype=np.int64)
    ratios, reasons = np.zeros((2, EDGES.size - 1), dtype=np.int64), Counter[str]()
    for part in parts:
        met += (part["runs_needed"].to_numpy()[:, None] <= runs).sum(axis=0)
        for k, warned in enumerate((False, True)):
            own = part["held"][part["warned"] == warned]
            held[k] += (own == True).sum(), own.size  # noqa: E712 - None where there is no region
        reasons.update(why if why == UNSTABLE else UNDETERMINED for why in part["why"].dropna())
        read = part.filter(like="ratio_").ffill(axis=1).dropna().clip(EDGES[0], EDGES[-1]).to_numpy()
        ratios += [np.histogram(read[:, k], EDGES)[0] for k in (0, -1)]
    return {"met": met, "runs": runs, "held": held, "reasons": dict(reasons), "ratios": ratios}
