"""A long table of cases as one test: every case is tried, and all that fail are listed."""

import functools
import inspect

import pytest

LONGEST = 300


def each_of(names, values, *, ids=None):
    """Like `pytest.mark.parametrize`, but one test for the whole table.

    Fixtures are shared by the cases; `tmp_path` is a folder of its own for each.
    """
    names = [name.strip() for name in names.split(",")] if isinstance(names, str) else list(names)
    cases = [(value,) if len(names) == 1 else tuple(value) for value in values]
    assert cases, "a table without cases"
    assert all(len(case) == len(names) for case in cases), "a case for every name"
    labels = [_label(number, case, ids) for number, case in enumerate(cases)]

    def decorate(function):
        signature = inspect.signature(function)
        fixtures = [name for name in signature.parameters if name not in names]
        assert set(names) <= set(signature.parameters), "names of the function"

        @functools.wraps(function)
        def test(**given):
            failed, first = [], None
            for number, (label, case) in enumerate(zip(labels, cases, strict=True)):
                own = dict(given)
                if "tmp_path" in own:
                    own["tmp_path"] = given["tmp_path"] / str(number)
                    own["tmp_path"].mkdir()
                try:
                    function(**own, **dict(zip(names, case, strict=True)))
                except (Exception, pytest.fail.Exception) as error:
                    failed.append(f"{label}: {type(error).__name__}: {_short(error)}")
                    first = first or error
            if failed:
                words = "\n".join(failed)
                raise AssertionError(f"{len(failed)} of {len(cases)} cases fail:\n{words}") from first

        test.__signature__ = inspect.Signature([signature.parameters[name] for name in fixtures])
        test.cases = cases
        return test

    return decorate


def _label(number, case, ids):
    if ids is not None:
        return str(ids(case[0]) if callable(ids) else ids[number])
    words = ", ".join(repr(value) for value in case)
    return f"case {number + 1} ({words if len(words) <= 100 else words[:99] + '…'})"


def _short(error):
    words = " ".join(str(error).split())
    return words if len(words) <= LONGEST else words[: LONGEST - 1] + "…"
