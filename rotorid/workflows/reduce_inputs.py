"""What `reduce` takes: measured modes at the masses, errors, shares."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import counted
from rotorid.workflows.option_values import number, numbers

if TYPE_CHECKING:
    import fem
    from rotorid.reduction import InputErrors
    from rotorid.tables.data.modes_table import MeasuredModes

ERRORS = ("compliance", "frequencies", "shapes", "seal_stiffness")


def at(data: MeasuredModes, rotor: fem.Rotor | None, wanted: list[Any], path: Path | str) -> MeasuredModes:
    """The measured modes at these places only, in their order."""
    known = [rotor.node(node) for node in data.nodes] if rotor is not None else list(data.nodes)
    lost = [str(node) for node in wanted if node not in known]
    if lost:
        raise ValueError(
            f"{path}: no shape was measured at {', '.join(lost)}; there are {', '.join(map(str, known))}"
        )
    rows = [known.index(node) for node in wanted]
    return dataclasses.replace(
        data,
        nodes=tuple(wanted),
        shapes=data.shapes[rows],
        shape_std=None if data.shape_std is None else data.shape_std[rows],
    )


def errors(
    given: str | Mapping[str, float] | None, data: MeasuredModes | None, modes: int, n: int
) -> InputErrors | None:
    """Read "compliance=1.3,shapes=1" or "alpha12=1.3" in percent for n masses.

    What the table of modes states counts where nothing else is given.
    """
    from rotorid.reduction import InputErrors

    stated: dict[str, Any] = {}
    if data is not None and data.frequency_std is not None:
        stated["frequencies"] = data.frequency_std[:modes]
    if data is not None and data.shape_std is not None:
        stated["shapes"] = data.shape_std[:, :modes]
    for name, value in shares({} if given is None else given, "--errors", "compliance=1.3,shapes=1").items():
        if not 0 <= value < 1:
            raise ValueError(
                f"--errors: {name}={100 * value:g} is no standard deviation from 0 to 100 percent"
            )
        _state(stated, name, value, n, modes)
    return InputErrors(**stated) if stated else None


def _state(stated: dict[str, Any], name: str, value: float, n: int, modes: int) -> None:
    """Note the error of a kind of input, or of one: alpha12, U31, omega1, c2."""
    if name in ERRORS:
        stated[name] = value
        return
    shapes = {"alpha": (n, n), "U": (n, modes), "omega": (modes,), "c": (n,)}
    kinds = dict(zip(shapes, ("compliance", "shapes", "frequencies", "seal_stiffness"), strict=True))
    found = re.fullmatch(r"(alpha|U)(\d)(\d)|(omega|c)(\d)", name)
    stem = (found.group(1) or found.group(4)) if found else ""
    at = tuple(int(d) - 1 for d in found.group(2, 3, 5) if d) if found else ()
    if not found or any(not 0 <= i < size for i, size in zip(at, shapes[stem], strict=True)):
        raise ValueError(
            f"--errors: {name!r} is not known{did_you_mean(name, ERRORS)}; known are {', '.join(ERRORS)}, or "
            f"one input of {counted(n, 'mass', 'masses')} and {counted(modes, 'mode')}: "
            f"alpha11 to alpha{n}{n}, U11 to U{n}{modes}, omega1 to omega{modes}, c1 to c{n}"
        )
    table = np.array(np.broadcast_to(stated.get(kinds[stem], 0.0), shapes[stem]))
    table[at] = value
    if stem == "alpha":
        table[at[::-1]] = value
    stated[kinds[stem]] = table


def shares(given: str | Mapping[str, float], what: str, example: str) -> dict[str, float]:
    """Read "alpha12=1.3,U31=-0.3", in percent, as shares; numbers in a mapping are shares."""
    return numbers(given, what, example, 100.0)


def damping_ratios(given: str | Sequence[float] | None) -> Sequence[float]:
    """Read "1,0.5", in percent, as damping ratios."""
    if not isinstance(given, str):
        return given or ()
    values = [number(part) for part in given.split(",")]
    if not all(0 <= value < 100 for value in values):
        raise ValueError(
            f"--damping {given!r}: percent of critical damping of the first modes, from 0 to below 100, 1,0.5"
        )
    return [value / 100 for value in values]
