"""A root in a bracket whose end values are known: scipy's `brentq`, for every search over speed."""

from __future__ import annotations

from collections.abc import Callable


def bracketed_root(
    function: Callable[[float], float],
    ends: tuple[float, float],
    values: tuple[float, float],
    tolerance: float,
) -> float:
    """Where a function of speed vanishes.

    Parameters
    ----------
    function
        Continuous; not called at the ends.
    ends, values
        The bracket, and the function there: of different sign, or zero.
    tolerance
        Of the root.
    """
    from scipy.optimize import brentq

    known = dict(zip(ends, values, strict=True))
    return float(
        brentq(
            lambda at: known[at] if at in known else function(at),
            *ends,
            xtol=tolerance,
            rtol=1e-15,
        )
    )
