"""Writing models for identification: the matrices of a rotor or a reduced model as a model file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from fem.motion import Motion

FloatArray = NDArray[np.float64]


def ode_model_bytes(
    motion: Motion,
    dampers: Mapping[str, float],
    initial: Mapping[str, float],
    *,
    comments: Sequence[str] = (),
) -> bytes:
    """A model file M y'' + C y' + K y = 0 whose dampers to the ground are to be estimated.

    Parameters
    ----------
    motion
        Matrices and names of the displacements.
    dampers
        {displacement: starting value of its damper, N·s/m}; the parameter of `x7` is called `d_x7`.
    initial
        Initial values {displacement or velocity: value} that are not 0.
    comments
        Lines at the top.

    Returns
    -------
    bytes
        What `read_ode_model` reads; all digits of the matrices are kept.
    """
    lines = [f"# {line}" for line in comments]
    names = [f"d_{name}" for name in dampers]
    damping: list[list[str]] = [[_number(value) for value in row] for row in motion.C]
    for parameter, name in zip(names, dampers, strict=True):
        i = motion.index(name)
        known = damping[i][i]
        damping[i][i] = f'"{parameter}"' if known == "0" else f'"{known} + {parameter}"'
    lines.append("coordinates = [" + ", ".join(f'"{name}"' for name in motion.coordinates) + "]")
    for key, rows in (
        ("M", [[_number(value) for value in row] for row in motion.M]),
        ("C", damping),
        ("K", [[_number(value) for value in row] for row in motion.K]),
    ):
        lines += [f"{key} = [", *(f"  [{', '.join(row)}]," for row in rows), "]"]
    if initial:
        lines += ["", "[initial]", *(f"{name} = {_number(value)}" for name, value in initial.items())]
    lines += ["", "[estimate]"]
    lines += [f"{parameter} = {value!r}" for parameter, value in zip(names, dampers.values(), strict=True)]
    lines += ["", "[bounds]", *(f"{parameter} = [0, inf]" for parameter in names)]
    return ("\n".join(lines) + "\n").encode()


def _number(value: float) -> str:
    return "0" if value == 0 else repr(float(value))
