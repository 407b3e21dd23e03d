"""Identification: coefficients from harmonic tests, time records and modes, resonances and run-ups."""
