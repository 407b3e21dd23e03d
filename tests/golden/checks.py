"""The tests of a group of cases: all run in one process, each is compared by its own test."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import pytest

from golden.cases import CASES, REFUSED, STORED
from golden.comparing import compare
from golden.running import run
from golden.storing import read, storable

KEPT = (*STORED, *REFUSED)


@cache
def outcomes(names: tuple[str, ...], environment: tuple[tuple[str, str], ...]) -> Mapping[str, Any]:
    """Of the cases, now."""
    return run(names, environment=dict(environment))


def checks(*groups: str, environment: tuple[tuple[str, str], ...] = ()) -> Callable[..., None]:
    """A test for each stored case of the groups."""
    names = tuple(name for name in KEPT if CASES[name].group in groups)

    @pytest.mark.parametrize("name", names)
    def test_as_stored(name: str) -> None:
        different = compare(name, read(name), storable(name, outcomes(names, environment)[name]))
        assert not different, "\n".join([f"rotorid {CASES[name].command}", *map(str, different)])

    return test_as_stored
