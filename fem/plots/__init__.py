"""Pictures of rotors, their modes and their vibration: a table of contents."""

from fem.plots.campbell import campbell_figure, draw_campbell, draw_log_decrements, draw_speed_map
from fem.plots.response import (
    bode_figure,
    draw_orbits,
    draw_polar,
    draw_response,
    influence_figure,
    orbits_figure,
    polar_figure,
    right_angles,
)
from fem.plots.rotor import draw_deflected_shape, draw_modes, draw_rotor, smooth_shapes

__all__ = [
    "bode_figure",
    "campbell_figure",
    "draw_campbell",
    "draw_deflected_shape",
    "draw_log_decrements",
    "draw_modes",
    "draw_orbits",
    "draw_polar",
    "draw_response",
    "draw_rotor",
    "draw_speed_map",
    "influence_figure",
    "orbits_figure",
    "polar_figure",
    "right_angles",
    "smooth_shapes",
]
