"""Pictures of rotors, their modes and their vibration: a table of contents."""

from fem.plots_campbell import campbell_figure, draw_campbell, draw_log_decrements
from fem.plots_map import draw_speed_map
from fem.plots_modes import draw_modes
from fem.plots_orbits import draw_orbits
from fem.plots_response import draw_bode, draw_influence, draw_polar, draw_response
from fem.plots_rotor import draw_rotor
from rotorid.base.style import COLORS, new_axes

__all__ = [
    "COLORS",
    "campbell_figure",
    "draw_bode",
    "draw_campbell",
    "draw_influence",
    "draw_log_decrements",
    "draw_modes",
    "draw_orbits",
    "draw_polar",
    "draw_response",
    "draw_rotor",
    "draw_speed_map",
    "new_axes",
]
