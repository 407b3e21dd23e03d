"""`balance`: correction weights of a job, mounted in its holes, checked and judged."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import LINES, Answer, kinds, together
from rotorid.base.tables import Table
from rotorid.commands.balance_after_check import as_proposed, left_to_do
from rotorid.commands.balance_options import BalanceOptions as BalanceOptions
from rotorid.commands.balance_options import (
    choices,
    coefficients_of,
    job_of,
    solve,
    special,
    with_more_warnings,
    with_other_conventions,
)
from rotorid.commands.choice_of_coefficients import (
    KINDS,
    NEEDS_TRIAL,
    as_measured,
    counted,
    needs_trial_run,
    of_planes,
    used_planes,
)
from rotorid.commands.option_units import mounted_weights
from rotorid.commands.option_values import one_of, speeds
from rotorid.commands.without_phase import balanced_without_phase
from rotorid.report.options import check_choices, refuse
from rotorid.report.outcome import Outcome, aligned, command, outcome_of, provenance, table_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from balancing import (
        CheckComparison,
        Correction,
        Influence,
        Labels,
        LeftToDo,
        Limits,
        Mounted,
        Tolerance,
        Verdict,
        Zones,
    )
    from rotorid.commands.balance_options import JobGiven
    from rotorid.files import Job
    from rotorid.fleet.machine_type import TypeKnowledge
    from rotorid.report.outcome import Written


_TOLERANCE = ("grade", "rotor_mass", "service_speed")
_NEEDLESS = ("method", "ridge", "max_mass", "split", *_TOLERANCE)
"""Options that mean nothing beside `weights`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Balance(Outcome):
    """A correction, and what was asked for beside it.

    Attributes
    ----------
    influence, job
        What it is made of.
    mounted, check, left, verdict, of_type, zones
        Pieces in holes, check runs beside their prediction, what is left to do after them, what limits and
        tolerances say, where the coefficients are those of a type, zones; None where there is nothing.
    """

    influence: Influence
    job: Job
    mounted: Mounted | None = None
    check: CheckComparison | None = None
    left: LeftToDo | None = None
    verdict: Verdict | None = None
    of_type: TypeKnowledge | None = None
    zones: Zones | None = None

    @property
    def answer(self) -> Answer:
        """The judgement first: of limits, of the check run, of the pieces, or whether to mount at all."""
        result, mounted, check, left, job = self.result, self.mounted, self.check, self.left, self.job
        weights, sound = result.answer, result.sound
        if needs_trial_run(job, self.influence):
            weights, sound = replace(weights, judgement=f"Make a trial run first: {NEEDS_TRIAL}."), False
        limits, zone = ([] if part is None else [part.answer] for part in (self.verdict, self.zones))
        if left is not None:  # the weights of the bare rotor are tables
            first = [one.judgement for one in (left.answer, *limits)]
            if check is not None:
                first.append(check.headline if check.explained else check.answer.judgement)
            if job.check_pieces is not None:
                pieces = job.check_pieces.in_holes()
                first.append(f"Taken to be mounted, by --split: {pieces}; else state check_weights.")
            elif not (job.check_mounted or job.check_of_weights):
                first.append("Taken to be mounted: the weights that were proposed; else state check_weights.")
            first += [*result.decision.elsewhere, *(one.judgement for one in zone)]
            tables = [_behind(part.answer) for part in (mounted, result) if part]
            every = together([left.answer, *limits, *([check.answer] if check else []), *zone, *tables])
            trim = _trim_tables(left, result.labels) if left.word == "trim" else []
            return replace(every, judgement=" ".join(first), tables=(*trim, *every.tables))
        if mounted:
            elsewhere = "\n".join(result.decision.elsewhere)
            weights = replace(_behind(weights), judgement=elsewhere if sound else weights.judgement)
        elif sound and {*result.planes} & {*job.holes}:
            weights = replace(weights, judgement=f"{weights.judgement}\nIn holes: --split.")
        shown = [mounted.answer, weights] if mounted else [weights]
        return together([*(shown if sound else shown[::-1]), *limits, *zone])

    def to_dict(self) -> dict[str, Any]:
        """The keys of the correction, and those of what is beside it."""
        parts: dict[str, Any] = {
            "mounting": self.mounted,
            "check": self.check,
            "left_to_do": self.left,
            "verdict": self.verdict,
            "of_type": self.of_type,
            "zones": self.zones,
        }
        document: dict[str, Any] = self.result.to_dict()
        judgement, scale = document["judgement"], self.result.labels.vibration_scale
        if (left := self.left) is not None:  # what is mounted is not to be mounted again
            expected = left.correction.judgement.expected * scale if left.word == "trim" else None
            judgement.update(word=left.word, cause=left.why, instead=[], rms_expected=expected)
            judgement["rms_before"] = left.now * scale
        elif self.mounted:  # `mounting` has that of the pieces
            judgement["rms_expected"] = None
        return document | {key: part.to_dict() for key, part in parts.items() if part}

    def sheet(self) -> bytes:
        """The balancing sheet: one HTML file."""
        from rotorid.report.balance import balance_report

        if self.job.trials.special:
            return super().sheet()  # what these say stands in no form
        made = self.result, self.mounted, self.check, self.left, self.verdict, self.zones
        return balance_report(self.to_dict(), made, self.job, self.provenance, self.answer)


