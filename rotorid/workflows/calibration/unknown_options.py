"""Options of `calibrate` that name unknown numbers of a rotor, with what is known of them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from fem.model.rotor import Rotor
from fem.model.rotor_parameters import expand, parameter_value
from rotorid.calibration import Unknown
from rotorid.workflows.option_values import band, number, pairs

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
    prior: str | Mapping[str, str],
    bounds: str | Mapping[str, str],
    *,
    exact: bool,
) -> list[Unknown]:
    """The unknown numbers of these options, and those of `KNOWN` unless the files are `exact`.

    Raises
    ------
    ValueError
        For what cannot be read, and numbers that the rotor does not have.
    """
    found: dict[str, Unknown] = {}
    parts = re.split(_COMMA, estimate) if isinstance(estimate, str) else estimate
    for part in parts:
        name, _, path = (piece.strip() for piece in part.rpartition("="))
        paths = list(_expanded(rotor, path, probes))
        for each in paths:
            found[each] = Unknown(each, name if len(paths) == 1 else "")
    named = {part.split(".")[0] for part in found}
    for pattern, std in () if exact else KNOWN:
        for path in _there(rotor, pattern, probes):
            if path.rpartition(".")[0] not in found and (path[0] != "d" or path.split(".")[0] not in named):
                found.setdefault(path, Unknown(path, prior=(_value(rotor, path), std), beside=True))
    _apply(rotor, found, prior, "--prior", probes)
    _apply(rotor, found, bounds, "--bounds", probes)
    return list(found.values())


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
        one = each.rpartition(".")[0]
        kind, index = one.rstrip("]").split("[")
        own = [support for support in rotor.supports if support.kind == kind]
        called = [support.name for support in own]
        support = own[called.index(index) if index in called else int(index) - 1]
        tables = np.stack(support.at(np.array(support.speeds or (0.0,))))  # (2, rows, 2, 2)
        for name, (quantity, i, j) in ENTRIES.items():
            if tables[quantity, :, i, j].any():
                yield f"{one}.{name}{'.scale' if support.speeds else ''}"


def _value(rotor: Rotor, path: str) -> float:
    return parameter_value(rotor, path)


def _apply(
    rotor: Rotor,
    found: dict[str, Unknown],
    given: str | Mapping[str, str],
    what: str,
    probes: Sequence[str],
) -> None:
    """Priors or bounds of the numbers that a name, a path or a pattern with `*` stands for."""
    if isinstance(given, str):
        parts = re.split(_COMMA, given) if given else []
        given = pairs(parts, what, lambda _, text: text, _EXAMPLE)
    for pattern, text in given.items():
        literal = re.sub(r"\[(?!\*\])([^\]]*)\]", r"[[]\1]", pattern).replace("[*]", "[[]*]")
        hit = [p for p, u in found.items() if pattern in (p, u.name) or fnmatchcase(p, literal)]
        hit = hit or [p for p, u in found.items() if fnmatchcase(p, f"{literal}.scale")]
        if not hit:
            raise ValueError(f"{what}: nothing that is estimated is called {pattern!r}: {', '.join(found)}")
        for path in hit:
            value = _value(rotor, path)
            if what == "--prior":
                found[path] = replace(found[path], prior=_prior(str(text), value, pattern))
            else:
                low, high = band(str(text), what) or (0.0, 0.0)
                found[path] = replace(found[path], bounds=(low, high))


def _prior(text: str, value: float, pattern: str) -> tuple[float, float]:
    """`20%`, `1e6`, `7e7+-20%` or `7e7±1e6` about a value."""
    centre, sign, spread = re.sub(r"\+-|±", "±", text).rpartition("±")
    try:
        middle = number(centre) if sign else value
        std = number(spread.rstrip("%")) * (abs(middle) / 100 if spread.endswith("%") else 1.0)
    except ValueError:
        std = middle = np.nan
    if not (np.isfinite(middle) and std > 0):
        raise ValueError(f"--prior {pattern}={text}: a standard deviation is needed, such as {_EXAMPLE}")
    return middle, std
