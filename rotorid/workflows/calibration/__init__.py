"""Calibration of a rotor model by data, its design beforehand, and balancing in one shot with it."""
