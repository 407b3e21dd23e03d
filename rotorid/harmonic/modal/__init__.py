"""Modes from amplitudes around resonances."""
