"""Every kind of picture of the samples: no two texts overlap, and none leaves the canvas."""

import pytest
from pictures import COMMANDS, clashes, figures_of

OFTEN = ("balance checked", "balance holes", "split", "unbalance")
"""Those that `make test` draws."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in OFTEN else pytest.mark.full) for name in COMMANDS]
)
@pytest.mark.parametrize("share", [1.0, 0.6])
def test_texts_have_room_of_their_own(name, share):
    found = {}
    for caption, figure in figures_of(name).items():
        figure.set_dpi(100 * share)
        found[caption] = clashes(figure)
    assert {caption: words for caption, words in found.items() if words} == {}


def test_what_overlaps_or_is_cut_is_found():
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3, 2))
    for x, word in ((0.5, "one"), (0.55, "two"), (0.98, "too long")):
        figure.text(x, 0.5, word)
    assert sorted(clashes(figure)) == ["'too long' leaves the canvas", "'two' over 'one'"]
