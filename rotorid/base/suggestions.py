"""Suggestions for misspelt names: the nearest known name, for messages (did you mean)."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from typing import TypeVar

_S = TypeVar("_S", bound=str)


def suggest(name: str, known: Iterable[str]) -> str | None:
    """The known name nearest to a misspelt one, or None."""
    word, names = name.casefold(), {each.casefold(): each for each in reversed([*known])}
    unit_missing = [each for each in names if each.startswith(f"{word}_")][-1:]
    close = difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    begun = [each for each in names if len(name) > 2 and each.startswith(word)]
    nearest = unit_missing or close or begun
    return names[nearest[0]] if nearest and (nearest is not begun or len(begun) == 1) else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """`" (did you mean 'x'?)"`, or an empty text.

    >>> did_you_mean("prob DE", ["probe DE", "bearing DE"])
    " (did you mean 'probe DE'?)"
    """
    near = suggest(name, known)
    return f" (did you mean {near!r}?)" if near else ""


def one_of(value: str, what: str, known: Sequence[_S]) -> _S:
    """A name out of a few.

    Raises
    ------
    ValueError
        For another one, with the nearest.
    """
    if value not in known:
        raise ValueError(
            f"{what} {value!r} is not known{did_you_mean(value, known)}: one of {', '.join(known)}"
        )
    return next(one for one in known if one == value)
