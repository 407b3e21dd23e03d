"""Options of `balance`, and the correction of a job by them, also as it were under other conventions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple
from warnings import catch_warnings

from rotorid.base.text import listing
from rotorid.commands.choice_of_coefficients import choose, counted, of_planes, stored, unknowns_of
from rotorid.commands.option_units import Errors, limited, percent_and_degrees
from rotorid.commands.option_values import Names, Speeds, names, speeds
from rotorid.report.options import file_of, refuse
from rotorid.report.outcome import EQUATIONS, WITH_REPORT

if TYPE_CHECKING:
    from balancing import ConventionTest, Correction, Influence, Trials
    from rotorid.base.choices import Method
    from rotorid.commands.option_units import Amount, Amplitudes, Mounted, Weights
    from rotorid.files import Job
    from rotorid.fleet.machine_type import TypeKnowledge

    JobGiven = Job | Path | str | Sequence[Path | str]
    """A job, its file, or a runs table and a weights table."""


_ABSOLUTE = ("influence", "coefficients", "machine_type", "max_mass", "ridge", "split", "refine", "grade")
"""Options that need known weights."""


def choices() -> dict[str, Sequence[Method[Any]]]:
    """What `method` chooses from."""
    from balancing import METHODS

    return {"method": METHODS}


@dataclass(frozen=True)
class BalanceOptions:
    """Options of `balance`; conventions and errors stand in place of what the job says.

    Attributes
    ----------
    method : METHOD
        How readings count; default: weighted where their errors are known.
    influence : FILE
        Stored influence coefficients, in place of trial runs.
    coefficients : KIND
        measured, computed (from the job's rotor) or combined.
    machine_type : --type FLEET:TYPE
        Coefficients of its type, from a fleet.
    errors : PERCENT,DEGREES
        One standard deviation of a reading's amplitude and of its phase: 2,1.
    phase : lead|lag
        What a positive phase means.
    angles : DIRECTION
        with rotation, against rotation; where the job states its rotation, clockwise or counter-clockwise.
    planes : LIST
        Use these planes or groups only.
    speeds : LIST
        Use these speeds only, as in the runs, or 20Hz,25Hz.
    max_mass : MASS
        Largest weight of every plane, 5g; or left=5g,right=3g.
    weights : PLANE=MASS@DEG;…
        What these would leave, without balancing: left=5g@120; right=10g#3 (a hole).
    limit : SENSOR=VALUE
        Largest amplitude of a sensor, or VALUE of all; repeatable.
    ridge : STRENGTH
        Small weights where planes act alike: 0.01 … 0.1.
    split
        Pieces in the holes of the job, as few as will do.
    refine
        Count check runs as trial runs: trim from all.
    grade : GRADE
        Judge one or two planes by ISO 21940-11: G0.4 to G4000.
    rotor_mass : MASS
        For --grade, such as 500kg.
    service_speed : SPEED
        For --grade, such as 3000rpm.
    template : FILE.xlsx
        Write an empty workbook to fill in.
    """

    method: str | None = None
    influence: Path | str | None = None
    coefficients: str | None = None
    machine_type: str | None = None
    errors: Errors | None = None
    phase: str | None = None
    angles: str | None = None
    planes: Names | None = None
    speeds: Speeds | None = None
    max_mass: Weights | None = None
    weights: Mounted | None = None
    limit: Amplitudes = ()
    ridge: float | None = None
    split: bool = False
    refine: bool = False
    grade: str | None = None
    rotor_mass: Amount | None = None
    service_speed: Amount | None = None
    template: Path | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Input and conventions": "phase angles errors",
        "Method": "method planes speeds coefficients machine_type influence ridge",
        "Limits, mounting, check run": "weights max_mass limit split refine grade rotor_mass service_speed",
        "Output": "template",
    }
    to = (*WITH_REPORT, *EQUATIONS)
    outputs = (".csv", ".xlsx", ".json")

    def before(self, job: Sequence[Path] | None) -> str | None:
        """Write the empty workbook where it is asked for, and say so.

        Raises
        ------
        ValueError
            Without a job; for a workbook beside one, a name that is no workbook's, and an existing file.
        """
        path = self.template
        if job and path is None:
            return None
        if job or path is None:
            raise ValueError(
                "give a job (.toml, .xlsx) or a runs table and a weights table; --template, without a "
                "job, writes a form"
            )
        from rotorid.commands.command_line import check_targets
        from rotorid.files.disk import write_files
        from rotorid.files.job_excel import template_bytes

        check_targets([(path, (".xlsx",))])
        if path.exists():
            raise ValueError(f"{path}: exists already, and may be filled in; choose another name")
        write_files({path: template_bytes()})
        return f"written: {path}\nFill it in (its sheet notes says how), then: rotorid balance {path}"


def job_of(job: JobGiven, options: BalanceOptions) -> tuple[Job, tuple[Path, ...], Callable[..., Job] | None]:
    """The job with the limits of the options, its files, and what reads it; none where it had been read."""
    from rotorid.files import Job, job_from_files, read_job

    stored = None if options.influence is None else Path(options.influence)
    percent, degrees = (None, None) if options.errors is None else percent_and_degrees(options.errors)
    stated = {
        "phase": options.phase,
        "angles": options.angles,
        "amplitude_error_percent": percent,
        "phase_error_deg": degrees,
    }
    files: tuple[Path, ...] = ()
    read: Callable[..., Job] | None = None
    if not isinstance(job, Job):
        several = job if isinstance(job, Sequence) and not isinstance(job, str) else [job]
        files = tuple(file_of(file, "a job") for file in several)
        if len(files) == 1 and stored is None and files[0].suffix.lower() in (".toml", ".xlsx"):
            read = partial(read_job, files[0], **stated)
        else:
            read = partial(job_from_files, files, influence=stored, **stated)
        job = read()
    elif any(value is not None for value in (stored, *stated.values())):
        raise ValueError("the conventions of a job, its errors and coefficients are stated where it is read")
    relative, index = job.trials.relative, job.trials.index
    if relative:
        refuse(options, _ABSOLUTE, "does not go with it: the trial weights of this job are not known (?)")
        if relative.angle and job.limits and any(job.limits.forbidden):
            raise ValueError(
                "forbidden_deg does not go with it: the places of trial weights are not known (?)"
            )
        if index is not None:
            raise ValueError("runs at several indices need trial weights that are known, without ?")
    if index is not None:
        refuse(options, ("machine_type", "refine"), "does not go with it: this job has an index")
        if options.coefficients == "combined":
            raise ValueError("--coefficients combined does not go with it: this job has an index")
    return limited(job, options.max_mass, options.limit), files, read


def special(result: Correction, job: Job, kind: str | None) -> Correction:
    """A correction as multiples of unknown trial weights, or with the unbalance of the arbor."""
    from balancing import relative_to, rotor_and_arbor, with_arbor

    if job.trials.relative is not None:
        return relative_to(result, job.trials.relative)
    return with_arbor(result, rotor_and_arbor(job.trials, stored(job, kind)))


class Solved(NamedTuple):
    """A correction with the coefficients and the runs that it is made of."""

    result: Correction
    coefficients: tuple[Influence, Trials | None]
    planes: Sequence[str]
    of_type: TypeKnowledge | None


def solve(job: Job, options: BalanceOptions, planes: Sequence[str] | None = None) -> Solved:
    """By the options, in the planes that they say or in given ones.

    Limits of readings that no weights keep are for the check run alone, where it is not to refine them.

    Raises
    ------
    UndeterminedError
        Whether the runs contradict their conventions first: these may be all that is wrong.
    """
    from balancing import InfeasibleError, UndeterminedError

    try:
        coefficients, of_type = coefficients_of(job, options)
        planes = planes or names(options.planes) or unknowns_of(job, coefficients[0])
        coefficients = of_planes(job, coefficients, planes)
        result = correct_job(job, coefficients, planes, options)
    except UndeterminedError as error:
        words = _test(job).contradiction(job.trials.labels)
        raise UndeterminedError("\n".join((*words, str(error)))) from None
    except InfeasibleError as error:
        limits = job.limits
        if job.check is None or options.refine or limits is None:
            raise
        free = replace(limits, residual=limits.residual + inf)
        solved = solve(replace(job, limits=free), options, planes)
        why = f"the weights are those without limits of readings: {error}"
        return solved._replace(result=with_more_warnings(solved.result, why))
    if job.rotor is not None:
        from rotorid.commands.model_places import next_mode

        decision = result.decision
        elsewhere = *decision.elsewhere, *next_mode(job, result)
        result = replace(result, decision=replace(decision, elsewhere=elsewhere))
    return Solved(result if of_type is None else of_type.judged(result), coefficients, planes, of_type)


def with_more_warnings(result: Correction, *more: str) -> Correction:
    """A correction with further warnings."""
    decision = replace(result.decision, warnings=(*result.decision.warnings, *more))
    return replace(result, decision=decision)


def _test(job: Job) -> ConventionTest:
    """What trial and check runs say of their conventions."""
    from balancing import convention_test, with_check_runs

    runs = job.trials
    with suppress(ValueError):  # of some sensors or speeds only: the trial runs alone
        if (check := counted(job)) is not None and check.planes:
            runs = with_check_runs(runs, check)
    return convention_test(runs)


def coefficients_of(
    job: Job, options: BalanceOptions
) -> tuple[tuple[Influence, Trials | None], TypeKnowledge | None]:
    """Coefficients, the runs that give the vibration (None: theirs), and the type that they are from."""
    check = job.check if options.refine else None
    if options.refine and check is None:
        raise ValueError('there are no check runs to refine with: check = "check.csv" in the job file')
    if options.machine_type is None:
        return choose(job, options.coefficients, refined=options.refine), None
    from balancing import with_check_runs
    from rotorid.fleet.machine_type import type_coefficients

    trials = with_check_runs(job.trials, check) if check else job.trials
    of_type = type_coefficients(job, options.machine_type, trials)
    return (of_type.influence, None), of_type


def correct_job(
    job: Job, coefficients: tuple[Influence, Trials | None], planes: Sequence[str], options: BalanceOptions
) -> Correction:
    """Of some planes, with coefficients and the runs that give the vibration (None: theirs)."""
    from balancing import correct

    influence, runs = coefficients
    return correct(
        influence,
        runs,
        planes,
        None if options.speeds is None else speeds(options.speeds, job.trials.labels.speed_unit),
        # how a machine differs from its type is no error of readings; a check run tells what weights leave
        refuse=options.machine_type is None and not options.refine,
        method=options.method,
        limits=job.limits_of(influence.planes),
        row_weights=job.row_weights,
        strength=options.ridge,
        remove=[name for name, plane in job.planes.items() if plane.remove],
        groups=job.groups,
    )


def with_other_conventions(
    solved: Solved, job: Job, read: Callable[..., Job] | None, options: BalanceOptions
) -> Correction:
    """The correction with what the runs say about its conventions, and what other ones give.

    `read` reads the job again under these; None: it cannot be.
    """
    result, labels, test = solved.result, solved.result.labels, _test(job)
    turned: list[tuple[str, ...]] = [(name,) for name in labels.assumed if test.verdict != "confirmed"]
    turned += [labels.assumed] if len(labels.assumed) == 2 else []
    others: list[tuple[list[str], Correction]] = []
    for assumed in turned:
        if read is None:
            break
        other = labels.otherwise(assumed)
        try:
            with catch_warnings(action="ignore"):  # what is read was warned of when the job was read
                again = read(phase=other.phase, angles=other.angles)
                again = limited(again, options.max_mass, options.limit)
                correction = solve(again, options, solved.planes).result
        except ValueError:  # no answer, as where limits cannot be met
            continue
        words = " and ".join(getattr(other, name).removesuffix(" rotation") for name in assumed)
        same = next((each for each, one in others if _alike(one, correction)), None)
        if same is not None:
            same.append(words)
        elif not _alike(result, correction):
            others.append(([words], correction))
    readings = tuple((listing(words), one) for words, one in others)
    return replace(result, convention_test=test, others=readings)


def _alike(a: Correction, b: Correction) -> bool:
    """Whether both say the same numbers, as they are printed."""
    import numpy as np

    one, two = (
        m * np.exp(1j * np.radians(angle)) for m, angle in (c.labels.weight(c.weights) for c in (a, b))
    )
    return bool(abs(one - two).max() <= 1e-6 * abs(one).max())
