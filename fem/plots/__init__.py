"""Pictures of rotors, their modes and their vibration: a table of contents."""

from fem.plots.bode import draw_bode, draw_influence, draw_polar, draw_response, influence_figure
from fem.plots.campbell_diagram import campbell_figure, draw_campbell, draw_log_decrements
from fem.plots.drawing import draw_rotor
from fem.plots.mode_shapes import draw_modes
from fem.plots.orbit_paths import draw_orbits
from fem.plots.readings import bode_figure, draw_deflected_shape, orbits_figure, polar_figure
from fem.plots.speed_map_picture import draw_speed_map
from fem.plots.static_line import draw_deflection
from rotorid.base.plot_style import COLORS, new_axes

__all__ = [
    "COLORS",
    "bode_figure",
    "campbell_figure",
    "draw_bode",
    "draw_campbell",
    "draw_deflected_shape",
    "draw_deflection",
    "draw_influence",
    "draw_log_decrements",
    "draw_modes",
    "draw_orbits",
    "draw_polar",
    "draw_response",
    "draw_rotor",
    "draw_speed_map",
    "influence_figure",
    "new_axes",
    "orbits_figure",
    "polar_figure",
]
