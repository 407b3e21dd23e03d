"""Everything that holes can hold, by trying it."""

import itertools

import numpy as np


def everything(holes, most=np.inf):
    """Vector, number of pieces and weight of all that can be mounted; `most` with what is there."""
    sizes = range(holes.per_hole + 1)
    one = [c for c in itertools.product(sizes, repeat=len(holes.pieces)) if sum(c) <= holes.per_hole]
    found = []
    for choice in itertools.product(*(one if free else one[:1] for free in holes.free)):
        counts = np.array(choice)
        vector = (counts @ holes.pieces) @ np.exp(1j * holes.angles)
        enough = holes.stock is None or (counts.sum(axis=0) <= holes.stock).all()
        if enough and abs(holes.mounted + vector) <= most:
            found.append((vector, counts.sum(), (counts @ holes.pieces).sum()))
    return tuple(np.array(part) for part in zip(*found, strict=True))
