"""Options of `calibrate` that name unknown numbers of a rotor, with what is known of them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from fem import Rotor
from fem.parameters import expand, numbers_of, parameter_value
from rotorid.base.text import counted
from rotorid.calibration import Unknown
from rotorid.calibration.unknowns import check_different
from rotorid.commands.option_values import number, pairs

ENTRIES = {"kxx": (0, 0, 0), "kxy": (0, 0, 1), "kyx": (0, 1, 0), "kyy": (0, 1, 1)}
ENTRIES |= {f"c{name[1:]}": (1, *place[1:]) for name, place in ENTRIES.items()}
"""Coefficients of a support and their places in its tables."""
KNOWN = (
    ("material.youngs_modulus.scale", 0.01),
    ("disc[*].scale", 0.01),
    ("bearing[*].pedestal_stiffness.scale", 0.1),
    ("probe[*].angle", 2.0),
)
"""Unknown besides, with these standard deviations about what the files say."""
_COMMA = r",(?![^\[]*\])"  # but not in brackets
_EXAMPLE = "bearing[1].kxx=7e7+-20%"


def unknowns(
    rotor: Rotor,
    probes: Sequence[str],
    estimate: str | Sequence[str],
    prior: str | Mapping[str, str] = "",
    *,
    exact: bool,
) -> list[Unknown]:
    """The unknown numbers of these options, and those of `KNOWN` unless the files are `exact`.

    Raises
    ------
    ValueError
        For what cannot be read, and numbers that the rotor does not have.
    """
    numbers: dict[str, Unknown] = {}
    parts = re.split(_COMMA, estimate) if isinstance(estimate, str) else estimate
    for part in parts:
        name, _, path = (piece.strip() for piece in part.rpartition("="))
        paths = list(_expanded(rotor, path, probes))
        if name and len(paths) != 1:
            raise ValueError(f"--estimate {part.strip()}: one name for {counted(len(paths), 'number')}")
        if twice := next((each for each in paths if each in numbers), None):
            raise ValueError(f"--estimate: {twice} stands twice")
        numbers |= {each: Unknown(each, name) for each in paths}
    if not numbers:
        raise ValueError("--estimate: all coefficients of these supports are 0; name those that are not")
    check_different(rotor, list(numbers))
    labels = [unknown.label for unknown in numbers.values()]
    if twice := next((label for label in labels if labels.count(label) > 1), None):
        raise ValueError(f"--estimate: two numbers are called {twice}")
    named = {number for path in numbers for number in numbers_of(rotor, path)}
    for pattern, std in () if exact else KNOWN:
        for path in _there(rotor, pattern, probes):
            if not numbers_of(rotor, path) & named:
                value = parameter_value(rotor, path)
                numbers.setdefault(path, Unknown(path, prior=(value, std), beside=True))
    _apply_priors(rotor, numbers, prior)
    return list(numbers.values())


def _there(rotor: Rotor, pattern: str, probes: Sequence[str]) -> tuple[str, ...]:
    """What a pattern stands for; nothing where the rotor has none."""
    try:
        return expand(rotor, pattern, probes) if probes or not pattern.startswith("probe") else ()
    except ValueError:
        return ()


def _expanded(rotor: Rotor, path: str, probes: Sequence[str]) -> Iterator[str]:
    """Single numbers of a path; `bearing[1].*` is all coefficients that are not 0, of tables their scales."""
    head, _, last = path.rpartition(".")
    if last != "*":
        yield from expand(rotor, path, probes)
        return
    for each in expand(rotor, f"{head}.kxx", probes):
        supports = [rotor.supports[place] for _, place, _ in numbers_of(rotor, each)]
        tables = [np.stack(support.at(np.array(support.speeds or (0.0,)))) for support in supports]
        for name, (quantity, i, j) in ENTRIES.items():
            values = np.concatenate([table[quantity, :, i, j] for table in tables])
            if values.any():
                scaled = np.ptp(values) > 0 or any(support.speeds for support in supports)
                yield f"{each.removesuffix('kxx')}{name}{'.scale' if scaled else ''}"


def _apply_priors(rotor: Rotor, numbers: dict[str, Unknown], given: str | Mapping[str, str]) -> None:
    """Priors of the numbers that a name, a path or a pattern with `*` stands for."""
    parts = re.split(_COMMA, given) if isinstance(given, str) and given else given or []
    for pattern, text in pairs(parts, "--prior", lambda _, text: text, _EXAMPLE).items():
        literal = re.sub(r"\[(?!\*\])([^\]]*)\]", r"[[]\1]", pattern).replace("[*]", "[[]*]")
        hit = [p for p, u in numbers.items() if pattern in (p, u.name) or fnmatchcase(p, literal)]
        hit = hit or [p for p in numbers if fnmatchcase(p, f"{literal}.scale")]
        if not hit:
            raise ValueError(
                f"--prior: nothing that is estimated is called {pattern!r}: {', '.join(numbers)}"
            )
        for path in hit:
            prior = _prior(text, parameter_value(rotor, path), pattern)
            numbers[path] = replace(numbers[path], prior=prior)


def _prior(text: str, value: float, pattern: str) -> tuple[float, float]:
    """`20%`, `1e6`, `7e7+-20%` or `7e7±1e6` about a value."""
    centre, sign, spread = re.sub(r"\+-|±", "±", text).rpartition("±")
    middle = number(centre) if sign else value
    std = number(spread.removesuffix("%")) * (abs(middle) / 100 if spread.endswith("%") else 1.0)
    if not (np.isfinite(middle) and std > 0):
        raise ValueError(f"--prior {pattern}={text}: a standard deviation is needed, such as {_EXAMPLE}")
    return middle, std
