"""What the commands do: one module a command, files or data and options in, a result and its document out.

Nothing here prints; the command line, reports, the demo, a notebook and a worksheet call it.
"""

from rotorid.commands import (
    Balance,
    BalanceOptions,
    CampbellOptions,
    CriticalOptions,
    FitOptions,
    IdentifyOptions,
    InfluenceOptions,
    ModesOptions,
    RecordFit,
    ResponseOptions,
    RunUpOptions,
    SimulateOptions,
    SplitOptions,
    ToleranceOptions,
    TrialWeightOptions,
    TrialWeights,
    UnbalanceOptions,
    VectorsOptions,
    balance,
    campbell,
    critical,
    fit,
    identify,
    influence,
    modes,
    response,
    runup,
    simulate,
    split,
    tolerance,
    trial_weight,
    unbalance,
    vectors,
)
from rotorid.commands.calibrate import Calibrated, CalibrateOptions, calibrate
from rotorid.commands.identify import Coefficients
from rotorid.commands.outcome import Delivered
from rotorid.workflows.demo import Demo, DemoOptions, demo
from rotorid.workflows.fleet.fleet_add import FleetAdded, FleetAddOptions, fleet_add
from rotorid.workflows.fleet.fleet_show import FleetShown, FleetShowOptions, fleet_show
from rotorid.workflows.motion.bearings import BearingEquilibria, BearingsOptions, bearings
from rotorid.workflows.motion.motion import Motion, MotionOptions, motion
from rotorid.workflows.motion.periodic import PeriodicMotions, PeriodicOptions, periodic
from rotorid.workflows.reduce import ReduceOptions, reduce
from rotorid.workflows.reduce_result import ReducedRotor
from rotorid.workflows.studies.study import StudyOptions, study
from rotorid.workflows.studies.study_result import StudiedMachines, StudiedStarts

__all__ = [
    "Balance",
    "BalanceOptions",
    "BearingEquilibria",
    "BearingsOptions",
    "CalibrateOptions",
    "Calibrated",
    "CampbellOptions",
    "Coefficients",
    "CriticalOptions",
    "Delivered",
    "Demo",
    "DemoOptions",
    "FitOptions",
    "FleetAddOptions",
    "FleetAdded",
    "FleetShowOptions",
    "FleetShown",
    "IdentifyOptions",
    "InfluenceOptions",
    "ModesOptions",
    "Motion",
    "MotionOptions",
    "PeriodicMotions",
    "PeriodicOptions",
    "RecordFit",
    "ReduceOptions",
    "ReducedRotor",
    "ResponseOptions",
    "RunUpOptions",
    "SimulateOptions",
    "SplitOptions",
    "StudiedMachines",
    "StudiedStarts",
    "StudyOptions",
    "ToleranceOptions",
    "TrialWeightOptions",
    "TrialWeights",
    "UnbalanceOptions",
    "VectorsOptions",
    "balance",
    "bearings",
    "calibrate",
    "campbell",
    "critical",
    "demo",
    "fit",
    "fleet_add",
    "fleet_show",
    "identify",
    "influence",
    "modes",
    "motion",
    "periodic",
    "reduce",
    "response",
    "runup",
    "simulate",
    "split",
    "study",
    "tolerance",
    "trial_weight",
    "unbalance",
    "vectors",
]
