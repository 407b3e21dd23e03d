"""A state space as a file: JSON, or arrays for numpy or MATLAB."""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from fem import StateSpace

NAMED = ("states", "inputs", "outputs")


def state_space_bytes(model: StateSpace, ending: str) -> bytes:
    """A, B, C, D and their names in the format of a file that ends in .json, .npz or .mat."""
    document = model.to_dict()
    if ending == ".json":
        return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()
    arrays = {key: np.array(value) for key, value in document.items()}
    stream = io.BytesIO()
    if ending == ".mat":
        from scipy.io import savemat

        named = {key: np.array(value, dtype=object) for key, value in document.items() if key in NAMED}
        savemat(stream, arrays | named)
    else:
        # numpy before 2.1 would store allow_pickle= as an array
        np.savez(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()
