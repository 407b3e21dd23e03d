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
    from rotorid.files.influence import influence_frame as influence_frame
    from rotorid.files.influence import read_influence as read_influence
    from rotorid.files.influence import write_influence as write_influence
    from rotorid.files.job import Job as Job
    from rotorid.files.job import job_from_files as job_from_files
    from rotorid.files.job import read_job as read_job
    from rotorid.files.job_models import Errors as Errors
    from rotorid.files.measurements import read_measurements as read_measurements
    from rotorid.files.model import HarmonicFile as HarmonicFile
    from rotorid.files.model import read_harmonic_model as read_harmonic_model
    from rotorid.files.model import read_ode_model as read_ode_model
    from rotorid.files.node_tables import MeasuredModes as MeasuredModes
    from rotorid.files.node_tables import read_bow as read_bow
    from rotorid.files.node_tables import read_compliance as read_compliance
    from rotorid.files.node_tables import read_modes as read_modes
    from rotorid.files.node_tables import read_unbalance as read_unbalance
    from rotorid.files.problems import InputError as InputError
    from rotorid.files.problems import Problem as Problem
    from rotorid.files.problems import TableWarning as TableWarning
    from rotorid.files.records import read_record as read_record
    from rotorid.files.rotor import read_rotor as read_rotor
    from rotorid.files.rotor import rotor_files as rotor_files
    from rotorid.files.rotor import write_rotor as write_rotor
    from rotorid.files.runs import read_trials as read_trials
    from rotorid.files.small_model import read_small_model as read_small_model
    from rotorid.files.table_writing import write_table as write_table

_HOME = {
    "read_measurements": "measurements",
    "MeasuredModes": "node_tables",
    "read_compliance": "node_tables",
    "read_modes": "node_tables",
    "read_record": "records",
    "Job": "job",
    "job_from_files": "job",
    "read_job": "job",
    "HarmonicFile": "model",
    "read_harmonic_model": "model",
    "read_ode_model": "model",
    "read_small_model": "small_model",
    "InputError": "problems",
    "Problem": "problems",
    "TableWarning": "problems",
    "write_table": "table_writing",
    "read_bow": "node_tables",
    "read_rotor": "rotor",
    "rotor_files": "rotor",
    "write_rotor": "rotor",
    "read_unbalance": "node_tables",
    "influence_frame": "influence",
    "read_influence": "influence",
    "write_influence": "influence",
    "Conventions": "conventions",
    "Errors": "job_models",
    "read_trials": "runs",
}

__all__ = [*_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)
