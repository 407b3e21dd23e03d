"""rotorid: what a vibrating rotor hides.

Identification, reduction and file reading; the direct problem is in `fem`, balancing in `balancing`.
Every name below is loaded when it is first used.
"""

from __future__ import annotations

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False  # typing takes longer than all before the command line's answer to Ctrl-C
if TYPE_CHECKING:
    from rotorid.files import InputError as InputError
    from rotorid.files import Job as Job
    from rotorid.files import read_compliance as read_compliance
    from rotorid.files import read_harmonic_model as read_harmonic_model
    from rotorid.files import read_influence as read_influence
    from rotorid.files import read_job as read_job
    from rotorid.files import read_measurements as read_measurements
    from rotorid.files import read_modes as read_modes
    from rotorid.files import read_ode_model as read_ode_model
    from rotorid.files import read_record as read_record
    from rotorid.files import read_rotor as read_rotor
    from rotorid.files import read_trials as read_trials
    from rotorid.files import read_unbalance as read_unbalance
    from rotorid.files import write_influence as write_influence
    from rotorid.files import write_rotor as write_rotor
    from rotorid.identify import Experiments as Experiments
    from rotorid.identify import Fit as Fit
    from rotorid.identify import Identification as Identification
    from rotorid.identify import Record as Record
    from rotorid.identify import fit as fit
    from rotorid.identify import harmonic_model as harmonic_model
    from rotorid.identify import identify as identify
    from rotorid.identify import ode_model as ode_model
    from rotorid.identify import simulate as simulate
    from rotorid.plots import plot as plot
    from rotorid.reduction import InputErrors as InputErrors
    from rotorid.reduction import Reduction as Reduction
    from rotorid.reduction import compare_methods as compare_methods
    from rotorid.reduction import equivalent_masses as equivalent_masses
    from rotorid.reduction import mac as mac
    from rotorid.reduction import natural_frequencies as natural_frequencies
    from rotorid.reduction import rank_nodes as rank_nodes
    from rotorid.reduction import reduce as reduce
    from rotorid.reduction import reduce_measured as reduce_measured
    from rotorid.reduction import small_model as small_model
    from rotorid.regression import least_squares as least_squares
    from rotorid.regression import stack as stack
    from rotorid.regression import stretch as stretch
    from rotorid.regression import unstretch as unstretch
    from rotorid.regression.estimate import Combination as Combination
    from rotorid.regression.estimate import Estimate as Estimate

__version__ = "0.1.0"

_HOME = {
    # K θ = Y
    "least_squares": "regression",
    "stretch": "regression",
    "unstretch": "regression",
    "stack": "regression",
    "Estimate": "regression",
    "Combination": "regression",
    # harmonic tests, natural frequencies and shapes
    "harmonic_model": "identify",
    "identify": "identify",
    "Experiments": "identify",
    "Identification": "identify",
    # time records
    "ode_model": "identify",
    "Record": "identify",
    "simulate": "identify",
    "fit": "identify",
    "Fit": "identify",
    # a rotor as a few masses
    "reduce": "reduction",
    "reduce_measured": "reduction",
    "rank_nodes": "reduction",
    "compare_methods": "reduction",
    "small_model": "reduction",
    "InputErrors": "reduction",
    "Reduction": "reduction",
    "equivalent_masses": "reduction",
    "natural_frequencies": "reduction",
    "mac": "reduction",
    # pictures
    "plot": "plots",
    # files
    "read_rotor": "files",
    "read_trials": "files",
    "read_influence": "files",
    "read_unbalance": "files",
    "write_influence": "files",
    "write_rotor": "files",
    "read_job": "files",
    "read_harmonic_model": "files",
    "read_measurements": "files",
    "read_modes": "files",
    "read_compliance": "files",
    "read_ode_model": "files",
    "read_record": "files",
    "Job": "files",
    "InputError": "files",
}

__all__ = ["__version__", *_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)
