"""The tests of a group of cases: all run in one process, each is compared by its own test."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

from golden.cases import CASES
from golden.comparing import compare
from golden.running import run
from golden.storing import parts, read


@cache
def outcomes(group: str) -> dict[str, Any]:
    """Of the stored cases of a group, now."""
    return run(name for name, case in CASES.items() if case.group == group and case.stored)


def checks(*groups: str) -> Callable[..., None]:
    """A test for each stored case of the groups."""

    @pytest.mark.parametrize(
        "name", [name for name, case in CASES.items() if case.group in groups and case.stored]
    )
    def test_as_stored(name: str) -> None:
        found = compare(name, read(name), parts(outcomes(CASES[name].group)[name]))
        assert not found, "\n".join([f"rotorid {CASES[name].command}", *found])

    return test_as_stored
