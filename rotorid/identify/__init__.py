"""Identification: coefficients of models from harmonic tests, vibration modes and time records."""
