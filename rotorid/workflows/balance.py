"""`balance`: correction weights of a job, mounted in its holes, checked and judged."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings

from rotorid.base.answer import Answer, together
from rotorid.base.text import sentence
from rotorid.commands.input_checks import check_choices, file_of
from rotorid.commands.outcome import command, provenance
from rotorid.commands.quantities import Names, Speeds, names, number, one_of, speeds
from rotorid.workflows.coefficients import KINDS, choose, used_planes
from rotorid.workflows.other_conventions import with_contradiction, with_other_readings
from rotorid.workflows.result_provenance import Parts

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from balancing import (
        CheckComparison,
        Correction,
        History,
        Influence,
        Mounted,
        Subsets,
        Tolerance,
        TradeOff,
        Trials,
        Verdict,
    )
    from balancing.mounting.left_to_do import LeftToDo
    from rotorid.base.registry import Method
    from rotorid.report.equations import Equations
    from rotorid.tables import Job
    from rotorid.tables.job.job_as_written import JobSource
    from rotorid.workflows.calibration.one_shot import NextTrial
    from rotorid.workflows.fleet.type_coefficients import TypeKnowledge
    from rotorid.workflows.option_quantities import Amount, Amplitudes, Positions, Weights

    JobGiven = Job | Path | str | Sequence[Path | str]
    """A job, its file, or a runs table and a weights table."""
    Known = tuple[Influence, Trials | None]
    """Coefficients, and the runs that give the vibration."""


def choices() -> dict[str, Sequence[Method[Any]]]:
    """What `method` chooses from."""
    from balancing.solvers.correction_methods import METHODS

    return {"method": METHODS}


@dataclass(frozen=True)
class BalanceOptions:
    """Options of `balance`; conventions and errors stand in place of what the job says.

    Attributes
    ----------
    method : METHOD
        How the readings count; default: weighted where their errors are known, else least-squares.
    influence : FILE
        Stored influence coefficients, in place of trial runs.
    waveforms : FILE
        A waveforms file (.toml) of the runs, in place of the runs table.
    coefficients : KIND
        measured, computed, combined: from the runs, from the job's rotor, or both; default: measured where
        there are trial weights.
    machine_type : FLEET:TYPE
        Coefficients of the machine's type, from a store of `rotorid fleet`; a baseline is enough.
    model_error : PERCENT
        Standard deviation of computed coefficients; combined: 20 if not given.
    amplitude_error : PERCENT
        Standard deviation of a reading's amplitude.
    phase_error : DEGREES
        Standard deviation of a reading's phase.
    run_error : PERCENT
        Standard deviation of what changes from run to run, percent of a reading.
    phase : lead|lag
        What a positive phase means.
    angles : DIRECTION
        How angles count: with rotation, against rotation, or clockwise and counter-clockwise where the job
        states its rotation.
    planes : LIST
        Use these planes only.
    speeds : LIST
        Use these speeds only, in the unit of the runs table, or with another one: 20Hz,25Hz.
    max_mass : MASS
        Largest weight of every plane, 5g; or left=5g,right=3g.
    limit : SENSOR=VALUE
        Largest amplitude of a sensor; VALUE alone: of all. May be repeated.
    ridge : STRENGTH
        Small weights where planes act alike: 0.01 … 0.1, or auto.
    truncate : NUMBER
        Keep this many combinations of planes (1, 2, …), or those above this share (below 1).
    split
        Choose pieces in the holes of the job, all planes together: the fewest that leave at most 1.2 times
        the least vibration, a fifth of the present one, or what a check run does not show (a picture of
        discs).
    best
        The pieces that leave the least, however many they are.
    split_seconds : SECONDS
        For the proof that no choice is better, and again for the one that no fewer pieces do.
    refine
        Add the job's check runs to its trial runs: coefficients and trim from all of them.
    history
        All runs and check runs of the job in one table, too.
    best_planes : K
        Use the best K planes, after comparing all choices.
    trade_off
        Residual against total weight, too (a second picture).
    grade : GRADE
        Judge the planes by ISO 21940-11: G0.4 to G4000.
    rotor_mass : MASS
        For --grade, such as 500kg.
    service_speed : SPEED
        For --grade, such as 3000rpm.
    positions : LIST
        For --grade, along the shaft: left=100mm,right=600mm; default: half in each plane.
    bearings : A,B
        For --positions, 0mm,700mm.
    centre : POSITION
        For --positions: of the centre of mass.
    """

    method: str | None = None
    influence: Path | str | None = None
    waveforms: Path | str | None = None
    coefficients: str | None = None
    machine_type: str | None = None
    model_error: float | None = None
    amplitude_error: float | None = None
    phase_error: float | None = None
    run_error: float | None = None
    phase: str | None = None
    angles: str | None = None
    planes: Names | None = None
    speeds: Speeds | None = None
    max_mass: Weights | None = None
    limit: Amplitudes = ()
    ridge: str | float | None = None
    truncate: float | None = None
    split: bool = False
    best: bool = False
    split_seconds: float = 5.0
    refine: bool = False
    history: bool = False
    best_planes: int | None = None
    trade_off: bool = False
    grade: str | None = None
    rotor_mass: Amount | None = None
    service_speed: Amount | None = None
    positions: Positions | None = None
    bearings: str | tuple[float, float] | None = None
    centre: Amount | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Balance(Parts):
    """A correction, and what was asked for beside it.

    Attributes
    ----------
    result, influence
        The correction and the coefficients that it is made of.
    job, source
        As it was read, and from what; None: it was given as it is.
    mounted, check, verdict, tolerance, subsets, curve, history
        Pieces in holes, check runs beside their prediction, what limits and tolerances say, the tolerance
        itself, choices of planes, residual against total weight, all runs; None where there is nothing.
    left
        What is left to do after the check run.
    next_trial
        Of a calibrated rotor: the trial run that would tell most.
    of_type
        Where the coefficients are those of a type of machines.
    """

    result: Correction
    influence: Influence
    job: Job
    source: JobSource | None
    mounted: Mounted | None
    check: CheckComparison | None
    verdict: Verdict | None
    tolerance: Tolerance | None
    subsets: Subsets | None
    curve: TradeOff | None
    history: History | None
    left: LeftToDo | None = None
    next_trial: NextTrial | None = None
    of_type: TypeKnowledge | None = None

    @property
    def parts(self) -> Mapping[str, Any]:
        """The correction, and what was asked for beside it."""
        return {
            "": self.result,
            "mounting": self.mounted,
            "check": self.check,
            "left_to_do": self.left,
            "verdict": self.verdict,
            "best_planes": self.subsets,
            "trade_off": self.curve,
            "history": self.history,
            "next_trial": self.next_trial,
            "of_type": self.of_type,
        }

    @property
    def answer(self) -> Answer:
        """The judgement first: of limits, of the check run, of the pieces, or whether to mount at all."""
        from rotorid.workflows.calibration.one_shot import NEEDS_TRIAL, needs_trial_run

        weights, sound = self.result.answer, self.result.sound
        if needs_trial_run(self.job, self.influence):
            weights, sound = replace(weights, judgement=f"Make a trial run first: {NEEDS_TRIAL}."), False
        if self.left is not None:
            return self._after_check(self.left)
        if sound and self.mounted:
            weights = replace(weights, judgement="")
        if self.mounted:
            weights = replace(weights, found="", tables=(weights.found, *weights.tables))
        judged = [part.answer for part in (self.verdict, self.mounted) if part]
        asked = [part.answer for part in (self.subsets, self.curve, self.history) if part]
        found = together([*judged, weights, *asked] if sound else [weights, *judged, *asked])
        notes = list(found.notes)
        if self.next_trial is not None:
            notes.insert(0, self.next_trial.words)
        if self.result.limits is not None and (self.subsets or self.curve):
            notes.append("the comparison of planes and the trade-off do not look at the limits")
        return replace(found, notes=tuple(notes))

    def _after_check(self, left: LeftToDo) -> Answer:
        """The verdict and what is left to do; the weights of the bare rotor are tables."""
        limits = [] if self.verdict is None else [self.verdict.answer]
        first = [one.judgement for one in (*limits, left.answer)]
        cause, pieces = [], self.job.check_pieces
        if self.check is not None:
            first.insert(-1, self.check.headline)
            cause.append(sentence(self.check.verdict))
        if pieces is not None:
            first.append(f"Taken to be mounted, by --split: {pieces.in_holes()}; else state check_weights.")
        behind = [part.answer for part in (self.mounted, self.result) if part]
        tables = [replace(one, found="", tables=(one.found, *one.tables)) for one in behind]
        asked = [part.answer for part in (self.check, self.subsets, self.curve, self.history) if part]
        found = together([left.answer, *limits, *asked, *tables])
        return replace(found, judgement="\n".join([" ".join(first), *cause]))

    def to_frame(self) -> pd.DataFrame:
        """The weights, or what goes into each hole."""
        return self.result.to_frame() if self.mounted is None else self.mounted.to_frame()

    @property
    def equations(self) -> Equations:
        """The stretched W D = −Y."""
        from rotorid.report.equations_of_results import correction_equations

        return correction_equations(self.result, self.influence)

    def figure(self) -> Figure:
        """The correction, or what was asked for beside it: discs with holes, tolerances, the trade-off."""
        from balancing.plots import correction_polar, discs, tolerances, trade_off_curve

        pieces = self.mounted if self.left is None else self.left.pieces
        if pieces is not None:
            return discs.mounted_discs(pieces)
        below, verdict = None, self.verdict
        if verdict is not None and any(row.kind == "plane" for row in verdict.rows):
            below = partial(tolerances.residuals, verdict, t=self.tolerance)
        elif self.curve is not None:
            return trade_off_curve.overview(self.curve)
        elif self.subsets is not None:
            below = partial(trade_off_curve.choices, self.subsets)
        return correction_polar.overview(self.result, self.job.trials, self.check, below)

    def sheet(self) -> bytes:
        """The balancing sheet: one HTML file."""
        from rotorid.report.balance import balance_report

        return balance_report(
            self.to_dict(), self.parts, self.influence, self.job, self.provenance, self.answer.judgement
        )

    def workbook(self, path: Path | str) -> bytes:
        """The job with its results, for a file at this path; `read_job` reads the job back from it.

        Raises
        ------
        ValueError
            For a job that was not read from files here.
        """
        from rotorid.tables.job.workbook_writing import job_workbook_bytes

        if self.source is None:
            raise ValueError("a workbook is made of the files of a job: give these, not what was read")
        return job_workbook_bytes(self.job, self.source, Path(path), self, self.provenance)

    def influence_table(self, path: Path | str) -> bytes:
        """The coefficients for a file at this path, .csv or .xlsx."""
        from rotorid.tables.runs.influence_table import influence_bytes

        return influence_bytes(Path(path), self.influence)


@command
def balance(job: JobGiven, options: BalanceOptions | None = None) -> Balance:
    """Correction weights that minimise the vibration, with predicted residuals and uncertainty.

    Parameters
    ----------
    job
        A job file (`.toml`, `.xlsx`), or a runs table with a weights table or stored coefficients; or a job
        that has been read already: what it would be under other conventions cannot be told then.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a job or an option that cannot be; UndeterminedError, InputError.
    """
    from balancing import compare_check
    from rotorid.tables.job.job_as_written import JobSource
    from rotorid.workflows.calibration.one_shot import next_trial

    options = options or BalanceOptions()
    _check(options)
    source = _source(job, options)
    files = source if isinstance(source, JobSource) else None
    read = _with_pieces(with_contradiction(_read(source, options)), options)
    known, of_type = _choose(read, options)
    influence = known[0]
    planes, subsets = _planes(read, known, options)
    result = _correct(read, known, planes, options)
    if of_type is not None:
        result = of_type.judged(result)
    again = None if files is None else partial(_again, files, planes, options)
    result = with_other_readings(result, read, again, refined=options.refine)
    room = bool(read.holes) or read.check_pieces is None or not options.refine
    mounted = _mount(result, read, known, options) if options.split and room else None
    checked = None if options.refine else read.check
    tolerance = _tolerance(result.planes, options)
    check = None if checked is None else compare_check(result, checked, *known)
    if check is not None:
        check = replace(check, as_proposed=not read.check_mounted)
    verdict = _judge(result, influence, read, tolerance, mounted)
    return Balance(
        result=result,
        influence=influence,
        job=read,
        source=None if files is None else _with_limits(files, read, options),
        mounted=mounted,
        check=check,
        verdict=verdict,
        left=None if read.check is None else _left(result, read, known, options, check, verdict, mounted),
        tolerance=tolerance,
        subsets=subsets,
        curve=_trade_off(result, influence, read) if options.trade_off else None,
        history=_history(result, influence, read) if options.history else None,
        next_trial=next_trial(read, influence, result.weights, result.planes),
        of_type=of_type,
        provenance=provenance(read.files if of_type is None else (*read.files, *of_type.files), options),
    )


def _check(options: BalanceOptions) -> None:
    """Refuse options that are not known or do not go together, before anything is read."""
    check_choices(options, choices())
    if options.coefficients is not None:
        one_of(options.coefficients, "--coefficients", KINDS)
    if options.machine_type is not None and (options.coefficients or options.influence):
        raise ValueError("--type has the coefficients: leave --coefficients and --influence away")
    if options.ridge is not None and options.truncate is not None:
        raise ValueError("--ridge and --truncate are two ways to the same end: choose one")
    if options.best and not options.split:
        raise ValueError("--best chooses pieces: it means something only with --split")
    if options.split and (options.ridge is not None or options.truncate is not None):
        raise ValueError(
            "--split takes the planes as they are, and would undo --ridge and --truncate: use fewer planes "
            "(--planes, --best-planes) instead"
        )


def _source(job: JobGiven, options: BalanceOptions) -> Job | JobSource:
    """A job that has been read, or what is to be read."""
    from rotorid.tables import Job
    from rotorid.tables.job.job_as_written import JobSource
    from rotorid.tables.job.job_data import Overrides

    stored = None if options.influence is None else Path(options.influence)
    errors = options.amplitude_error, options.phase_error, options.run_error
    said = (options.phase, options.angles, *errors, options.waveforms)
    if not isinstance(job, Job):
        files = job if isinstance(job, Sequence) and not isinstance(job, str) else [job]
        return JobSource(tuple(file_of(file, "a job") for file in files), stored, Overrides(*said))
    if any(value is not None for value in (stored, *said)):
        raise ValueError("the conventions of a job, its errors and coefficients are stated where it is read")
    return job


def _read(source: Job | JobSource, options: BalanceOptions) -> Job:
    from rotorid.tables import job_from_files, read_job
    from rotorid.tables.job.job_as_written import JobSource
    from rotorid.workflows.option_quantities import limited

    if isinstance(source, JobSource):
        files, said = source.files, asdict(source.overrides)
        single = len(files) == 1 and source.influence is None
        if single and files[0].suffix.lower() in (".toml", ".xlsx"):
            source = read_job(files[0], **said)
        else:
            source = job_from_files(files, influence=source.influence, **said)
    return limited(source, options.max_mass, options.limit)


def _choose(job: Job, options: BalanceOptions) -> tuple[Known, TypeKnowledge | None]:
    if options.machine_type is None:
        return choose(job, options.coefficients, options.model_error, refined=options.refine), None
    from rotorid.workflows.fleet.type_coefficients import type_coefficients

    found = type_coefficients(job, options.machine_type, refined=options.refine)
    return (found.influence, None), found


def _planes(job: Job, known: Known, options: BalanceOptions) -> tuple[Sequence[str], Subsets | None]:
    """Those to use, and the choices among which they are the best."""
    from balancing.correction.best_planes import compare_planes

    planes = names(options.planes) or used_planes(job, known[0])
    if options.best_planes is None:
        return planes, None
    subsets = compare_planes(
        *known,
        planes,
        options.best_planes,
        speeds=_speeds(job, options),
        criterion="max" if options.method == "minmax" else "rms",
        row_weights=job.row_weights,
    )
    return subsets.planes[0], subsets


def _speeds(job: Job, options: BalanceOptions) -> list[float] | None:
    return None if options.speeds is None else speeds(options.speeds, job.trials.labels.speed_unit)


def _correct(job: Job, known: Known, planes: Sequence[str], options: BalanceOptions) -> Correction:
    from balancing import correct

    influence, baseline = known
    return correct(
        influence,
        baseline,
        planes,
        _speeds(job, options),
        refuse=options.machine_type is None,  # how a machine differs from its type is no error of readings
        method=options.method,
        limits=job.limits_of(influence.planes),
        row_weights=job.row_weights,
        strength=_strength(options.ridge),
        keep=options.truncate,
        remove=sorted(job.remove),
    )


def _strength(given: str | float | None) -> str | float | None:
    if given is None or given == "auto":
        return given
    value = number(given) if isinstance(given, str) else given
    if not 0 < value < math.inf:
        raise ValueError(f"--ridge {given!r}: a strength above 0, such as 0.03, or auto")
    return value


def _again(
    source: JobSource, planes: Sequence[str], options: BalanceOptions, phase: str, angles: str
) -> Correction:
    """The same files under other conventions."""
    with catch_warnings(action="ignore"):  # said when the job was read
        said = replace(source.overrides, phase=phase, angles=angles)
        job = _read(replace(source, overrides=said), options)
    return _correct(job, _choose(job, options)[0], planes, options)


def _with_pieces(job: Job, options: BalanceOptions) -> Job:
    """The job with the pieces in its check runs that these options propose without them."""
    from rotorid.workflows.check_pieces import pieces_mounted, with_pieces

    if job.check is None or job.check_mounted or not job.holes:
        return job
    before = replace(options, refine=False)
    known, _ = _choose(job, before)
    result = _correct(job, known, _planes(job, known, before)[0], before)
    pieces = pieces_mounted(job, result, *known, time_limit=options.split_seconds)
    return job if pieces is None else with_pieces(job, pieces)


def _left(
    result: Correction,
    job: Job,
    known: Known,
    options: BalanceOptions,
    check: CheckComparison | None,
    verdict: Verdict | None,
    mounted: Mounted | None,
) -> LeftToDo:
    """What is left to do after the check run, by all runs where the coefficients are measured."""
    import numpy as np

    from balancing.correction.convention_assumptions import contradiction
    from balancing.correction.refine_coefficients import mounted_in
    from balancing.mounting.left_to_do import left_to_do

    assert job.check is not None
    words = () if result.convention_test is None else contradiction(result.convention_test, result.labels)
    stop, pieces = "; ".join(words), mounted if options.refine else None
    if not options.refine:
        there = mounted_in(job.check, result)
        weights = np.column_stack(list(there.values()))
        runs = replace(job.check, planes=tuple(there), weights=weights)
        refined = replace(options, refine=True, best_planes=None)
        try:
            measured = known[1] is None and known[0].trials is not None and options.machine_type is None
            known = _choose(job, refined)[0] if measured else (known[0], runs)
            result = _correct(job, known, result.planes, refined)
        except ValueError as error:
            stop = stop or f"with the check run counted, {str(error).splitlines()[0]}"
            result = replace(result, mounted=(runs.runs[-1], runs.planes, weights[-1]))
    if job.check_pieces is not None and pieces is None and not stop:
        with suppress(ValueError):  # nothing more can be mounted in holes: a trim at any angle
            pieces = _mount(result, job, known, replace(options, refine=True))
    explained = None if check is None else check.explained
    judged = "" if verdict is None else verdict.overall
    return left_to_do(result, job.check, explained=explained, judged=judged, stop=stop, pieces=pieces)


def _mount(result: Correction, job: Job, known: Known, options: BalanceOptions) -> Mounted:
    from balancing.mounting.fewest_pieces import FEW
    from balancing.mounting.mount import mount

    if job.check_pieces is not None and not options.refine:
        return job.check_pieces
    return mount(
        result,
        *known,
        job.holes,
        row_weights=job.row_weights,
        time_limit=options.split_seconds,
        on_top=options.refine,
        within=1.0 if options.best else FEW,
    )


def _tolerance(planes: Sequence[str], options: BalanceOptions) -> Tolerance | None:
    """Tolerance of one or two planes; None where no grade is given."""
    from rotorid.workflows.option_quantities import positions
    from rotorid.workflows.tolerance import permissible

    grade, weight, speed = options.grade, options.rotor_mass, options.service_speed
    along = (options.positions, options.bearings, options.centre)
    if all(value is None for value in (grade, weight, speed, *along)):
        return None
    if grade is None or weight is None or speed is None:
        raise ValueError("a tolerance needs --grade, --rotor-mass and --service-speed together")
    if len(planes) > 2:
        raise ValueError(
            "a balance quality grade is one of rigid rotors: it is shared by one or two planes, not by "
            f"{len(planes)}; choose two with --planes, or judge by limits of the readings"
        )
    at = dict.fromkeys(planes) if options.positions is None else positions(options.positions)
    if set(at) != set(planes):
        raise ValueError(f"--positions must name the planes that are used, {', '.join(planes)}")
    said = "--rotor-mass", "--service-speed"
    return permissible(weight, speed, grade, at, options.bearings, options.centre, names=said)


def _trade_off(result: Correction, influence: Influence, job: Job) -> TradeOff:
    """Residual against total weight, in the planes and at the speeds used."""
    from balancing.coefficients.baseline import match_speeds
    from balancing.correction.selected_planes import plane_indices
    from balancing.correction.trade_off import trade_off

    at = match_speeds(result.speeds, influence.speeds)
    part = influence.part(at, None, plane_indices(influence, result.planes))
    return trade_off(
        part.W.reshape(-1, len(part.planes)),
        result.before.ravel(),
        part.planes,
        criterion="max" if result.method == "minmax" else "rms",
        row_weights=None if job.row_weights is None else job.row_weights[at].ravel(),
        labels=result.labels,
    )


def _history(result: Correction, influence: Influence, job: Job) -> History:
    """Run by run, what was mounted and what vibrated."""
    from balancing.correction.history import history

    checks = () if job.check is None else (job.check,)
    return history(
        job.trials,
        *checks,
        corrections=None if job.check is None or job.check_mounted else result,
        limits=job.limits_of(influence.planes),
    )


def _with_limits(source: JobSource, job: Job, options: BalanceOptions) -> JobSource:
    """What the job was read from, with the limits put in place of its own."""
    from rotorid.workflows.option_quantities import largest_amplitudes, largest_weights

    return replace(
        source,
        max_weights=largest_weights(job, options.max_mass),
        limits=largest_amplitudes(job, options.limit),
    )


def _judge(
    result: Correction, influence: Influence, job: Job, tolerance: Tolerance | None, mounted: Mounted | None
) -> Verdict | None:
    """Of the check run if there is one, else of the prediction; None without anything to judge by."""
    import numpy as np

    from balancing.correction.verdict import verdict_of_check, verdict_of_prediction
    from rotorid.tables.reader.units import weight

    limited = result.limits is not None and bool(np.isfinite(result.limits.residual).any())
    if tolerance is None and not limited:
        return None
    radii = None
    if tolerance is not None and weight(result.labels.weight_unit).kind == "mass":
        radii = {p: job.radii[p] for p in result.planes if p in job.radii}
        if lost := [p for p in result.planes if p not in radii]:
            raise ValueError(
                "a tolerance is one of unbalances, and the weights are masses: give the radius of every "
                f"plane, radius_mm in [planes.{lost[0]}] of the job"
            )
    if job.check is not None:
        return verdict_of_check(
            influence,
            job.check,
            tolerance=tolerance,
            radii=radii,
            limits=job.limits_of(influence.planes),
            planes=result.planes,
        )
    return verdict_of_prediction(
        result,
        tolerance=tolerance,
        radii=radii,
        mounted=None if mounted is None or mounted.on_top_of is not None else mounted.weights,
        after=None if mounted is None else mounted.after,
    )
