"""What may differ between machines by more than 1e-9 of the largest of its array, and why."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerance:
    """A place that may differ more.

    Attributes
    ----------
    case
        Pattern of names of cases.
    place
        Pattern (`fnmatch`) of the path of an array in a document, as `corrections.covariance`, or of a line
        of text with `#` for every decimal.
    reason
        Why.
    relative
        Of the largest of the array; in a text, of the number.
    absolute
        In its unit.
    """

    case: str
    place: str
    reason: str
    relative: float = 0.0
    absolute: float = 0.0


_CONSTRAINED = "what an active limit counts follows from the last multipliers of the solver"
_CERTIFICATE = "the gap at which the solver stops is rounding, divided by what it began with"
_EXACT = "the data have no errors: residuals, and the deviations that follow from them, are rounding"

_CHOSEN = "the penalty of a stiff filter is chosen where its likelihood is flat; all far below the errors"

TOLERANCES: tuple[Tolerance, ...] = (
    # rounding residues
    Tolerance("identify-*-exact", "*", _EXACT, absolute=1e-9),
    Tolerance("identify-task_8_2", "residual*", "as many equations as unknowns: " + _EXACT, absolute=1e-12),
    Tolerance("fit-quasi*", "parameters.*.std", _EXACT, absolute=1e-13),
    Tolerance("fit-quasi*", "*residual_rms", _EXACT, absolute=1e-12),
    Tolerance(
        "identify-prior", "*.delta*", "only the prior knows it: what readings tell is 0", absolute=1e-12
    ),
    Tolerance("identify-modes", "influence.*", "an iteration anew without each mode", relative=1e-7),
    Tolerance("fit-quasi*", "residual rms *", _EXACT, absolute=1e-12),
    Tolerance("fit-quasi-method", "rotorid: *", _EXACT, absolute=1e-12),
    Tolerance("fit-quasi-method", "theta*", _EXACT, absolute=1e-12),
    Tolerance("fit-*", "integration_change.*", "the difference of two integrations", absolute=1e-12),
    Tolerance("*", "*correlation.*", "of parameters that do not hang together", absolute=1e-12),
    Tolerance("campbell-rotor23", "*log_decrement*", "the rotor has no damping", absolute=1e-12),
    Tolerance(
        "campbell-*", "rotorid: estimated_relative_error = #", "a change near rounding itself", absolute=1e-12
    ),
    Tolerance(
        "bearings", "stability.smallest_log_decrement", "0 where the mode begins to grow", absolute=1e-10
    ),
    Tolerance("motion*", "position_error", "the difference of two integrations", absolute=1e-9),
    Tolerance("motion*", "reduction.frequency_error", "rounding of frequencies", absolute=1e-10),
    Tolerance("bk*", "*chi_square*", "as many readings as weights leave nothing", absolute=1e-20),
    # certificates, and what an iterative solver leaves
    Tolerance("*", "*duality_gap*", _CERTIFICATE, absolute=1e-7),
    Tolerance("*", "certified: at most # better is possible.", _CERTIFICATE, absolute=1e-7),
    Tolerance("*minmax*", "*", "a conic solver stops within 5e-9 of the best", relative=1e-7),
    Tolerance("turbo-max-mass", "*", "the same, along limits that χ² hardly tells apart", relative=1e-5),
    Tolerance("turbo-trade-off", "trade_off.points.*", "a conic solver, along a flat optimum", relative=1e-4),
    Tolerance("calibrate*", "*", "a search stops where a step no longer helps", relative=1e-6),
    *(Tolerance(case, "*", _CHOSEN, relative=2e-5) for case in ("vectors*", "runup-record", "*waveforms")),
    Tolerance("*waveforms", "*after*", _CHOSEN + ", and nearly nothing is left", relative=2e-4),
    Tolerance("*waveforms", "*chi_square*", _CHOSEN, relative=5e-4),
    Tolerance("runup-record", "*chi_square*", _CHOSEN, relative=5e-4),
    # covariances
    Tolerance("*minmax*", "corrections.*std*", _CONSTRAINED, relative=5e-4),
    Tolerance("*minmax*", "corrections.covariance", _CONSTRAINED, relative=5e-4),
    Tolerance("turbo-max-mass", "corrections.*std*", _CONSTRAINED, relative=5e-4),
    Tolerance("turbo-max-mass", "corrections.covariance", _CONSTRAINED, relative=5e-4),
    Tolerance("*-mesh", "mesh_check.rate", "a quotient of small differences of frequencies", relative=1e-6),
    # the path of an iteration, not its end
    Tolerance("fit-*", "history.parameters.*", "steps on the way to the solution", relative=1e-6),
    Tolerance("fit-*", "autocorrelation", "of residuals near the optimum, not at it", absolute=1e-8),
)
