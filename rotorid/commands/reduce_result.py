"""The small model of `reduce` as files: for motion and estimation, and as a state space."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.json import SCHEMA_VERSION, now
from rotorid.base.text import counted

if TYPE_CHECKING:
    from rotorid.reduction import Reduction, SmallModel

NAMED = ("states", "inputs", "outputs")


def small_of(result: Reduction, modal_damping: Sequence[float] = ()) -> SmallModel:
    """The small model of a reduction.

    Raises
    ------
    ValueError
        Without a rotor, or with masses that are not positive.
    """
    from rotorid.reduction import small_model

    if result.rotor is None:
        raise ValueError(
            "measured modes and a compliance alone say nothing of bearings and the second plane: give a rotor"
        )
    nodes = [int(node) for node in result.nodes]
    return small_model(result.rotor, nodes, result.masses.solution, modal_damping=modal_damping)


def model_files(
    path: Path,
    result: Reduction,
    small: SmallModel,
    speed: float,
    name: str = "",
    *,
    keeps_supports: bool = False,
    forces: Sequence[int | str] = (),
) -> dict[Path, bytes]:
    """The small model as a file, with tables of supports over speed; `name`: of the rotor,
    `forces`: nodes of measured ones.

    For `fit` dampers to be estimated stand at every mass, beginning with 2 % of its critical damping.

    Raises
    ------
    ValueError
        For forces where no mass stands.
    """
    from rotorid.files.small_model import linear_equations, small_model_files

    at = ", ".join(map(str, result.nodes))
    made = f"{name} reduced to masses at nodes {at} (formula 50, {counted(result.modes, 'mode')})"
    if keeps_supports:
        return small_model_files(path, small, [f"{made}, its supports kept, SI"])
    if lost := [node for node in forces if node not in result.nodes]:
        raise ValueError(f"--force: no mass of the model stands at {lost[0]}; masses stand at {at}")
    motion = linear_equations(small, speed, False)
    masses = [f"{axis}{node}" for axis in "xy" for node in result.nodes]
    places = {x: motion.index(x) for x in masses if x in motion.coordinates}
    critical = {f"d_{x}": 2 * math.sqrt(motion.M[i, i] * motion.K[i, i]) for x, i in places.items()}
    equations: dict[str, Any] = {
        "speed_rad_s": speed,
        "inputs": [f"f_x{node}" for node in forces],
        "estimate": {x: float(f"{0.02 * c:.3g}") for x, c in critical.items()},
        "bounds": {x: [0.0, math.inf] for x in critical},
    }
    comments = [
        f"{made}, SI",
        "For fit, identify and simulate: what is known of the start stands in [equations.initial], where "
        "v_x7 is the velocity of x7; forces of time in [equations.force]; measured ones: --force NODES.",
    ]
    return small_model_files(path, small, comments, {k: v for k, v in equations.items() if v})


def state_space_bytes(small: SmallModel, speed: float, ending: str = ".json") -> bytes:
    """A, B, C, D in both planes at a speed, rad/s, as a file that ends in .json, .npz or .mat."""
    import numpy as np

    document = {"schema_version": SCHEMA_VERSION, **small.state_space(speed).to_dict()}
    if ending == ".json":
        return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()
    arrays = {key: np.array(value) for key, value in document.items()}
    stream = io.BytesIO()
    if ending == ".mat":
        from scipy.io import savemat

        savemat(
            stream,
            arrays | {key: np.array(value, dtype=object) for key, value in document.items() if key in NAMED},
        )
        # the text at the top, of 116 bytes, has the date of the clock
        head = f"MATLAB 5.0 MAT-file, written by rotorid, {now():%Y-%m-%d %H:%M:%S} UTC"
        return head.encode().ljust(116) + stream.getvalue()[116:]
    # numpy before 2.1 would store allow_pickle= as an array
    np.savez(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()
