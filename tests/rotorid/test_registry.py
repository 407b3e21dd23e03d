"""Registries: every method is told once, and found by its name."""

import pytest

from rotorid.base.choices import find, names
from rotorid.identify.fit_records import METHODS
from rotorid.identify.simulation import INTEGRATORS

KINDS = (METHODS, INTEGRATORS)


@pytest.mark.parametrize("kind", KINDS)
def test_names_are_unique_and_sentences_there(kind):
    assert len(set(names(kind))) == len(kind)
    for method in kind:
        assert method.about
        assert not method.about.endswith(".")
        assert find(kind, method.name, "method") is method
