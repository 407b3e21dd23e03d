"""Whether a steady response exists at all: a cheap look at the stability of the rotor that is asked about."""

from __future__ import annotations

import numpy as np

from fem.model.rotor import Rotor
from fem.model.supports import Support
from rotorid.base.arrays import FloatArray
from rotorid.base.units import speed_text

_MODES = 6  # of lowest frequency that are looked at
_PEAKS = 3
_STEPS = 12  # of the search for the speed where growth starts


def surely_stable(rotor: Rotor) -> bool:
    """Whether nothing feeds energy into whirl, so that no mode can grow.

    So it is without material damping where each stiffness matrix is symmetric and holds, and no damping
    matrix is negative; gyroscopic moments do no work.
    """
    return not np.any(rotor.material_damping) and all(_passive(support) for support in rotor.supports)


def growing_warning(rotor: Rotor, speeds: FloatArray, size: FloatArray) -> tuple[str, ...]:
    """What to say if a mode grows at the first, middle or last speed, or at the largest peaks.

    Parameters
    ----------
    rotor
        The rotor.
    speeds
        rad/s, in any order, shape (S,).
    size
        How large the response is at each, shape (S,).
    """
    from fem.growth import GROWTH
    from fem.matrices.lateral_planes import both_planes
    from fem.solvers.reduced_whirl import solve_whirl
    from fem.whirl import available_modes

    order = np.argsort(speeds, kind="stable")
    ranked, height = speeds[order], size[order]
    inner = np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])) + 1
    peaks = inner[np.argsort(-height[inner], kind="stable")[:_PEAKS]]
    some = np.unique(ranked[[0, len(ranked) // 2, -1, *peaks]])
    m = min(_MODES, available_modes(rotor))
    try:
        whirl = solve_whirl(both_planes(rotor), some, m)
    except ValueError as problem:
        return (f"whether the rotor is stable at these speeds is not known: {problem}",)
    values = whirl.found.values
    grows = np.nan_to_num(values.real / np.abs(values), nan=-np.inf) > GROWTH
    away = [bool(real.size) and real.max() > 1e-6 * whirl.scale for real in whirl.found.real]
    if not grows.any() and not any(away):
        return ()
    if not grows.any():
        at = float(some[np.argmax(away)])
        return (
            f"the steady response does not exist at {at:.6g} rad/s: the rotor runs away without oscillating; "
            "check negative stiffness",
        )
    return (_said(rotor, ranked, float(some[np.flatnonzero(grows.any(axis=1))[0]]), m),)


def _said(rotor: Rotor, speeds: FloatArray, unstable: float, m: int) -> str:
    """From which speed on which mode grows."""
    from fem.campbell import campbell

    below = float(speeds[0])
    if unstable > below:
        found = campbell(rotor, np.linspace(below, unstable, _STEPS + 1), m).unstable
    else:
        found = campbell(rotor, [unstable], m).unstable
    if not found:
        return f"the steady response does not exist at {unstable:.6g} rad/s: a mode grows"
    first = found[0]
    where = "at and above" if first.from_start else "above"
    return (
        f"the steady response does not exist {where} {speed_text(first.speed)}: "
        f"mode {first.mode} ({first.way} whirl, {first.frequency:.6g} rad/s) grows there; amplitudes "
        "computed there are never reached"
    )


def _passive(support: Support) -> bool:
    """Whether a support cannot drive whirl at any speed."""
    if support.plain:
        return bool(support.stiffness >= 0 and support.damping >= 0)
    for k, c in zip(*support.at(np.array(support.speeds or (0.0,))), strict=True):
        slack = 1e-12 * np.abs(k).max()
        if abs(k[0, 1] - k[1, 0]) > slack or np.linalg.eigvalsh(k)[0] < -slack:
            return False
        if np.linalg.eigvalsh(c + c.T)[0] < -1e-12 * np.abs(c).max():
            return False
    return True
