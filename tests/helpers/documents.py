"""Documents of results, compared."""

import pytest


def same(found, printed):
    """The same document but for the provenance, numbers to 1e-9."""
    assert plain(found, "provenance") == plain(printed, "provenance")


def plain(value, *left_out):
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items() if key not in left_out}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return pytest.approx(value, rel=1e-9, abs=1e-12)
    return value
