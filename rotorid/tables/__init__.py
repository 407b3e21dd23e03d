"""Reading and writing files: the only place with units, conventions and file formats.

Everything behind it is plain data in SI, with positive phase = lead and angles with the rotation. Every
complaint about a file names the file, row and column, what was found and what was expected (`InputError`).
"""

from rotorid.tables.conventions import Conventions, StatedErrors
from rotorid.tables.harmonicfile import HarmonicFile, read_harmonic_model
from rotorid.tables.influence import influence_frame, read_influence, write_influence
from rotorid.tables.job import Job, job_from_files, read_job
from rotorid.tables.measurements import read_measurements
from rotorid.tables.modes import MeasuredModes, read_compliance, read_modes
from rotorid.tables.motionfile import read_motion
from rotorid.tables.odefile import read_ode_model
from rotorid.tables.problems import InputError, Problem, TableWarning
from rotorid.tables.records import read_record
from rotorid.tables.rotor import read_rotor
from rotorid.tables.rotorfile import rotor_files
from rotorid.tables.rotorwriting import write_rotor
from rotorid.tables.trials import read_trials
from rotorid.tables.unbalance import read_unbalance
from rotorid.tables.writing import write_table

__all__ = [
    "Conventions",
    "HarmonicFile",
    "InputError",
    "Job",
    "MeasuredModes",
    "Problem",
    "StatedErrors",
    "TableWarning",
    "influence_frame",
    "job_from_files",
    "read_compliance",
    "read_harmonic_model",
    "read_influence",
    "read_job",
    "read_measurements",
    "read_modes",
    "read_motion",
    "read_ode_model",
    "read_record",
    "read_rotor",
    "read_trials",
    "read_unbalance",
    "rotor_files",
    "write_influence",
    "write_rotor",
    "write_table",
]
