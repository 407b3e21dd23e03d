"""Calibration of rotor models: numbers of a rotor from what the machine itself tells."""

from rotorid.calibration.calibrate import calibrate
from rotorid.calibration.readings import RunReadings, run_errors
from rotorid.calibration.result import CalibratedRotor
from rotorid.calibration.unknowns import Unknown

__all__ = ["CalibratedRotor", "RunReadings", "Unknown", "calibrate", "run_errors"]
