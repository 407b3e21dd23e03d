"""What may differ by more than 1e-6 of the largest of its array, and why."""

from __future__ import annotations

from dataclasses import dataclass
from fnmatch import fnmatchcase


@dataclass(frozen=True)
class Tolerance:
    """Keys of cases that may differ more.

    Attributes
    ----------
    case, key
        Patterns (`fnmatch`, with `[[]` for a bracket) of names of cases and of keys.
    reason
        Why.
    relative
        Of the largest of the array.
    absolute
        In its unit.
    interval
        Whether the array holds intervals, low and high in turn: `relative` is of half the widest.
    """

    case: str
    key: str
    reason: str
    relative: float = 0.0
    absolute: float = 0.0
    interval: bool = False

    def holds(self, case: str, key: str) -> bool:
        """Whether it is about this key of this case."""
        return fnmatchcase(case, self.case) and fnmatchcase(key, self.key)


_CONSTRAINED = "what an active limit counts follows from the last multipliers of the solver"
_CERTIFICATE = "the gap at which the solver stops is rounding, divided by what it began with"
_EXACT = "the data have no errors: residuals, and the deviations that follow from them, are rounding"
_NOTHING = "as many readings as weights leave nothing"
_CHOSEN = (
    "the penalty of a stiff filter is chosen where its likelihood is flat; far below the errors, and 3.7e-4 "
    "of what is left between two kinds of processors"
)

TOLERANCES: tuple[Tolerance, ...] = (
    # rounding residues
    Tolerance("identify-*", "*", _EXACT, absolute=1e-9),
    Tolerance("demo-identification", "*", _EXACT, absolute=1e-9),
    Tolerance("fit-*", "parameters.*.std", _EXACT, absolute=1e-13),
    Tolerance("fit-*", "*residual_rms", _EXACT, absolute=1e-12),
    Tolerance("fit-*", "autocorrelation*", "of residuals near the optimum, not at it", absolute=1e-8),
    Tolerance("*", "*correlation[[]*", "of parameters that do not hang together", absolute=1e-12),
    Tolerance("campbell-*", "*log_decrement*", "a rotor without damping has none", absolute=1e-12),
    Tolerance("bearings*", "*log_decrement", "0 where the mode begins to grow", absolute=1e-10),
    Tolerance("motion*", "position_error", "the difference of two integrations", absolute=1e-9),
    Tolerance("motion*", "reduction.frequency_error*", "rounding of frequencies", absolute=1e-10),
    *(Tolerance(case, "*chi_square*", _NOTHING, absolute=1e-20) for case in ("bk*", "static*", "index")),
    Tolerance("no-phase", "*after", _NOTHING, absolute=1e-12),
    # certificates, and what an iterative solver leaves
    Tolerance("*", "*duality_gap*", _CERTIFICATE, absolute=1e-7),
    Tolerance("turbo-max-mass", "*", "along limits that χ² hardly tells apart", relative=1e-5),
    Tolerance("turbo-trade-off", "trade_off.points*", "a conic solver, along a flat optimum", relative=1e-4),
    *(Tolerance(case, "*", _CHOSEN, relative=1e-4) for case in ("vectors*", "runup-record", "*waveforms")),
    Tolerance("*waveforms", "*after*", _CHOSEN, relative=1e-3),
    Tolerance("*waveforms", "*chi_square*", _CHOSEN, relative=2e-3),
    Tolerance("runup-record", "*chi_square*", _CHOSEN, relative=5e-4),
    # covariances
    Tolerance("*minmax*", "corrections*std*", _CONSTRAINED, relative=5e-4),
    Tolerance("*minmax*", "corrections*covariance*", _CONSTRAINED, relative=5e-4),
    Tolerance("turbo-max-mass", "corrections*std*", _CONSTRAINED, relative=5e-4),
    Tolerance("turbo-max-mass", "corrections*covariance*", _CONSTRAINED, relative=5e-4),
)

_DRAWN = "the spread comes from draws, or from a linearization beside them"
SPREAD = tuple(
    Tolerance("*", key, _DRAWN, relative=0.15)
    for key in (
        *(
            "*std",
            "*std[[]*",
            "*std_*",
            "*_std*",
            "*covariance*",
            "*correlation*",
            "*uncertainty*",
        ),
        *("*_low", "*_low[[]*", "*_high", "*_high[[]*", "*quantile*", "*probab*", "*spread*"),
    )
) + tuple(Tolerance("*", key, _DRAWN, relative=0.15, interval=True) for key in ("*ci95*", "*interval*"))
"""For `make golden-near` only: standard deviations, covariances, intervals, probabilities."""
