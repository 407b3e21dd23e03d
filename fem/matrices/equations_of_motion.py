"""The equations of motion of a rotor as plain matrices, for programs that want nothing else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fem.matrices.lateral_planes import both_planes, project
from fem.model.rotor import Rotor
from rotorid.base.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Motion:
    """M q'' + C q' + K q = f of a rotor at one speed; real, in SI.

    Attributes
    ----------
    M, C, K
        Mass, damping (with the gyroscopic effect) and stiffness, shape (n, n).
    coordinates
        Name of each unknown: `x3` and `y3` are the deflections of node 3, m; `tilt_x3` and `tilt_y3` the tilt
        of the cross-section there (the slope dx/dz without shear); with shear `left_x3` and `right_x3` the
        shear angles at the ends of element 3; `foot_x1` and `foot_y1` the pedestal of the first support, m.
    speed
        rad/s.
    """

    M: FloatArray
    C: FloatArray
    K: FloatArray
    coordinates: tuple[str, ...]
    speed: float

    def index(self, name: str) -> int:
        """Where an unknown stands, from 0.

        Raises
        ------
        ValueError
            For an unknown that does not exist.
        """
        if name not in self.coordinates:
            raise ValueError(f"no unknown {name!r}: they are {self.coordinates[0]} … {self.coordinates[-1]}")
        return self.coordinates.index(name)


def equations_of_motion(rotor: Rotor, *, speed: float = 0.0, plane: str = "both") -> Motion:
    """Mass, damping and stiffness matrices of a rotor.

    Parameters
    ----------
    rotor
        With all that its model holds; tables of supports are read at `speed`.
    speed
        rad/s.
    plane
        "both", or "x" alone: without gyroscopic effect and coupling between the planes, so only for a rotor
        that has neither.

    Raises
    ------
    ValueError
        A plane that does not exist or is coupled to the other, a speed that is not finite, negative, or
        outside the table of a support.

    Examples
    --------
    >>> from fem import Rotor, Support
    >>> shaft = Rotor(length=[0.5, 0.5], outer_diameter=0.05, supports=[Support(1, 1e7), Support(3, 1e7)])
    >>> motion = equations_of_motion(shaft, plane="x")
    >>> motion.coordinates
    ('x1', 'tilt_x1', 'x2', 'tilt_x2', 'x3', 'tilt_x3')

    Notes
    -----
    The signs are those of `fem.matrices.lateral_planes`: rotation from x to y; M y'' … − Ω G x'.
    """
    if plane not in ("both", "x"):
        raise ValueError(f"no plane {plane!r}: it is 'both' or 'x'")
    if not (np.isfinite(speed) and speed >= 0):
        raise ValueError(f"the speed must be finite and not negative, in rad/s, not {speed}")
    P = both_planes(rotor, complex_coordinate=False)
    Q = project(P, np.eye(P.A.size))
    damping, stiffness = (matrix[0] for matrix in Q.at(np.array([float(speed)])))
    kinds = ("", "tilt_", "left_", "right_")[: P.A.stride]
    names = [
        f"{kind}{axis}{node}"
        for axis in "xy"
        for node in range(1, rotor.n_nodes + 1)
        for kind in (kinds if node < rotor.n_nodes else kinds[:2])
    ]
    names += [f"foot_{axis}{int(i) + 1}" for axis in "xy" for i in P.pedestals]
    kept = np.arange(len(names))
    if plane == "x":
        in_x = np.array([name.split("_")[-1].startswith("x") for name in names])
        if any(matrix[np.ix_(in_x, ~in_x)].any() for matrix in (damping, stiffness)):
            raise ValueError("the planes x and y of this rotor are coupled: take both")
        kept = np.flatnonzero(in_x)
    pick = np.ix_(kept, kept)
    return Motion(Q.M[pick], damping[pick], stiffness[pick], tuple(names[i] for i in kept), float(speed))