@command
def balance(job: JobGiven = (), options: BalanceOptions | None = None) -> Outcome:
    """Correction weights from trial runs, with or without phases, or a rotor model, and what they leave.

    Example: rotorid balance sample_data/turbo_job/job.toml --plot corrections.png

    Example: rotorid balance sample_data/turbo_job/holes.toml --split --report sheet.html

    --template job.xlsx writes a form; filled in, it is a job. --output sheet.xlsx is the job with results,
    --output w.json the coefficients, for --influence, and influence.csv a table of them.

    Parameters
    ----------
    job : JOB | RUNS WEIGHTS | RUNS
        Job (.toml, .xlsx); runs and weights tables; or runs with --influence.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a job or an option that cannot be; UndeterminedError, InputError.
    """
    options = options or BalanceOptions()
    check_choices(options, choices())
    if options.coefficients is not None:
        one_of(options.coefficients, "--coefficients", KINDS)
    if options.machine_type is not None and (options.coefficients or options.influence):
        raise ValueError("--type has the coefficients: leave --coefficients and --influence away")
    if options.ridge is not None and not 0 < options.ridge < math.inf:
        raise ValueError(f"--ridge {options.ridge:g}: a strength above 0, such as 0.03")
    if options.split and options.ridge is not None:
        raise ValueError(
            "--split takes the planes as they are, and would undo --ridge: use fewer --planes instead"
        )
    read, files, again = job_of(job, options)
    if read.trials.amplitudes_only:
        return balanced_without_phase(read, options)
    return corrected(read, options, files, again) if options.weights is None else _what_if(read, options)


def _what_if(job: Job, options: BalanceOptions) -> Outcome:
    """What the weights of the options would leave, with limits and zones.

    Check runs count for the coefficients where `options.refine`, and else not at all.
    """
    from balancing import match_speeds, verdict_of_readings, what_if, zones_of

    refuse(options, _NEEDLESS, "means nothing with --weights, which are taken as they are")
    given = mounted_weights(job, options.weights or {})
    coefficients, of_type = coefficients_of(job, options)
    influence, runs = of_planes(job, coefficients)
    limits = job.limits_of(influence.planes)
    beyond = [] if limits is None else _beyond(limits, influence, given, job)
    remarks = influence.remarks
    influence = replace(influence, remarks=remarks._replace(warnings=(*beyond, *remarks.warnings)))
    chosen = None if options.speeds is None else speeds(options.speeds, job.trials.labels.speed_unit)
    remove = [name for name, plane in job.planes.items() if plane.remove]
    result = what_if(influence, given, runs, chosen, remove)
    if job.rotor is not None:
        from rotorid.commands.model_places import next_mode

        result = replace(result, worse=(*result.worse, *next_mode(job, result)))
    verdict = None
    if limits is not None and limits.residual.min() < math.inf:
        kept = limits.pick(match_speeds(result.speeds, influence.speeds), range(len(result.planes)))
        verdict = verdict_of_readings(result.influence, result.after, result.after_covariance, kept)
    zones = zones_of(result, job.zones) if job.zones else None
    beside = {key: part for key, part in (("verdict", verdict), ("zones", zones)) if part}
    return outcome_of(
        result,
        provenance(job.files if of_type is None else of_type.files, options),
        answer=together([result.answer, *(part.answer for part in beside.values())]),
        keys=lambda: result.to_dict() | {key: part.to_dict() for key, part in beside.items()},
        file=Table("weights", result.columns()),
        title="What these weights would leave",
    )


