"""What `rotorid reduce` takes: places of the masses, measured modes, errors, percentages."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.text import counted
from rotorid.workflows.parameters import band
from rotorid.workflows.parameters import nodes as parse_nodes

if TYPE_CHECKING:
    import fem
    from rotorid.reduction import InputErrors, Placement, Reduction
    from rotorid.tables.data.modes_table import MeasuredModes

ERRORS = ("compliance", "frequencies", "shapes", "seal_stiffness")


def check_used(options: Mapping[str, tuple[bool, bool, str]]) -> None:
    """Refuse options that would have no effect: {option: (given, of use, what makes it of use)}."""
    for option, (is_given, of_use, needed) in options.items():
        if is_given and not of_use:
            raise ValueError(f"{option} does nothing without {needed}")


def places(
    rotor: fem.Rotor,
    nodes: str | None,
    place: str | None,
    placement: Placement | None,
    data: MeasuredModes | None,
    masses: int,
    speed: float | None,
) -> list[int]:
    """Nodes of the masses: as given, by the rule asked for, or those of the measured shapes."""
    if nodes is not None and place is not None:
        raise ValueError("--nodes and --place are two ways to the same end: choose one")
    if nodes is not None:
        return [rotor.node(node) for node in parse_nodes(nodes, "--nodes")]
    if place == "book":
        from rotorid.reduction import book_nodes

        return list(book_nodes(rotor, masses, speed=speed))
    if placement is not None:
        which = {
            "mac": placement.best_by_mac,
            "compromise": placement.compromise,
            "best": placement.best_by_frequency,
        }[place or "compromise"]
        if which is None:
            raise ValueError(
                f"no choice of {counted(masses, 'node')} gives positive masses with "
                f"{counted(placement.modes, 'mode')}: use other --modes or --masses"
            )
        return [int(node) for node in placement.nodes[which]]
    if data is not None:
        return [rotor.node(node) for node in data.nodes]
    raise ValueError(
        "say where the masses stand: --nodes 7,12,18, or --place best, compromise, mac or book, or --rank"
    )


def at(data: MeasuredModes, rotor: fem.Rotor | None, wanted: list[Any], path: Path) -> MeasuredModes:
    """The measured modes at these places only, in their order."""
    import dataclasses

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


def errors(text: str | None, data: MeasuredModes | None, modes: int, n: int) -> InputErrors | None:
    """Read "compliance=1.3,shapes=1" or "alpha12=1.3" in percent for n masses.

    What the table of modes states counts where nothing else is given.
    """
    from rotorid.reduction import InputErrors

    stated: dict[str, Any] = {}
    if data is not None and data.frequency_std is not None:
        stated["frequencies"] = data.frequency_std[:modes]
    if data is not None and data.shape_std is not None:
        stated["shapes"] = data.shape_std[:, :modes]
    if text is not None:
        for name, value in _pairs(text, "--errors", "compliance=1.3,shapes=1").items():
            if not 0 <= value < 100:
                raise ValueError(f"--errors: {name}={value:g} is no standard deviation from 0 to 100 percent")
            _state(stated, name, value / 100, n, modes)
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
        from rotorid.base.suggestions import did_you_mean

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


def changes(text: str) -> dict[str, float]:
    """Read "alpha12=1.3,U31=-0.3" as relative changes."""
    return {name: value / 100 for name, value in _pairs(text, "--what-if", "alpha12=1.3").items()}


def percents(text: str | None, option: str) -> list[float]:
    """Read "1,0.5" as damping ratios."""
    if text is None:
        return []
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = [-1.0]
    if not all(0 <= value < 100 for value in values):
        raise ValueError(
            f"{option} {text!r}: percent of critical damping of the first modes, from 0 to below 100, 1,0.5"
        )
    return [value / 100 for value in values]


def speed_range(text: str) -> tuple[float, float]:
    """Read "0:9000rpm"."""
    try:
        found = band(text)
    except ValueError:
        found = None
    if found is None:
        raise ValueError(
            f"--stability {text!r} is not a range: use LOWEST:HIGHEST, in rad/s, or with rpm or Hz at the end"
        )
    return found


def from_tables(
    compliance: Path | None,
    measured: Path | None,
    nodes: str | None,
    modes: int | None,
    seals: str | None,
    stated: str | None,
    how: Mapping[str, Any],
) -> tuple[Reduction, list[Path]]:
    """A reduction without a rotor: its compliance and its modes from tables."""
    from rotorid.reduction import reduce_measured
    from rotorid.tables.data.modes_table import read_compliance, read_modes

    if compliance is None or measured is None:
        raise ValueError("give a rotor, or --compliance and --measured, which take its place")
    data = read_modes(measured)
    wanted = list(data.nodes)
    if nodes is not None:
        labels = [str(node) for node in parse_nodes(nodes, "--nodes")]
        named = {str(node): node for node in data.nodes}
        wanted = [named.get(label, label) for label in labels]
    data = at(data, None, wanted, measured)
    known, alpha = read_compliance(compliance, wanted)
    order = [known.index(node) for node in wanted]
    used = min(2, len(data.frequencies), len(wanted)) if modes is None else modes
    springs = _pairs(seals, "--seals", "12=2e6") if seals else {}
    lost = [name for name in springs if name not in map(str, wanted)]
    if lost:
        raise ValueError(
            f"--seals: no mass stands at {lost[0]!r}; masses stand at {', '.join(map(str, wanted))}"
        )
    result = reduce_measured(
        alpha[np.ix_(order, order)],
        data.frequencies,
        data.shapes,
        used,
        nodes=wanted,
        seal_stiffness=[springs.get(str(node), 0.0) for node in wanted],
        errors=errors(stated, data, used, len(wanted)),
        **how,
    )
    return result, [compliance, measured]


def _pairs(text: str, option: str, example: str) -> dict[str, float]:
    found: dict[str, float] = {}
    for part in text.split(","):
        name, sign, number = part.partition("=")
        try:
            value = float(number)
        except ValueError:
            value = float("nan")
        if not sign or not np.isfinite(value) or not name.strip():
            raise ValueError(f"{option} {text!r}: NAME=NUMBER with commas, such as {example}")
        if name.strip() in found:
            raise ValueError(f"{option} {text!r}: {name.strip()} stands twice")
        found[name.strip()] = value
    return found
