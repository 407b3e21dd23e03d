"""The balancing sheet: one page that a balancing engineer can work from without the program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.text import capital, sentence
from rotorid.report import conventions_explained
from rotorid.report.balance_data import sheet_data
from rotorid.report.balance_figures import plane_figure
from rotorid.report.balance_tables import sheet_tables
from rotorid.report.document import Document
from rotorid.report.page import every_warning, inline_svg, render_report

if TYPE_CHECKING:
    from markupsafe import Markup

    from balancing import Correction, Influence, LeftToDo, Mounted
    from rotorid.tables import Job

_SOURCES = {
    "stated": "as stated in the job",
    "measured": "as the instrument measured them, reading by reading",
    "repeats": "from repeated readings",
    "stated, enlarged by repeats": "as stated, enlarged because repeated readings scatter more",
    "residuals": "from the disagreement of the runs",
    "assumed": "assumed: nobody states them, and nothing measures them",
    "unknown": "not known",
}


def balance_report(
    document: Mapping[str, Any],
    made: tuple[Correction, Mounted | None, LeftToDo | None],
    influence: Influence,
    job: Job,
    provenance: Mapping[str, Any],
    judgement: str,
) -> bytes:
    """Make the sheet of a balancing job: one HTML file that needs nothing else.

    Parameters
    ----------
    document
        What `rotorid balance --json` prints, without its provenance. The sheet holds it as JSON, with what
        only the sheet shows under the key "sheet".
    made
        What it is made of: the correction, pieces in holes, what is left to do after a check run.
    influence, job
        Coefficients and job of the correction.
    provenance
        Program version, input files with hashes, date and options.
    judgement
        What to do: the lines of the answer's.

    Raises
    ------
    ValueError
        If the document holds a number that is not finite.
    """
    from balancing.plots import residual_figure

    result, mounted, left = made
    labels = result.labels
    whole = Document({**document, "sheet": sheet_data(result, job, mounted)})
    known = {s: sensor.angle for s, sensor in job.sensor_places.items()} | dict(job.sensor_angles)
    places = {s: known[s] for s in result.sensors if s in known}
    key_phasor = job.key_phasor if places or job.key_phasor else None
    source, seen = result.influence.reading.source, conventions_explained.seen_from(labels)
    discs = [] if left is not None else _discs(result, job, mounted, seen)
    if left is not None and left.word == "trim":
        add = dict(zip(left.planes, left.trim.tolist(), strict=True))
        trim = replace(left.correction, weights=np.array([add[plane] for plane in left.correction.planes]))
        discs = _discs(left.correction if left.pieces else trim, job, left.pieces, seen)
    return render_report(
        "balance.html",
        whole.data,
        title=f"Balancing sheet: {_name(job)}",
        warnings=[sentence(words) for words in every_warning(document)],
        judgement=judgement.splitlines(),
        provenance=provenance,
        job_files=[path.name for path in job.files],
        about=[job.machine, job.date],
        vibration=labels.vibration_in,
        weight=labels.weight_in,
        seen=seen,
        turning=capital(labels.turning_in_words()),
        method=_method(result),
        errors=_SOURCES.get(source, source),
        coefficients=_coefficients(influence, job, provenance),
        turn=_turn(result),
        tables=sheet_tables(whole, labels),
        conventions=conventions_explained.words(labels, places, key_phasor),
        rotor_figure=inline_svg(
            conventions_explained.rotor_figure(labels, places, key_phasor),
            "The rotor from its end: rotation, mark, a weight at 60°, sensor and key phasor",
        ),
        phase_figure=inline_svg(
            conventions_explained.phase_figure(labels),
            f"A reading over time with a phase of 60° ({labels.phase})",
        ),
        discs=discs,
        residual_figure=inline_svg(residual_figure(result, mounted), "Vibration before and predicted after"),
        forbidden=result.limits is not None and any(result.limits.forbidden),
        unsplit=[p for p in result.planes if p in job.holes] if mounted is None and left is None else [],
    )


def _name(job: Job) -> str:
    """The folder and the file of a job, "turbo_job, holes"; of a job called job the folder alone."""
    first = Path(job.files[0]).resolve()
    folder, own = first.parent.name, first.stem
    if folder in ("", own):
        return own
    return folder if own.casefold() in ("job", "runs") else f"{folder}, {own}"


def _method(result: Correction) -> str:
    """How the weights were found."""
    words = result.method_in_words
    if len(result.speeds) == 1 or result.method == "minmax":
        return words
    return f"{words} Den Hartog's method: influence coefficients at several speeds, least squares."


def _coefficients(influence: Influence, job: Job, provenance: Mapping[str, Any]) -> str:
    """Where the coefficients come from, in words."""
    kind = provenance["options"].get("coefficients")
    if kind == "combined":
        return "from the runs and the rotor model together"
    if job.influence is not None and kind != "computed":
        return "stored ones"
    return "from the runs above" if influence.mounted.run else "from the rotor model"


def _turn(result: Correction) -> str:
    """What the angle of a weight does to the phase of its vibration."""
    return "is added to" if result.labels.phase_sign == result.labels.angle_sign else "is taken from"


def _discs(result: Correction, job: Job, mounted: Mounted | None, seen: str) -> list[Markup]:
    """A picture of each plane."""
    return [
        inline_svg(
            plane_figure(result, plane, holes=job.holes.get(plane), mounted=mounted),
            f"Plane {plane}, {seen}: what to {'take away' if plane in result.remove else 'add'}",
        )
        for plane in result.planes
    ]