def _beyond(limits: Limits, influence: Influence, given: Mapping[str, complex], job: Job) -> list[str]:
    """Where given weights are beyond the largest weight of a plane, or in an arc that is forbidden."""
    words, labels = list[str](), influence.labels
    for plane, most, arcs in zip(influence.planes, limits.max_weight, limits.forbidden, strict=True):
        weight = given.get(plane, 0j)
        put = f"{labels.weight_at(-weight if job.planes[plane].remove else weight)} in plane {plane!r}"
        if abs(weight) > most * (1 + 1e-9):
            words.append(f"{put} is more than the largest weight there, {labels.weight_words(most)}")
        at = cmath.phase(weight)
        if weight and any(1e-9 < (at - start) % math.tau < width - 1e-9 for start, width in arcs):
            words.append(f"{put} stands where the job forbids weights (forbidden_deg)")
    return words


def corrected(
    read: Job, options: BalanceOptions, files: Sequence[Path] = (), again: Callable[..., Job] | None = None
) -> Balance:
    """The correction of a job, its pieces and check runs.

    `files` make the workbook, `again` reads the job under other conventions.
    """
    from balancing import compare_check, mount, zones_of

    stated = read.check is None or read.check_mounted
    solved = solve(read, options if stated else replace(options, refine=False))
    if not stated:
        read = as_proposed(read, solved.result, *solved.coefficients)
        solved = solve(read, options) if options.refine else solved
    influence, runs = solved.coefficients
    # what was proposed before a refinement was proposed by these conventions and no others
    result = with_other_conventions(solved, read, again if stated or not options.refine else None, options)
    if read.trials.special:
        result = special(result, read, options.coefficients)
    mounted, check, left = None, None, None
    if read.check is None or options.refine:
        if options.split and (read.holes or read.check_pieces is None):
            mounted = mount(result, influence, runs, read.holes, on_top=options.refine)
    else:
        mounted = read.check_pieces if options.split else None  # the trim has its own
        compared = result, read.check, influence, runs
        if read.held is not None and result.parts is not None and (there := counted(read)) is not None:
            measured = as_measured(read, influence)
            compared = result.parts, there, measured, runs and read.held.of_runs(runs)
        check = replace(compare_check(*compared), as_proposed=not stated)
    verdict = _judge(result, influence, read, options, mounted)
    if read.check is not None:
        trim = mounted if options.refine else None
        left = left_to_do(solved._replace(result=result), read, options, check, verdict, trim)
        result = _also_warned(result, left.correction)
    after = None if mounted is None else mounted.after
    zones = zones_of(result, read.zones, after, read.check) if read.zones else None
    made = provenance(read.files if solved.of_type is None else solved.of_type.files, options)

    def workbook(_: Path) -> Written:
        from rotorid.files.job_excel import job_workbook_bytes

        if not files:
            raise ValueError("a workbook is made of the files of a job: give these, not what was read")
        return job_workbook_bytes(files, outcome, made)

    def coefficients(path: Path) -> Written:
        from rotorid.files.influence import influence_bytes

        if read.trials.relative is not None:
            raise ValueError(f"{path.name}: {read.trials.special}")
        used = [influence.planes.index(plane) for plane in used_planes(read, influence)]
        part = influence.part(range(len(influence.speeds)), planes=used)
        return influence_bytes(path, as_measured(read, part))

    outcome = Balance(
        result=result,
        provenance=made,
        file=lambda: table_of((left or mounted or result).to_frame()),
        files={"influence.csv": coefficients, ".xlsx": workbook, ".json": coefficients},
        pictures={"": lambda: _picture(outcome)},
        solved=result,
        lines=LINES + 6 * bool(mounted or (left and left.pieces)),
        influence=influence,
        job=read,
        mounted=mounted,
        check=check,
        left=left,
        verdict=verdict,
        of_type=solved.of_type,
        zones=zones,
    )
    return outcome


