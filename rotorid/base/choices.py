"""Names that people type: methods by their names, and the nearest name to a misspelt one (did you mean)."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

_T = TypeVar("_T")
_S = TypeVar("_S", bound=str)


@dataclass(frozen=True)
class Method(Generic[_T]):
    """One of a kind; a kind is a tuple of them, the usual one first.

    Attributes
    ----------
    name
        As one types it.
    about
        What it does, without a full stop.
    function
        What does it.
    title
        As texts call it, where that is not the name.
    """

    name: str
    about: str
    function: _T
    title: str = ""


def names(methods: Sequence[Method[Any]]) -> tuple[str, ...]:
    """As one types them."""
    return tuple(method.name for method in methods)


def find(methods: Sequence[Method[_T]], name: str, what: str) -> Method[_T]:
    """The one of that name; ValueError for another, with the nearest."""
    return methods[names(methods).index(one_of(name, what, names(methods)))]


def suggest(name: str, choices: Iterable[str]) -> str | None:
    """The choice nearest to a misspelt name, or None.

    First one that only has its unit more, then a similar one.
    """
    word, spelt = name.casefold(), {each.casefold(): each for each in reversed([*choices])}
    unit_missing = [each for each in spelt if each.startswith(f"{word}_")][-1:]
    nearest = unit_missing or difflib.get_close_matches(word, spelt, n=1)
    return spelt[nearest[0]] if nearest else None


def did_you_mean(name: str, choices: Iterable[str]) -> str:
    """`" (did you mean 'x'?)"`, or an empty text.

    >>> did_you_mean("prob DE", ["probe DE", "bearing DE"])
    " (did you mean 'probe DE'?)"
    """
    near = suggest(name, choices)
    return f" (did you mean {near!r}?)" if near else ""


def one_of(value: str, what: str, choices: Sequence[_S]) -> _S:
    """A name out of a few.

    Raises
    ------
    ValueError
        For another one, with the nearest.
    """
    for choice in choices:
        if choice == value:
            return choice
    raise ValueError(
        f"{what} {value!r} is not known{did_you_mean(value, choices)}: one of {', '.join(choices)}"
    )
