"""The picture of a result: pictures know results, and no result its picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Pictures = Mapping[type, Callable[..., Any]]


def plot(result: object, ax: Any = None, **options: Any) -> Any:  # noqa: ANN401 - axes or figures of matplotlib
    """Draw a result.

    Parameters
    ----------
    result
        Of `fem`, `balancing` or rotorid: modes, a Campbell diagram, a correction, a fit, …
    ax
        Axes of matplotlib to draw on; None: those of a new figure. Corrections, identifications and fits take
        none: they get a new figure with all pictures.
    options
        For the function that draws: the picture of a response takes `nodes`.

    Returns
    -------
    What that function returns: the axes, or a new figure.

    Raises
    ------
    TypeError
        For what has no picture.
    """
    room = type(result).__module__.split(".")
    pictures = _ROOMS.get(room[0]) or _ROOMS.get(".".join(room[:2]))
    draw = None if pictures is None else pictures().get(type(result))
    if draw is None:
        raise TypeError(f"there is no picture of a {type(result).__name__}")
    return draw(result, ax, **options)


def _rotors() -> Pictures:
    import fem
    from fem import plots

    return {
        fem.Modes: plots.draw_modes,
        fem.Response: plots.draw_response,
        fem.Campbell: plots.draw_campbell,
        fem.SpeedMap: plots.draw_speed_map,
    }


def _balancing() -> Pictures:
    import balancing
    from balancing import plots

    return {
        balancing.Correction: lambda result, ax: plots.correction_figure(result),
        balancing.Tolerance: plots.draw_tolerance,
        balancing.Unbalance: plots.draw_unbalance,
        balancing.TrialWeight: plots.draw_trial_weight,
    }


def _reduction() -> Pictures:
    from rotorid.reduction import Methods, Placement, Reduction, StabilityCost, plots

    return {
        Reduction: plots.plot_reduction,
        Methods: plots.plot_methods,
        Placement: plots.plot_placement,
        StabilityCost: plots.plot_stability,
    }


def _identify() -> Pictures:
    from rotorid.identify import Fit, Identification
    from rotorid.identify.plots import figure_identification
    from rotorid.identify.plots_records import figure_fit

    return {
        Identification: lambda result, ax: figure_identification(result),
        Fit: lambda result, ax: figure_fit(result),
    }


_ROOMS: dict[str, Callable[[], Pictures]] = {
    "fem": _rotors,
    "balancing": _balancing,
    "rotorid.reduction": _reduction,
    "rotorid.identify": _identify,
}
