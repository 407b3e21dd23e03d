"""Pictures of balancing: a table of contents. Nothing is shown or saved here."""

from balancing.plots.along_shaft import draw_tolerance, draw_unbalance
from balancing.plots.correction import correction_figure, residual_figure
from balancing.plots.discs import draw_disc, draw_plane, weight_figure
from balancing.plots.polar import draw_trial_weight, solutions_figure, trial_figure

__all__ = [
    "correction_figure",
    "draw_disc",
    "draw_plane",
    "draw_tolerance",
    "draw_trial_weight",
    "draw_unbalance",
    "residual_figure",
    "solutions_figure",
    "trial_figure",
    "weight_figure",
]
