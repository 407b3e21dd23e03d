"""Figures of the balancing sheet: each plane from its end, and vibration before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rotorid.report.conventions_explained import plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import Correction, Holes, Mounted

_WIDTH, _REACH, _TALL = 3.4, (1.95, 2.15), 1.42
"""Of a picture of a plane: inches on paper; half its width (of two, of more planes) and height in radii."""


def plane_figure(
    result: Correction,
    plane: str,
    *,
    holes: Holes | None = None,
    mounted: Mounted | None = None,
) -> Figure:
    """Draw one plane with what goes into it; material to remove is drawn as a crossed circle.

    Parameters
    ----------
    result
        The correction.
    plane
        One of its planes.
    holes
        Of the plane, where nothing was chosen for them.
    mounted
        Pieces in the holes of all planes, or None: the weight is drawn where it stands.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    from balancing.plots import draw_disc

    p = result.planes.index(plane)
    labels = result.labels
    wanted, mounting = complex(result.weights[p]), None
    if mounted is not None:
        holes, mounting = mounted.holes[p], mounted.discrete.mountings[p]
        if mounted.on_top_of is not None:
            wanted = complex(result.to_add[result.mounted.planes.index(plane)])
    loose = (wanted,) if mounting is None and wanted != 0 else ()
    if mounted is not None and mounting is None and mounted.weights[p] != 0:
        loose = (complex(mounted.weights[p]),)
    with mpl.rc_context({"font.size": 10.0}):
        arcs = () if result.limits is None else result.limits.forbidden[p]
        lines = 1 + 2 * (mounted is not None) + bool(arcs)
        reach = _REACH[len(result.planes) > 2]
        axes = _WIDTH * _TALL / reach
        height = axes + 0.37 + 0.15 * lines  # a title above the axes, lines of text below
        figure = Figure(figsize=(_WIDTH, height))
        ax = figure.add_axes((0.0, 1 - (axes + 0.25) / height, 1.0, axes / height))
        draw_disc(
            ax,
            plain(plane),
            holes,
            mounting,
            labels,
            remove=plane in result.remove,
            weight=wanted,
            loose=loose,
            forbidden=arcs,
        )
        ax.set(xlim=(-reach, reach), ylim=(-_TALL, _TALL))
    return figure
