"""Workflows of rotors with forces that are not linear: equilibrium, motion in time, periodic motion."""
