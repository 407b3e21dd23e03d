"""The balancing sheet: page 1 is all that is needed to mount the weights, without the program."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorid.base.plot_style import new_figure
from rotorid.base.tables import Column, Table, html
from rotorid.base.text import RPM, figures, sentence
from rotorid.files import units
from rotorid.report import conventions_explained
from rotorid.report.page import block, inline_svg, render_report

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.figure import Figure

    from balancing import CheckComparison, Correction, Labels, LeftToDo, Mounted, Trials, Verdict, Zones
    from rotorid.base.answer import Answer
    from rotorid.files import Job

    Headings = Mapping[str, tuple[str, Callable[[Any], str]]]
    """Heading and text of each column, by the key of its values in rows of the document."""

_HEAD = ("machine", "place", "date", "engineer", "instrument")
_TWO, _THREE, _FOUR = (partial(figures, digits=n) for n in (2, 3, 4))
LONG = 10**6
"""Rows of the longest table that stands whole."""


def balance_report(
    document: Mapping[str, Any],
    made: tuple[
        Correction, Mounted | None, CheckComparison | None, LeftToDo | None, Verdict | None, Zones | None
    ],
    job: Job,
    provenance: Mapping[str, Any],
    answer: Answer,
) -> bytes:
    """Make the sheet of a balancing job: one HTML file that needs nothing else.

    Parameters
    ----------
    document
        What `rotorid balance --json` prints, without its provenance; the sheet holds it.
    made
        What it is made of: the correction, pieces in holes, check runs, what is left to do after these, what
        limits say, zones.
    job
        Of the correction.
    provenance
        Program version, input files with hashes, date and options.
    answer
        What to do, and warnings.

    Raises
    ------
    ValueError
        If the document holds a number that is not finite.
    """
    from balancing import with_check_runs
    from balancing.plots import residual_figure

    result, mounted, check, left, verdict, zones = made
    labels = result.labels
    angles = {s: sensor.angle for s, sensor in job.sensor_places.items()} | dict(job.sensor_angles)
    places = {s: angles[s] for s in result.sensors if s in angles}
    key = job.key_phasor if places or job.key_phasor else None
    name = job.settings.machine or Path(job.files[0]).resolve().parent.name
    judged = "\n\n".join(
        words
        for part in (verdict, zones)
        if part
        for words in (part.answer.numbers, *part.answer.tables)
        if words
    )
    runs = job.trials  # and the check runs, where they refine the coefficients
    if check is None and job.check is not None:
        runs = with_check_runs(runs, job.check)
    return render_report(
        "balance.html",
        document,
        title=f"Balancing sheet: {name}",
        warnings=list(map(sentence, answer.warnings)),
        notes=" ".join(map(sentence, answer.notes)),
        provenance=provenance,
        judgement=answer.judgement.splitlines(),
        head={
            key: getattr(job.settings.sheet, key, "") or getattr(job.settings, key, "") or "" for key in _HEAD
        },
        labels=labels,
        job_files=", ".join(path.name for path in job.files),
        errors=result.error_sentence,
        method=f"{result.method_in_words} {result.conditioning.sentence()}",
        seen=conventions_explained.seen_from(labels),
        conventions=conventions_explained.words(labels, places, key),
        residual_figure=inline_svg(
            residual_figure(result, mounted, check, left), "Vibration before and after"
        ),
        discs=[
            inline_svg(figure, f"What goes into plane {plane}")
            for plane, figure in _discs(result, job, mounted, left).items()
        ],
        **to_do(document, result, job, boxes=True),
        readings=_readings(document, result, check),
        next_run=html(_with_blanks(next_run(document, labels)), LONG) if left and left.word == "trim" else "",
        verdict=judged and block(judged),
        radii="; ".join(f"{plane} {radius * 1e3:.6g} mm" for plane, radius in job.radii.items()),
        runs=block(_readings_of(runs), LONG),
        there=_mounted_in(runs),
        trial_radii=any(plane.trial_radius for plane in job.planes.values()),
        slow_roll=job.slow_roll is not None,
    )


def to_do(
    document: Mapping[str, Any], result: Correction, job: Job, *, boxes: bool
) -> dict[str, Markup | str]:
    """Tables of what is to be done, as HTML, empty where there is nothing: see `balance_report`.

    With `boxes` each row has one to tick on paper.
    """

    def shown(table: Table) -> Markup:
        done = (_done(len(table.columns[0].values)),) if boxes else ()
        return html(replace(table, columns=(*table.columns, *done)))

    left, plain = document.get("left_to_do"), not ({"left_to_do", "mounting"} & document.keys())
    part = "mounting" if left is None else "left_to_do"
    pieces = not plain and document[part]["holes"]
    unit = result.labels.weight_in
    holes = _work(document, f"{part}.holes", unit, hole="hole", pieces="pieces") if pieces else ()
    nothing = "Nothing: no piece makes it better." if not plain and left is None else ""
    return {
        "weights": shown(_weights(document, result, job)) if plain else "",
        "trim": "" if left is None else (html if pieces else shown)(trim_table(document, result.labels)),
        "holes": shown(Table("", tuple(holes))) if pieces else nothing,
    }


def degrees(angle: float) -> str:
    """An angle as text, 0 ≤ angle < 360."""
    return f"{round(angle, 1) % 360:.1f}°"


def _at(document: Mapping[str, Any], path: str) -> Sequence[Mapping[str, Any]]:
    """Rows of the document."""
    rows: Any = document
    for part in path.split("."):
        rows = rows[part]
    return rows  # type: ignore[no-any-return]


def _columns(document: Mapping[str, Any], path: str, headings: Headings) -> list[Column]:
    """Columns of rows of the document; those without any value are left out."""
    every = {key: [row.get(key) for row in _at(document, path)] for key in headings}
    return [
        Column(headings[key][0], values, headings[key][1], f"{path}.*.{key}")
        for key, values in every.items()
        if any(value is not None for value in values)
    ]


def _work(document: Mapping[str, Any], path: str, weight: str, **more: str) -> list[Column]:
    """Where to add, or to take away, how much; `more` columns of words."""
    rows = _at(document, path)
    away = [row.get("action") == "remove" for row in rows]
    at = [row["angle_deg"] if row.get("remove_at_deg") is None else row["remove_at_deg"] for row in rows]
    nothing = [row["mass"] == 0 for row in rows]
    shown = degrees if "hole" not in more else "{:.6g}°".format  # holes are where they are
    key = "" if any(row.get("remove_at_deg") is not None for row in rows) else f"{path}.*.angle_deg"
    return [
        *_columns(document, path, {"plane": ("plane", str), **{key: (key, str) for key in more}}),
        Column("do", ["take away" if gone else "add" for gone in away]),
        *_columns(document, path, {"mass": (weight, _FOUR)}),
        Column("angle", [None if no else angle for no, angle in zip(nothing, at, strict=True)], shown, key),
    ]


def _done(count: int) -> Column:
    """A box to tick in each row."""
    from markupsafe import Markup

    return Column("done", ["box"] * count, lambda _: Markup('<span class="box" aria-label="to tick"></span>'))


def _weights(document: Mapping[str, Any], c: Correction, job: Job) -> Table:
    """Weights of the bare rotor, with their 95 % and, of unbalances, the mass at the radius of the plane."""
    unit, (sizes, angles) = c.labels.weight_unit.partition("_")[0], c.half_widths()
    columns = _work(document, "corrections", c.labels.weight_in)
    if c.region_known:
        columns.append(Column(f"± {c.labels.weight_in}, 95 %", sizes * c.labels.weight_scale, _TWO))
        columns.append(Column("± °, 95 %", np.degrees(angles), _TWO))
    if c.labels.unbalances and job.radii:
        scale = units.MASS[unit].scale
        masses = [
            abs(weight) / job.radii[plane] * scale if plane in job.radii else None
            for plane, weight in zip(c.planes, c.weights, strict=True)
        ]
        columns.append(Column(f"{unit} at radius", masses, _FOUR))
    return Table("", tuple(columns))


def trim_table(document: Mapping[str, Any], labels: Labels) -> Table:
    """What is mounted, and what is to come on top."""
    there: Headings = {"mass": (f"mounted, {labels.weight_in}", _FOUR), "angle_deg": ("at", degrees)}
    plane, *work = _work(document, "left_to_do.add", f"trim, {labels.weight_in}")
    mounted = _columns(document, "left_to_do.mounted", there)
    return Table("", (plane, *mounted, *work))


def _readings(document: Mapping[str, Any], c: Correction, check: CheckComparison | None) -> Markup:
    """Readings before and predicted, with room for those of a check run; or with these."""
    path = "residuals"
    numbers: Headings = {"before": ("before", _THREE), "before_phase_deg": ("at", degrees)}
    if check is not None:
        path = "check.readings"
        numbers = {
            **numbers,
            "predicted": ("predicted", _THREE),
            "predicted_phase_deg": ("at ", degrees),
            "achieved": ("achieved", _THREE),
            "achieved_phase_deg": ("at  ", degrees),
            "distance": ("off by std", _TWO),
        }
    after = "mounting.residuals" if "mounting" in document and check is None else path
    places: Headings = {"sensor": ("sensor", str)}
    if check is not None and len(check.runs) > 1:
        places = {"run": ("run", str), **places}
    columns = [_speed(document, path, c.labels), *_columns(document, path, {**places, **numbers})]
    if check is None:
        left: Headings = {"after": ("predicted", _THREE), "after_phase_deg": ("at ", degrees)}
        columns += _columns(document, after, left)
        more = [Column("95 % within ±", c.within.ravel(), _TWO)] if c.errors_known else []
        if c.limits is not None and np.isfinite(c.limits.residual).any():
            limits = document["limits"]["amplitude"]
            more.append(Column("limit", limits, _FOUR, "limits.amplitude.*"))
        table = Table("", (*columns, *more))
        return html(table if "left_to_do" in document else _with_blanks(table), LONG)
    return html(Table("", tuple(columns)), LONG)


def next_run(document: Mapping[str, Any], labels: Labels) -> Table:
    """Readings now and predicted with the trim."""
    path = "left_to_do.readings"
    now: Headings = {
        "sensor": ("sensor", str),
        "achieved": ("now", _THREE),
        "achieved_phase_deg": ("at", degrees),
        "after": ("predicted", _THREE),
        "after_phase_deg": ("at ", degrees),
        "within": ("95 % within ±", _TWO),
    }
    return Table("", (_speed(document, path, labels), *_columns(document, path, now)))


def _with_blanks(table: Table) -> Table:
    """With columns to fill in by hand."""
    nothing = ["\N{NO-BREAK SPACE}"] * len(table.columns[0].values)
    blank = [Column(name, nothing) for name in ("amplitude read", "phase read")]
    return replace(table, columns=(*table.columns, *blank))


def _speed(document: Mapping[str, Any], path: str, labels: Labels) -> Column:
    """Speeds of rows, in the job's unit."""
    unit = labels.speed_unit
    scale = 1.0 if unit == "rpm" else units.SPEED[unit].scale / RPM
    rows = [row["speed_rpm"] for row in _at(document, path)]
    values = [None if speed is None else speed * scale for speed in rows]
    return Column(labels.speed_in, values, "{:.6g}".format, f"{path}.*.speed_rpm", scale)


