"""Calibration of rotor models: numbers of a rotor from what the machine itself tells."""

from rotorid.calibration.calibrate import calibrate
from rotorid.calibration.result import CalibratedRotor
from rotorid.calibration.rows_of_runs import RunReadings, run_errors
from rotorid.calibration.unknowns import Unknown

__all__ = ["CalibratedRotor", "RunReadings", "Unknown", "calibrate", "run_errors"]
