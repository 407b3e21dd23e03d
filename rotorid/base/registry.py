"""Registry of methods: each told once with name, one sentence for help and documents, and function."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from rotorid.base.suggestions import one_of

_T = TypeVar("_T")


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


def described(methods: Sequence[Method[Any]]) -> str:
    """All with their sentences, for help."""
    return "; ".join(f"{method.name}: {method.about}" for method in methods) + "."
