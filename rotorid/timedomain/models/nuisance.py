"""Nuisance terms of the outputs: offset, drift and hum of the sensors, estimated beside the parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Nuisance:
    """What is added to every output, for every record anew.

    Attributes
    ----------
    offset, drift
        Whether there is a constant, and one that grows with the time t.
    hum_Hz
        Frequencies of interference, Hz.
    """

    offset: bool = False
    drift: bool = False
    hum_Hz: Sequence[float] = ()

    def terms(self) -> dict[str, str]:
        """Expression of t by the first part of a parameter's name.

        Examples
        --------
        >>> Nuisance(drift=True, hum_Hz=[50]).terms()
        {'drift': 't', 'hum50_cos': 'cos(314.1592653589793*t)', 'hum50_sin': 'sin(314.1592653589793*t)'}
        """
        found = {"offset": "1"} if self.offset else {}
        found |= {"drift": "t"} if self.drift else {}
        for frequency in self.hum_Hz:
            name = f"hum{frequency:g}".replace(".", "_").replace("-", "_").replace("+", "")
            found |= {f"{name}_{wave}": f"{wave}({2 * math.pi * frequency!r}*t)" for wave in ("cos", "sin")}
        return found

    def added(self, outputs: Mapping[str, str]) -> tuple[dict[str, str], list[str]]:
        """Outputs with these terms, and the names of their factors, which are to be estimated from 0.

        Examples
        --------
        >>> Nuisance(offset=True).added({"x": "1e6*x"})
        ({'x': '(1e6*x) + offset_x*(1)'}, ['offset_x'])
        """
        terms = self.terms()
        texts = {
            output: " + ".join([f"({text})", *(f"{name}_{output}*({term})" for name, term in terms.items())])
            for output, text in outputs.items()
        }
        return texts, [f"{name}_{output}" for output in outputs for name in terms]
