"""Motion of rotors under forces that are not linear: equilibrium, motion in time, periodic motion."""
