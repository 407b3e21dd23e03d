"""Reading and writing files: the only place with units, conventions and file formats.

Everything behind it is plain data in SI, with positive phase = lead and angles with the rotation. Every
complaint about a file names the file, row and column, what was found and what was expected (`InputError`).
"""

from rotorid.tables.data.measurements import read_measurements
from rotorid.tables.data.modes_table import MeasuredModes, read_compliance, read_modes
from rotorid.tables.data.records import read_record
from rotorid.tables.job.job_file import Job, job_from_files, read_job
from rotorid.tables.models.harmonic_file import HarmonicFile, read_harmonic_model
from rotorid.tables.models.ode_file import read_ode_model
from rotorid.tables.models.small_model_file import read_small_model
from rotorid.tables.reader.problems import InputError, Problem, TableWarning
from rotorid.tables.reader.table_writing import write_table
from rotorid.tables.rotor.bow_table import read_bow
from rotorid.tables.rotor.rotor_file import read_rotor, rotor_files
from rotorid.tables.rotor.rotor_writing import write_rotor
from rotorid.tables.rotor.unbalance_table import read_unbalance
from rotorid.tables.runs.influence_table import influence_frame, read_influence, write_influence
from rotorid.tables.runs.stated_conventions import Conventions, StatedErrors
from rotorid.tables.runs.trials import read_trials

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
    "read_bow",
    "read_compliance",
    "read_harmonic_model",
    "read_influence",
    "read_job",
    "read_measurements",
    "read_modes",
    "read_ode_model",
    "read_record",
    "read_rotor",
    "read_small_model",
    "read_trials",
    "read_unbalance",
    "rotor_files",
    "write_influence",
    "write_rotor",
    "write_table",
]
