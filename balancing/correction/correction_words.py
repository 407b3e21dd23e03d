"""Method and errors of a correction in words, and as a document."""

from __future__ import annotations

from typing import Any

import numpy as np

from balancing.coefficients.baseline import describe_errors
from balancing.coefficients.run_errors import RunErrors
from balancing.data.conventions import Labels
from balancing.data.reading_errors import Source
from balancing.data.trials import ReadingErrors
from balancing.solvers.correction_methods import METHODS, VARIANTS
from rotorid.base.arrays import FloatArray
from rotorid.base.registry import Method, find
from rotorid.base.text import capital, figures

SMALL = 5e-4
"""Share of a reading that is not worth a word."""

_SOURCES = {
    "stated": "as stated in the job",
    "measured": "root mean square of those that the instrument measured",
    "repeats": "from repeated readings",
    "stated, enlarged by repeats": "stated ones, enlarged because repeated readings scatter more",
    "residuals": "from the disagreement of the runs",
    "assumed": "assumed: nothing states or measures them",
}


def method_words(name: str, *, weighted: bool) -> str:
    """What a method of correction makes small; `weighted`: readings count differently."""
    every: tuple[Method[Any], ...] = (*METHODS, *VARIANTS)
    method = find(every, name, "method")
    about = method.about.replace("amplitude", "weighted amplitude") if weighted else method.about
    return f"{capital(method.title or method.name)}: {about}."


def error_words(
    source: Source, errors: ReadingErrors | None, dof: float | None, run: RunErrors, labels: Labels
) -> str:
    """Errors of a reading and between runs in one or two sentences."""
    words = (
        f"One standard deviation of a reading: "
        f"{describe_errors(errors, labels.vibration_in, labels.vibration_scale)} "
        f"({_SOURCES[source]}){_between_runs(run, labels)}."
    )
    return words if dof is None or dof >= 200 else f"{words} Degrees of freedom: {dof:.3g}."


def error_document(
    source: Source, errors: ReadingErrors | None, dof: float | None, run: RunErrors, labels: Labels
) -> dict[str, Any]:
    """The same in numbers; amplitudes in the job's unit."""
    e, scale = errors, labels.vibration_scale
    p, w, f = _sizes(run)
    return {
        "source": source,
        "amplitude_percent": None if e is None else 100 * e.amplitude,
        "phase_deg": None if e is None else np.degrees(e.phase),
        "floor": None if e is None else e.floor * scale,
        "degrees_of_freedom": dof,
        "between_runs": {
            "source": run.origin,
            "percent": 100 * p,
            "percent_of_effect": 100 * w,
            "floor": f * scale,
            "rms": np.sqrt(run.kinds.sum()) * scale,
            "common_share": run.common,
            "interval95": None if run.interval is None else [each * scale for each in run.interval],
        },
    }


def _between_runs(run: RunErrors, labels: Labels) -> str:
    """What changes from run to run, in words."""
    p, w, f = _sizes(run)
    if run.origin == "none" or not (p or w or f):
        return ""
    floor = f"{figures(f * labels.vibration_scale, 2)} {labels.vibration_in}".rstrip()
    shown = (
        (p > SMALL, f"{100 * p:.2g} % of it"),
        (w > SMALL, f"{100 * w:.2g} % of what the weights do"),
        (f > 0, floor),
    )
    parts = [words for large, words in shown if large]
    common = f", {100 * run.common:.0f} % of the variance common to the sensors" if run.common > 0.1 else ""
    return f"; from run to run: {', '.join(parts)} ({run.origin}{common})"


def _sizes(run: RunErrors) -> FloatArray:
    """Relative to a reading, relative to what the weights do, and a floor."""
    return np.asarray(np.sqrt(np.sum(run.sizes**2, axis=1)))
