"""`rotorid balance`: correction weights from trial runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypedDict
from warnings import catch_warnings

import typer

from rotorid.cli.common import (
    AmplitudeErrorOption,
    AnglesOption,
    JsonOption,
    OutputOption,
    PhaseErrorOption,
    PhaseOption,
    PlotOption,
    ReportOption,
    RunErrorOption,
    emit,
)
from rotorid.cli.output import (
    check_inputs,
    check_targets,
)
from rotorid.workflows.coefficients import KINDS, MODEL_ERROR
from rotorid.workflows.parameters import (
    names,
    speeds,
)

if TYPE_CHECKING:
    from balancing import Correction, Influence, Trials
    from rotorid.tables import Job

METHODS = ("least-squares", "weighted", "minmax")


class Overrides(TypedDict):
    """What the command line says in place of the job file."""

    phase: str | None
    angles: str | None
    amplitude_error_percent: float | None
    phase_error_deg: float | None
    run_error_percent: float | None


def balance(  # noqa: PLR0915
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="JOB | RUNS WEIGHTS | RUNS",
            help="Job (.toml, .xlsx); or runs and weights tables; or a runs table with --influence.",
            show_default=False,
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="METHOD",
            help="weighted (by the errors of the readings; the default), least-squares, or minmax (the "
            "smallest largest amplitude).",
            show_default=False,
        ),
    ] = None,
    influence: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Stored influence coefficients.", show_default=False)
    ] = None,
    coefficients: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help=f"{', '.join(KINDS)}: from the runs, from the job's rotor, or both; default: "
            "measured where there are trial weights.",
            show_default=False,
        ),
    ] = None,
    model_error: Annotated[
        float | None,
        typer.Option(
            metavar="PERCENT",
            min=0.0,
            help=f"Standard deviation of computed coefficients; combined: {MODEL_ERROR:g} if not given.",
            show_default=False,
        ),
    ] = None,
    amplitude_error: AmplitudeErrorOption = None,
    phase_error: PhaseErrorOption = None,
    run_error: RunErrorOption = None,
    phase: PhaseOption = None,
    angles: AnglesOption = None,
    planes: Annotated[
        str | None, typer.Option(metavar="LIST", help="Use these planes only.", show_default=False)
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(
            "--speeds",
            metavar="LIST",
            help="Use these speeds only, in the unit of the runs table, or with another one: 20Hz,25Hz.",
            show_default=False,
        ),
    ] = None,
    max_mass: Annotated[
        str | None,
        typer.Option(
            metavar="MASS", help="Largest weight of every plane, 5g; or left=5g,right=3g.", show_default=False
        ),
    ] = None,
    limit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SENSOR=VALUE",
            help="Largest amplitude of a sensor; VALUE alone: of all. May be repeated.",
            show_default=False,
        ),
    ] = None,
    ridge: Annotated[
        str | None,
        typer.Option(
            metavar="STRENGTH",
            help="Small weights where planes act alike: 0.01 … 0.1, or auto.",
            show_default=False,
        ),
    ] = None,
    truncate: Annotated[
        float | None,
        typer.Option(
            metavar="NUMBER",
            help="Keep this many combinations of planes (1, 2, …), or those above this share (below 1).",
            show_default=False,
        ),
    ] = None,
    split: Annotated[
        bool,
        typer.Option(
            "--split", help="Choose pieces in the holes of the job, all planes together (a picture of discs)."
        ),
    ] = False,
    split_seconds: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.1, help="For the proof that no choice is better.")
    ] = 5.0,
    refine: Annotated[
        bool,
        typer.Option(
            "--refine",
            help="Add the job's check runs to its trial runs: coefficients and trim from all of them.",
        ),
    ] = False,
    history: Annotated[
        bool, typer.Option("--history", help="All runs and check runs of the job in one table, too.")
    ] = False,
    best_planes: Annotated[
        int | None,
        typer.Option(
            metavar="K", min=1, help="Use the best K planes, after comparing all choices.", show_default=False
        ),
    ] = None,
    trade_off: Annotated[
        bool, typer.Option("--trade-off", help="Residual against total weight, too (a second picture).")
    ] = False,
    grade: Annotated[
        str | None,
        typer.Option(
            metavar="GRADE", help="Judge the planes by ISO 21940-11: G0.4 to G4000.", show_default=False
        ),
    ] = None,
    rotor_mass: Annotated[
        str | None, typer.Option(metavar="MASS", help="For --grade, such as 500kg.", show_default=False)
    ] = None,
    service_speed: Annotated[
        str | None, typer.Option(metavar="SPEED", help="For --grade, such as 3000rpm.", show_default=False)
    ] = None,
    positions: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="For --grade, along the shaft: left=100mm,right=600mm; default: half in each plane.",
            show_default=False,
        ),
    ] = None,
    bearings: Annotated[
        str | None, typer.Option(metavar="A,B", help="For --positions, 0mm,700mm.", show_default=False)
    ] = None,
    centre: Annotated[
        str | None,
        typer.Option(metavar="POSITION", help="For --positions: of the centre of mass.", show_default=False),
    ] = None,
    save_influence: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the coefficients, .csv or .xlsx.", show_default=False),
    ] = None,
    template: Annotated[
        Path | None,
        typer.Option(metavar="FILE.xlsx", help="Write an empty workbook to fill in.", show_default=False),
    ] = None,
    sheet: ReportOption = None,
    json: JsonOption = False,
    plot: PlotOption = None,
    output: OutputOption = None,
) -> None:
    """Correction weights that minimise the vibration, with predicted residuals and uncertainty.

    Example: rotorid balance sample_data/turbo_job/job.toml --plot corrections.png

    Example: rotorid balance sample_data/turbo_job/holes.toml --split --report sheet.html

    Example: rotorid balance runs.csv weights.csv --amplitude-error 2 --phase-error 2 --max-mass 5g

    Example: rotorid balance --template job.xlsx, and when it is filled in: rotorid balance job.xlsx --output
    sheet.xlsx (the job and its results in one workbook; --output weights.csv: the corrections alone)
    """
    from balancing import correct
    from balancing.correction.check import compare_check
    from balancing.correction.subsets import compare_planes
    from balancing.mounting.mounted import mount
    from rotorid.cli.commands.balance_report import Report
    from rotorid.cli.commands.balance_workbook import as_workbook, workbook, write_template
    from rotorid.cli.commands.verdict import Places, judge, tolerance_of
    from rotorid.cli.other_readings import ask_runs, with_contradiction, with_other_readings
    from rotorid.tables import job_from_files, read_job
    from rotorid.tables.job.source import JobSource
    from rotorid.tables.runs.influence_table import influence_bytes
    from rotorid.workflows.coefficients import choose, used_planes
    from rotorid.workflows.quantities import largest_amplitudes, largest_weights, limited

    if template is not None:
        write_template(template, files)
        return
    if not files:
        raise ValueError(
            "give a job (.toml, .xlsx) or a runs table and a weights table; --template writes a form"
        )
    _check_options(method, coefficients, ridge, truncate)
    if split and (ridge is not None or truncate is not None):
        raise ValueError(
            "--split takes the planes as they are, and would undo --ridge and --truncate: use fewer planes "
            "(--planes, --best-planes) instead"
        )
    check_targets(plot, output, save_influence, report=sheet)
    targets = [path for path in (plot, output, save_influence, sheet) if path is not None]
    check_inputs(targets, [*files, *([influence] if influence is not None else [])])
    settings: Overrides = {
        "phase": phase,
        "angles": angles,
        "amplitude_error_percent": amplitude_error,
        "phase_error_deg": phase_error,
        "run_error_percent": run_error,
    }
    is_job = len(files) == 1 and influence is None and files[0].suffix.lower() in (".toml", ".xlsx")

    def read(said: Overrides) -> Job:
        job = read_job(files[0], **said) if is_job else job_from_files(files, influence=influence, **said)
        return limited(job, max_mass, limit or [])

    job = with_contradiction(read(settings))
    influence_found, baseline = choose(job, coefficients, model_error, refined=refine)
    used = None if speed is None else speeds(speed, job.trials.labels.speed_unit)
    candidates = names(planes) or used_planes(job, influence_found)
    subsets = None
    if best_planes is not None:
        subsets = compare_planes(
            influence_found,
            baseline,
            candidates,
            best_planes,
            speeds=used,
            criterion="max" if method == "minmax" else "rms",
            row_weights=job.row_weights,
        )
        candidates = list(subsets.planes[0])

    def solved(job: Job, influence: Influence, baseline: Trials | None) -> Correction:
        return correct(
            influence,
            baseline=baseline,
            planes=candidates,
            speeds=used,
            method=method,
            limits=job.limits_of(influence.planes),
            row_weights=job.row_weights,
            strength=_strength(ridge),
            keep=truncate,
            remove=sorted(job.remove),
        )

    def again(phase: str, angles: str) -> Correction:
        with catch_warnings(action="ignore"):  # said when the job was read
            job = read({**settings, "phase": phase, "angles": angles})
        return solved(job, *choose(job, coefficients, model_error, refined=refine))

    result = solved(job, influence_found, baseline)
    # what was mounted as proposed, before it was refined, was proposed by these conventions and by no others
    known = not refine or job.check_mounted
    test = ask_runs(job, result if known else None)
    result = with_other_readings(result, test, again if known else None)
    source = JobSource(
        tuple(files),
        influence,
        **settings,
        max_weights=largest_weights(job, max_mass),
        limits=largest_amplitudes(job, limit or []),
    )
    report = Report(result, influence_found, subsets=subsets)
    if split:
        report.mounted = mount(
            result,
            influence_found,
            baseline,
            job.holes,
            row_weights=job.row_weights,
            time_limit=split_seconds,
            on_top=refine,
        )
    if job.check is not None and not refine:
        report.check = compare_check(result, job.check, influence_found, baseline)
    if history:
        report.add_history(job)
    places = Places(positions, bearings, centre)
    tolerance = tolerance_of(grade, rotor_mass, service_speed, result.planes, places)
    report.verdict = judge(result, influence_found, job, tolerance, report.mounted)
    if trade_off:
        report.add_trade_off(job)
    options = {
        **settings,
        "method": method,
        "planes": planes,
        "speeds": speed,
        "influence": influence,
        "coefficients": coefficients,
        "model_error": model_error,
        "max_mass": max_mass,
        "limit": ", ".join(limit) if limit else None,
        "ridge": ridge,
        "truncate": truncate,
        "split": split,
        "refine": refine,
        "grade": grade,
        "rotor_mass": rotor_mass,
        "service_speed": service_speed,
        "positions": positions,
        "bearings": bearings,
        "centre": centre,
    }
    emit(
        report.to_dict(),
        report.text,
        as_json=json,
        files=job.files,
        options=options,
        figure=(plot, report.figure),
        table=(None if as_workbook(output) else output, report.frame),
        more=[
            (save_influence, lambda: influence_bytes(save_influence or Path(), influence_found)),
            workbook(job, source, output, report, options),
        ],
        report=(sheet, lambda document, record: report.sheet(document, job, record)),
    )


def _check_options(
    method: str | None, coefficients: str | None, ridge: str | None, truncate: float | None
) -> None:
    for option, value, known in (
        ("--method", method, (*METHODS, None)),
        ("--coefficients", coefficients, (*KINDS, None)),
    ):
        if value not in known:
            from rotorid.base.suggestions import did_you_mean

            names = [name for name in known if name is not None]
            raise ValueError(
                f"{option} {value!r} is not known{did_you_mean(str(value), names)}: one of {', '.join(names)}"
            )
    if ridge is not None and truncate is not None:
        raise ValueError("--ridge and --truncate are two ways to the same end: choose one")


def _strength(text: str | None) -> float | str | None:
    if text is None or text == "auto":
        return text
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 < value < float("inf"):
        raise ValueError(f"--ridge {text!r}: a strength above 0, such as 0.03, or auto")
    return value
