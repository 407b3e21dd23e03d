"""Modes from harmonic tests and run-ups; all else is in `rotorid.identify`."""

__all__: list[str] = []
