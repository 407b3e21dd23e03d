"""The commands: a module each, a dataclass of options and files or data in, an outcome out; none prints.

`app` makes commands of a terminal of them, `quantities` reads texts of options, `outcome` is what they give.
"""

from rotorid.commands.balance import Balance, BalanceOptions, balance
from rotorid.commands.bearings import BearingsOptions, bearings
from rotorid.commands.calibrate import CalibrateOptions, calibrate
from rotorid.commands.campbell import CampbellOptions, campbell
from rotorid.commands.critical import CriticalOptions, critical
from rotorid.commands.fit import FitOptions, fit
from rotorid.commands.identify import IdentifyOptions, identify
from rotorid.commands.influence import InfluenceOptions, influence
from rotorid.commands.modes import ModesOptions, modes
from rotorid.commands.motion import MotionOptions, motion
from rotorid.commands.periodic import PeriodicOptions, periodic
from rotorid.commands.reduce import ReduceOptions, reduce
from rotorid.commands.response import ResponseOptions, response
from rotorid.commands.runup import RunUpOptions, runup
from rotorid.commands.simulate import SimulateOptions, simulate
from rotorid.commands.split import SplitOptions, split
from rotorid.commands.tolerance import ToleranceOptions, tolerance
from rotorid.commands.trial_weight import TrialWeightOptions, trial_weight
from rotorid.commands.unbalance import UnbalanceOptions, unbalance
from rotorid.commands.vectors import VectorsOptions, vectors
from rotorid.report.outcome import Outcome

__all__ = [
    "Balance",
    "BalanceOptions",
    "BearingsOptions",
    "CalibrateOptions",
    "CampbellOptions",
    "CriticalOptions",
    "FitOptions",
    "IdentifyOptions",
    "InfluenceOptions",
    "ModesOptions",
    "MotionOptions",
    "Outcome",
    "PeriodicOptions",
    "ReduceOptions",
    "ResponseOptions",
    "RunUpOptions",
    "SimulateOptions",
    "SplitOptions",
    "ToleranceOptions",
    "TrialWeightOptions",
    "UnbalanceOptions",
    "VectorsOptions",
    "balance",
    "bearings",
    "calibrate",
    "campbell",
    "critical",
    "fit",
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
    "tolerance",
    "trial_weight",
    "unbalance",
    "vectors",
]