def _readings_of(trials: Trials) -> Table:
    """Means of the readings of the runs."""
    labels = trials.labels
    speeds = [labels.speed_number(speed) for speed in trials.speeds for _ in trials.sensors]
    columns = [Column(labels.speed_in, speeds), Column("sensor", trials.sensors * len(trials.speeds))]
    for run, readings in zip(trials.runs, trials.mean, strict=True):
        size, phase = labels.vibration(readings.ravel())
        columns += [Column(run, size, "{:.4g}".format), Column("at", phase, degrees)]
    return Table("", tuple(columns))


def _mounted_in(trials: Trials) -> list[tuple[str, str]]:
    """What was mounted in each run."""
    words = [
        [f"{trials.labels.weight_at(w)} in plane {p}" for p, w in zip(trials.planes, row, strict=True) if w]
        for row in trials.weights
    ]
    return [(run, ", ".join(each) or "nothing") for run, each in zip(trials.runs, words, strict=True)]


def _discs(result: Correction, job: Job, mounted: Mounted | None, left: LeftToDo | None) -> dict[str, Figure]:
    """A picture of each plane with what goes into it; none where nothing does after a check run."""
    from balancing.plots import draw_plane

    zero = 1j if job.settings.sheet.zero == "top" else 1.0
    if left is not None:
        if left.word != "trim":
            return {}
        add = dict(zip(left.planes, left.trim.tolist(), strict=True))
        trim = np.array([add[plane] for plane in left.correction.planes])
        mounted = left.pieces
        result = left.correction if mounted else replace(left.correction, weights=trim)
    figures = {plane: new_figure(3.1, 3.4) for plane in result.planes}
    for plane, figure in figures.items():
        draw_plane(figure.add_subplot(), result, plane, mounted, job.holes.get(plane), zero)
    return figures