def _also_warned(result: Correction, counted: Correction) -> Correction:
    """With what only the correction with the check run counted warns of."""
    warned = result.warnings
    more = [
        f"with the check run counted, {words}"
        for words in counted.warnings[len(counted.contradictions) :]
        if len(kinds((*warned, words))) > len(kinds(warned))
    ]
    return with_more_warnings(result, *more)


def _trim_tables(left: LeftToDo, labels: Labels) -> list[str]:
    """Every reading now and with the trim, below its weights where pieces stand for them."""
    from rotorid.report.balance import next_run, trim_table

    document, unit = {"left_to_do": left.to_dict()}, labels.vibration_in
    blocks = [
        f"Vibration{unit and f' in {unit}'}, now and with the trim\n{aligned(next_run(document, labels))}"
    ]
    if left.pieces is not None:
        blocks.insert(0, f"The trim that the pieces make\n{aligned(trim_table(document, labels))}")
    return blocks


def _behind(answer: Answer) -> Answer:
    """An answer whose tables come after all others', without the largest readings that its weights leave."""
    return replace(answer, numbers="", tables=(answer.numbers.rpartition("\n\n")[0], *answer.tables))


def _picture(made: Balance) -> Figure:
    """The correction or what is mounted, the check run and the trim."""
    from balancing.plots import correction_figure

    return correction_figure(made.result, made.mounted, made.check, made.left)


def _tolerance(planes: Sequence[str], options: BalanceOptions) -> Tolerance:
    """Tolerance of one or two planes."""
    stated = [getattr(options, name) for name in _TOLERANCE]
    if None in stated:
        raise ValueError("a tolerance needs --grade, --rotor-mass and --service-speed together")
    if len(planes) > 2:
        raise ValueError(
            "a balance quality grade is one of rigid rotors: it is shared by one or two planes, not by "
            f"{len(planes)}; choose two with --planes, or judge by limits of the readings"
        )

    from rotorid.commands.tolerance import ToleranceOptions, permissible

    grade, weight, speed = stated
    return permissible(
        ToleranceOptions(weight, speed, grade, dict.fromkeys(planes)),
        names=("--rotor-mass", "--service-speed"),
    )


def _judge(
    result: Correction, influence: Influence, job: Job, options: BalanceOptions, mounted: Mounted | None
) -> Verdict | None:
    """Of the check run if there is one, else of the prediction; None without anything to judge by."""
    from balancing import verdict_of_check, verdict_of_prediction

    stated = any(getattr(options, name) is not None for name in _TOLERANCE)
    tolerance = _tolerance(result.planes, options) if stated else None
    limits = result.limits if job.check is None else job.limits_of(influence.planes)
    if tolerance is None and (limits is None or limits.residual.min() == math.inf):
        return None
    radii = None
    if tolerance is not None and not result.labels.unbalances:
        radii = {p: job.radii[p] for p in result.planes if p in job.radii}
        if lost := [p for p in result.planes if p not in radii]:
            raise ValueError(
                "a tolerance is one of unbalances, and the weights are masses: give the radius of every "
                f"plane, radius_mm in [planes.{lost[0]}] of the job"
            )
    if job.check is not None:
        return verdict_of_check(influence, job.check, tolerance=tolerance, radii=radii, limits=limits)
    return verdict_of_prediction(
        result,
        tolerance=tolerance,
        radii=radii,
        mounted=None if mounted is None else mounted.weights,
        after=None if mounted is None else mounted.after,
    )
