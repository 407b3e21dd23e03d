"""Reading and writing files: the only place with units, conventions and file formats.

Everything behind it is plain data in SI, with positive phase = lead and angles with the rotation. Every
complaint about a file names the file, row and column, what was found and what was expected (`InputError`).
Every name below is loaded when it is first used.
"""

from __future__ import annotations

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rotorid.files.conventions import Conventions as Conventions
    from rotorid.files.conventions import StatedErrors as StatedErrors
    from rotorid.files.influence import influence_frame as influence_frame
    from rotorid.files.influence import read_influence as read_influence
    from rotorid.files.influence import write_influence as write_influence
    from rotorid.files.problems import InputError as InputError
    from rotorid.files.problems import Problem as Problem
    from rotorid.files.problems import TableWarning as TableWarning
    from rotorid.files.runs import read_trials as read_trials
    from rotorid.files.table_writing import write_table as write_table
    from rotorid.tables.data.measurements import read_measurements as read_measurements
    from rotorid.tables.data.modes_table import MeasuredModes as MeasuredModes
    from rotorid.tables.data.modes_table import read_compliance as read_compliance
    from rotorid.tables.data.modes_table import read_modes as read_modes
    from rotorid.tables.data.records import read_record as read_record
    from rotorid.tables.job.job_file import Job as Job
    from rotorid.tables.job.job_file import job_from_files as job_from_files
    from rotorid.tables.job.job_file import read_job as read_job
    from rotorid.tables.models.harmonic_file import HarmonicFile as HarmonicFile
    from rotorid.tables.models.harmonic_file import read_harmonic_model as read_harmonic_model
    from rotorid.tables.models.ode_file import read_ode_model as read_ode_model
    from rotorid.tables.models.small_model_file import read_small_model as read_small_model
    from rotorid.tables.rotor.bow_table import read_bow as read_bow
    from rotorid.tables.rotor.rotor_file import read_rotor as read_rotor
    from rotorid.tables.rotor.rotor_file import rotor_files as rotor_files
    from rotorid.tables.rotor.rotor_writing import write_rotor as write_rotor
    from rotorid.tables.rotor.unbalance_table import read_unbalance as read_unbalance

_HOME = {
    "read_measurements": "data.measurements",
    "MeasuredModes": "data.modes_table",
    "read_compliance": "data.modes_table",
    "read_modes": "data.modes_table",
    "read_record": "data.records",
    "Job": "job.job_file",
    "job_from_files": "job.job_file",
    "read_job": "job.job_file",
    "HarmonicFile": "models.harmonic_file",
    "read_harmonic_model": "models.harmonic_file",
    "read_ode_model": "models.ode_file",
    "read_small_model": "models.small_model_file",
    "InputError": ".files.problems",
    "Problem": ".files.problems",
    "TableWarning": ".files.problems",
    "write_table": ".files.table_writing",
    "read_bow": "rotor.bow_table",
    "read_rotor": "rotor.rotor_file",
    "rotor_files": "rotor.rotor_file",
    "write_rotor": "rotor.rotor_writing",
    "read_unbalance": "rotor.unbalance_table",
    "influence_frame": ".files.influence",
    "read_influence": ".files.influence",
    "write_influence": ".files.influence",
    "Conventions": ".files.conventions",
    "StatedErrors": ".files.conventions",
    "read_trials": ".files.runs",
}

__all__ = [*_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)
