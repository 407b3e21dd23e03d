"""Reading and writing files: the only place with units, conventions and file formats.

Everything behind it is plain data in SI, with positive phase = lead and angles with the rotation. Every
complaint about a file names the file, row and column, what was found and what was expected (`InputError`).
Every name below is loaded when it is first used.
"""

from __future__ import annotations

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rotorid.files.influence import read_influence, write_influence
    from rotorid.files.input_problems import InputError, Problem, TableWarning
    from rotorid.files.job import Job, job_from_files, read_job
    from rotorid.files.job_keys import Errors
    from rotorid.files.measurements import read_measurements, read_record
    from rotorid.files.model import HarmonicFile, read_harmonic_model, read_ode_model
    from rotorid.files.node_tables import (
        read_bow,
        read_compliance,
        read_modes,
        read_unbalance,
    )
    from rotorid.files.rotor import read_rotor, rotor_files, write_rotor
    from rotorid.files.runs import read_trials
    from rotorid.files.small_model import read_small_model
    from rotorid.files.table_layouts import Conventions

_NAMES = {
    "table_layouts": "Conventions",
    "influence": "read_influence write_influence",
    "job": "Job job_from_files read_job",
    "job_keys": "Errors",
    "measurements": "read_measurements read_record",
    "model": "HarmonicFile read_harmonic_model read_ode_model",
    "node_tables": "read_bow read_compliance read_modes read_unbalance",
    "input_problems": "InputError Problem TableWarning",
    "rotor": "read_rotor rotor_files write_rotor",
    "runs": "read_trials",
    "small_model": "read_small_model",
}
__all__ = [
    "Conventions",
    "Errors",
    "HarmonicFile",
    "InputError",
    "Job",
    "Problem",
    "TableWarning",
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
]

__getattr__, __dir__ = lazy_names(
    __name__, {name: module for module, names in _NAMES.items() for name in names.split()}
)
