"""Reduction, identification and fits give what is stored: see `tests/golden`."""

from golden.checks import checks

test_as_stored = checks("models")
