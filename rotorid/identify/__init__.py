"""Identification: from harmonic tests, natural frequencies, shapes and time records, or what data tell.

`rotorid.identify` is this package and, called, its function `identify`.
"""

from __future__ import annotations

import sys
from types import ModuleType

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from rotorid.identify.amplitudes import AmplitudeErrors as AmplitudeErrors
    from rotorid.identify.amplitudes import Experiments as Experiments
    from rotorid.identify.amplitudes import experiments as experiments
    from rotorid.identify.equations import harmonic_model as harmonic_model
    from rotorid.identify.fit_amplitudes import identify as identify
    from rotorid.identify.fit_records import fit as fit
    from rotorid.identify.ode import OdeModel as OdeModel
    from rotorid.identify.ode import SimulationError as SimulationError
    from rotorid.identify.ode import ode_model as ode_model
    from rotorid.identify.operator_model import HarmonicModel as HarmonicModel
    from rotorid.identify.records import Record as Record
    from rotorid.identify.result import Identification as Identification
    from rotorid.identify.result_records import Fit as Fit
    from rotorid.identify.simulation import Trajectory as Trajectory
    from rotorid.identify.simulation import simulate as simulate

_HOME = {
    "AmplitudeErrors": "amplitudes",
    "Experiments": "amplitudes",
    "experiments": "amplitudes",
    "HarmonicModel": "operator_model",
    "harmonic_model": "equations",
    "identify": "fit_amplitudes",
    "Identification": "result",
    "OdeModel": "ode",
    "SimulationError": "ode",
    "ode_model": "ode",
    "Record": "records",
    "Trajectory": "simulation",
    "simulate": "simulation",
    "fit": "fit_records",
    "Fit": "result_records",
}

__all__ = [*_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)


class _Package(ModuleType):
    def __call__(self, *args: Any, **options: Any) -> Any:  # noqa: ANN401
        return self.identify(*args, **options)


sys.modules[__name__].__class__ = _Package
