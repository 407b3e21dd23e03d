"""Registries: every method is told once, and found by its name."""

import pytest

from rotorid.base.choices import Method, find, names
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


def test_words():
    kind = (Method("one", "the first", 1), Method("other", "the second", 2))
    with pytest.raises(
        ValueError, match=r"^method 'othr' is not known \(did you mean 'other'\?\): one of one, other$"
    ):
        find(kind, "othr", "method")
