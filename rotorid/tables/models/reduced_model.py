"""A reduced rotor as a model file for `rotorid fit` and `identify`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from rotorid.base.text import counted
from rotorid.tables.models.model_writing import ode_model_bytes

if TYPE_CHECKING:
    import fem
    from rotorid.reduction import Reduction, SmallRotor


def reduced_model_bytes(
    result: Reduction,
    small: SmallRotor | None = None,
    speed: float = 0.0,
    *,
    both_planes: bool = False,
    forces: Sequence[int | str] = (),
    name: str = "",
) -> bytes:
    """Write a model file in which dampers to be estimated stand at every mass.

    They begin with 2 % of the critical damping of their mass.

    Parameters
    ----------
    result
        The masses.
    small
        With what turns, couples and damps; None: the masses alone.
    speed
        At which it turns, rad/s.
    both_planes
        Planes x and y also where nothing couples them.
    forces
        Nodes of measured forces, inputs of the model.
    name
        Of the rotor, for the comment.

    Raises
    ------
    ValueError
        For a mass that is not positive, and for a force where no mass stands.
    """
    if (result.masses.solution <= 0).any():
        raise ValueError(
            "a model with a mass that is not positive cannot be written: use other nodes or modes"
        )
    motion = result.equations_of_motion if small is None else _motion(small, speed, both_planes)
    masses = [f"{axis}{node}" for axis in "xy" for node in result.nodes]
    masses = [name for name in masses if name in motion.coordinates]
    critical = {x: 2 * np.sqrt(motion.M[i, i] * motion.K[i, i]) for x in masses for i in [motion.index(x)]}
    inputs = [f"f_x{node}" for node in forces]
    if lost := [name for name in inputs if name.removeprefix("f_") not in masses]:
        raise ValueError(
            f"--force: no mass of the model stands at {lost[0].removeprefix('f_x')}; masses stand at "
            f"{', '.join(map(str, result.nodes))}"
        )
    which = "both planes" if any(name.startswith("y") for name in masses) else "the plane x"
    said = [
        f"{name} reduced to masses at nodes {', '.join(map(str, result.nodes))} (formula 50, "
        f"{counted(result.modes, 'mode')}), {which} at {motion.speed:.6g} rad/s, SI",
        "Put what is known of the start into [initial]; v_x7 is the velocity of x7.",
    ]
    if motion.M.any(axis=0).all() and not inputs:
        said.append("Put forces of time into [force].")
    elif not inputs:
        said.append("Measured forces: write the file with --force NODES.")
    return ode_model_bytes(
        motion,
        {x: float(f"{0.02 * c:.3g}") for x, c in critical.items()},
        {},
        comments=said,
        inputs=inputs,
        outputs=None if set(masses) == set(motion.coordinates) else masses,
    )


def _motion(small: SmallRotor, speed: float, both_planes: bool) -> fem.Motion:
    """One plane where nothing couples them; without massless unknowns where no damping acts on them."""
    motion = small.motion(speed)
    y = np.array(["y" in name for name in motion.coordinates])
    across = np.ix_(~y, y)
    coupled = bool(motion.C[across].any() or motion.K[across].any())
    plane: Literal["both", "x"] = "both" if both_planes or coupled else "x"
    try:
        return small.motion(speed, plane, "condensed")
    except ValueError:  # damped supports stay, as states of first order
        return small.motion(speed, plane)
