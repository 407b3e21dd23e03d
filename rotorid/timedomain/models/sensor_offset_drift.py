"""Nuisance terms of the outputs: offset, drift and hum of the sensors, estimated beside the parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence


def with_nuisance(
    outputs: Mapping[str, str], offset: bool, drift: bool, hum_Hz: Sequence[float]
) -> tuple[dict[str, str], list[str]]:
    """Outputs with a constant, a part that grows with t, and sinusoids, each with a factor of its own.

    Returns
    -------
    Their expressions, and the names of the factors, which are to be estimated from 0 for every record.

    Examples
    --------
    >>> with_nuisance({"x": "1e6*x"}, True, False, [50])[1]
    ['offset_x', 'hum50_cos_x', 'hum50_sin_x']
    """
    terms = {"offset": "1"} if offset else {}
    terms |= {"drift": "t"} if drift else {}
    for frequency in hum_Hz:
        name = f"hum{frequency:g}".replace(".", "_").replace("-", "_").replace("+", "")
        terms |= {f"{name}_{wave}": f"{wave}({2 * math.pi * frequency!r}*t)" for wave in ("cos", "sin")}
    texts = {
        output: " + ".join([f"({text})", *(f"{name}_{output}*{term}" for name, term in terms.items())])
        for output, text in outputs.items()
    }
    return texts, [f"{name}_{output}" for output in outputs for name in terms]
