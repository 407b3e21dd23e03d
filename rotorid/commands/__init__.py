"""The commands: a module each, a dataclass of options and files or data in, an outcome out; none prints.

`app` makes commands of a terminal of them, `quantities` reads texts of options, `outcome` is what they give.
"""

from rotorid.commands.campbell import CampbellOptions, campbell
from rotorid.commands.critical import CriticalOptions, critical
from rotorid.commands.influence import InfluenceOptions, influence
from rotorid.commands.outcome import Outcome
from rotorid.commands.response import ResponseOptions, response

__all__ = [
    "CampbellOptions",
    "CriticalOptions",
    "InfluenceOptions",
    "Outcome",
    "ResponseOptions",
    "campbell",
    "critical",
    "influence",
    "response",
]
