"""Writing models for identification: the matrices of a rotor or a reduced model as a model file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorid.base.arrays import BoolArray
from rotorid.base.versions import SCHEMA_VERSION

if TYPE_CHECKING:
    from fem import Motion


def ode_model_bytes(
    motion: Motion,
    dampers: Mapping[str, float],
    *,
    comments: Sequence[str] = (),
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
) -> bytes:
    """A model file of M y'' + C y' + K y = f whose dampers to the ground are to be estimated.

    It is read by `read_ode_model` (time records) and by `read_harmonic_model` (amplitudes). Where a
    coordinate has no mass, the matrices cannot be integrated: the file holds the states of `fem.state_space`
    instead, in which damped massless coordinates are of first order and undamped ones are eliminated.

    Parameters
    ----------
    motion
        Matrices and names of the displacements, of one plane or both.
    dampers
        {displacement: starting value of its damper, N·s/m}; the parameter of `x7` is called `d_x7`. Empty:
        nothing is estimated. In the form of states each needs a displacement with mass.
    comments
        Lines at the top.
    inputs
        Forces that are measured: `f_x7` on the displacement `x7`. Records then need a column of each. Without
        inputs `read_harmonic_model` takes a force on every coordinate of the matrices; a file of states has
        none then.
    outputs
        What is measured: displacements `x7` or velocities `v_x7`. Default: all displacements, in the form of
        states those with mass.

    Returns
    -------
    bytes
        All digits of the matrices are kept.

    Raises
    ------
    ValueError
        Matrices that are not finite, names that do not exist or stand twice, a damper at a massless
        displacement, and what `fem.state_space` refuses.
    """
    _check(motion, inputs, outputs)
    massless = np.asarray(~(motion.M.any(axis=0) | motion.M.any(axis=1)), dtype=bool)
    lines = [f"# {part}" for line in comments for part in line.splitlines() or [""]]
    lines.append(f"schema_version = {SCHEMA_VERSION}")
    if motion.speed:
        lines.append(f"speed_rad_s = {float(motion.speed)!r}")
    if inputs:
        lines.append(f"inputs = {_names(inputs)}")
    if massless.any():
        lines += _states(motion, massless, dampers, inputs, outputs)
    else:
        lines += _matrices(motion, dampers, inputs, outputs)
    lines += ["", "[estimate]", *(f"d_{name} = {float(value)!r}" for name, value in dampers.items())]
    if dampers:
        lines += ["", "[bounds]", *(f"d_{name} = [0, inf]" for name in dampers)]
    return ("\n".join(lines) + "\n").encode()


def _matrices(
    motion: Motion,
    dampers: Mapping[str, float],
    inputs: Sequence[str],
    outputs: Sequence[str] | None,
) -> list[str]:
    damping: list[list[str]] = [[_number(value) for value in row] for row in motion.C]
    for name in dampers:
        i = motion.index(name)
        known = damping[i][i]
        damping[i][i] = f'"d_{name}"' if known == "0" else f'"{known} + d_{name}"'
    lines = [f"coordinates = {_names(motion.coordinates)}"]
    for key, rows in (
        ("M", [[_number(value) for value in row] for row in motion.M]),
        ("C", damping),
        ("K", [[_number(value) for value in row] for row in motion.K]),
    ):
        lines += [f"{key} = [", *(f"  [{', '.join(row)}]," for row in rows), "]"]
    if inputs:
        lines += ["", "[force]", *(f'{name.removeprefix("f_")} = "{name}"' for name in inputs)]
    if outputs is not None:
        lines += ["", "[outputs]", *(f'{name} = "{name}"' for name in outputs)]
    return lines


def _states(
    motion: Motion,
    massless: BoolArray,
    dampers: Mapping[str, float],
    inputs: Sequence[str],
    outputs: Sequence[str] | None,
) -> list[str]:
    """Rates s' = A s + B u − Σ B_i d_i v_i with the dampers' forces −d_i v_i on their coordinates."""
    import fem

    names = motion.coordinates
    for name in dampers:
        if massless[motion.index(name)]:
            raise ValueError(
                f"a damper to be estimated at {name}, which has no mass, does not stand linearly in the "
                "states; estimate dampers at masses"
            )
    shown = [name for name, light in zip(names, massless, strict=True) if not light]
    shown = list(outputs) if outputs is not None else shown
    forces = [*inputs, *(f"f_{name}" for name in dampers if f"f_{name}" not in inputs)]
    rates = [f"v_{name}" for name in dampers]
    model = fem.state_space(motion, inputs=forces, outputs=[*shown, *(x for x in rates if x not in shown)])
    A, B, C, D = model
    u = [forces.index(name) for name in inputs]
    velocity = {
        x: _sum([*C[i], *D[i, u]], [*model.states, *inputs])
        for i, x in enumerate(model.outputs)
        if x in rates
    }
    lines = ["", "[states]"]
    for i, state in enumerate(model.states):
        text = _sum([*A[i], *B[i, u]], [*model.states, *inputs])
        for name in dampers:
            share = B[i, forces.index(f"f_{name}")]
            if share:
                text += f" - ({_number(share)})*d_{name}*({velocity[f'v_{name}']})"
        lines.append(f'{state} = "{text}"')
    lines += ["", "[initial]", *(f"{name} = 0" for name in model.states), "", "[outputs]"]
    for i, name in enumerate(shown):
        lines.append(f'{name} = "{_sum([*C[i], *D[i, u]], [*model.states, *inputs])}"')
    return lines


def _sum(values: Sequence[float], names: Sequence[str]) -> str:
    """Σ value · name, as an expression with all digits."""
    terms = [
        name if value == 1 else f"({_number(value)})*{name}"
        for value, name in zip(values, names, strict=True)
        if value
    ]
    return " + ".join(terms) or "0"


def _check(motion: Motion, inputs: Sequence[str], outputs: Sequence[str] | None) -> None:
    for key in "MCK":
        if not np.isfinite(getattr(motion, key)).all():
            raise ValueError(f"{key} holds numbers that are not finite: such a model cannot be written")
    forces, rates = ([f"{kind}_{name}" for name in motion.coordinates] for kind in "fv")
    _check_names("input", inputs, forces)
    _check_names("output", outputs or (), [*motion.coordinates, *rates])


def _check_names(kind: str, chosen: Sequence[str], allowed: Sequence[str]) -> None:
    for i, name in enumerate(chosen):
        if name not in allowed:
            raise ValueError(f"no {kind} {name!r} in this model: they are named like {allowed[0]}")
        if name in chosen[:i]:
            raise ValueError(f"the {kind} {name} is named twice")


def _names(names: Iterable[str]) -> str:
    return "[" + ", ".join(f'"{name}"' for name in names) + "]"


def _number(value: float) -> str:
    return "0" if value == 0 else repr(float(value))
