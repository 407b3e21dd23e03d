"""`balance`: correction weights of a job, mounted in its holes, checked and judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorid.base.answer import Answer, together
from rotorid.base.text import sentence
from rotorid.commands.after_check import as_proposed, left_to_do
from rotorid.commands.balance_options import BalanceOptions as BalanceOptions
from rotorid.commands.balance_options import check_options
from rotorid.commands.balance_solution import (
    read_source,
    solve,
    source_of,
    with_limits_of,
    with_other_conventions,
)
from rotorid.commands.option_quantities import positions
from rotorid.commands.tolerance import ToleranceOptions, permissible
from rotorid.report.outcome import Parts, command, provenance

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from balancing import (
        CheckComparison,
        Correction,
        Influence,
        LeftToDo,
        Mounted,
        Subsets,
        Tolerance,
        Verdict,
    )
    from rotorid.commands.balance_solution import JobGiven
    from rotorid.fleet.type_coefficients import TypeKnowledge
    from rotorid.report.equations import Equations
    from rotorid.tables import Job
    from rotorid.tables.job.job_as_written import JobSource


@dataclass(frozen=True, eq=False, kw_only=True)
class Balance(Parts):
    """A correction, and what was asked for beside it.

    Attributes
    ----------
    result, influence
        The correction and the coefficients that it is made of.
    job, source
        As it was read, and from what; None: it was given as it is.
    mounted, check, verdict, tolerance, subsets
        Pieces in holes, check runs beside their prediction, what limits and tolerances say, the tolerance
        itself, choices of planes; None where there is nothing.
    left
        What is left to do after the check run.
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
    left: LeftToDo | None = None
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
            "of_type": self.of_type,
        }

    @property
    def answer(self) -> Answer:
        """The judgement first: of limits, of the check run, of the pieces, or whether to mount at all."""
        from rotorid.commands.one_shot import NEEDS_TRIAL, needs_trial_run

        weights, sound = self.result.answer, self.result.sound
        if needs_trial_run(self.job, self.influence):
            weights, sound = replace(weights, judgement=f"Make a trial run first: {NEEDS_TRIAL}."), False
        if self.left is not None:
            return self._after_check(self.left)
        if self.mounted:
            judgement = "" if sound else weights.judgement
            weights = replace(_behind(weights), judgement=judgement)
        judged = [part.answer for part in (self.verdict, self.mounted) if part]
        chosen = [] if self.subsets is None else [self.subsets.answer]
        every = together([*judged, weights, *chosen] if sound else [weights, *judged, *chosen])
        notes = list(every.notes)
        if self.result.limits is not None and self.subsets:
            notes.append("the comparison of planes does not look at the limits")
        return replace(every, notes=tuple(notes))

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
        asked = [part.answer for part in (self.check, self.subsets) if part]
        tables = [_behind(part.answer) for part in (self.mounted, self.result) if part]
        every = together([left.answer, *limits, *asked, *tables])
        return replace(every, judgement="\n".join([" ".join(first), *cause]))

    def to_frame(self) -> pd.DataFrame:
        """The weights, or what goes into each hole."""
        return self.result.to_frame() if self.mounted is None else self.mounted.to_frame()

    def table_file(self, path: Path) -> bytes | Mapping[Path, bytes]:
        """The weights; for an .xlsx the job with its results, which `read_job` reads the job back from."""
        if path.suffix.lower() != ".xlsx":
            return super().table_file(path)
        from rotorid.tables.job.workbook_writing import job_workbook_bytes

        if self.source is None:
            raise ValueError("a workbook is made of the files of a job: give these, not what was read")
        return job_workbook_bytes(self.job, self.source, path, self, self.provenance)

    @property
    def equations(self) -> Equations:
        """The stretched W D = −Y."""
        from rotorid.report.equations_of_results import correction_equations

        return correction_equations(self.result)

    def figure(self) -> Figure:
        """The correction, or what was asked for beside it: discs with holes, tolerances."""
        from balancing import plots

        pieces = self.mounted if self.left is None else self.left.pieces
        if pieces is not None:
            return plots.mounted_discs(pieces)
        below, verdict = None, self.verdict
        if verdict is not None and any(row.kind == "plane" for row in verdict.rows):
            below = partial(plots.draw_verdict, verdict, t=self.tolerance)
        return plots.correction_figure(self.result, self.check, below)

    def sheet(self) -> bytes:
        """The balancing sheet: one HTML file."""
        from rotorid.report.balance import balance_report

        return balance_report(
            self.to_dict(), self.parts, self.influence, self.job, self.provenance, self.answer.judgement
        )

    def further_file(self, option: str, path: Path) -> bytes:
        """The coefficients, .csv or .xlsx."""
        return self.influence_table(path)

    def influence_table(self, path: Path | str) -> bytes:
        """The coefficients for a file at this path, .csv or .xlsx."""
        from rotorid.tables.runs.influence_table import influence_bytes

        return influence_bytes(Path(path), self.influence)


def _behind(answer: Answer) -> Answer:
    """An answer whose tables come after all others'."""
    return replace(answer, found="", tables=(answer.found, *answer.tables))


@command
def balance(job: JobGiven = (), options: BalanceOptions | None = None) -> Balance:
    """Correction weights from trial runs or a rotor model, with ± and what will be left.

    Example: rotorid balance sample_data/turbo_job/job.toml --plot corrections.png

    Example: rotorid balance sample_data/turbo_job/holes.toml --split --report sheet.html

    Example: rotorid balance sample_data/turbo_job/runs.csv sample_data/turbo_job/weights.csv --phase lead

    Example: rotorid balance --template job.xlsx

    Den Hartog's method: influence coefficients at several speeds, least squares over all of them.

    The workbook, filled in, is a job: --output sheet.xlsx writes it with its results, and --output
    weights.csv the corrections alone. From Python a job that has been read may be given, too: what it would
    be under other conventions cannot be told then.

    Parameters
    ----------
    job : JOB | RUNS WEIGHTS | RUNS
        Job (.toml, .xlsx); or runs and weights tables; or a runs table with --influence.
    options
        Those that differ from the defaults.

    Raises
    ------
    ValueError
        For a job or an option that cannot be; UndeterminedError, InputError.
    """
    from balancing import compare_check, mount
    from rotorid.tables.job.job_as_written import JobSource

    options = options or BalanceOptions()
    check_options(options)
    source = source_of(job, options)
    files = source if isinstance(source, JobSource) else None
    read = read_source(source, options)
    unstated = read.check is not None and not read.check_mounted
    first = None
    if unstated or not options.refine:
        first = solve(read, replace(options, refine=False))
        read = as_proposed(read, first.result, *first.known)
    solved = first if first is not None and not options.refine else solve(read, options)
    influence, runs = solved.known
    # what was proposed before a refinement was proposed by these conventions and no others
    alone = options.refine and unstated
    result = with_other_conventions(solved, read, None if alone else files, options)
    mounted, check, left, in_check = None, None, None, read.check_pieces
    if options.split and in_check is not None and not options.refine:
        mounted = in_check
    elif options.split and (read.holes or in_check is None):
        mounted = mount(result, influence, runs, read.holes, on_top=options.refine)
    if read.check is not None and not options.refine:
        check = replace(compare_check(result, read.check, influence, runs), as_proposed=unstated)
    tolerance = _tolerance(result.planes, options)
    verdict = _judge(result, influence, read, tolerance, mounted)
    if read.check is not None:
        trim = mounted if options.refine else None
        left = left_to_do(solved._replace(result=result), read, options, check, verdict, trim)
    of_type = solved.of_type
    return Balance(
        result=result,
        influence=influence,
        job=read,
        source=None if files is None else with_limits_of(files, read, options),
        mounted=mounted,
        check=check,
        verdict=verdict,
        left=left,
        tolerance=tolerance,
        subsets=solved.subsets,
        of_type=of_type,
        provenance=provenance(read.files if of_type is None else (*read.files, *of_type.files), options),
    )


def _tolerance(planes: Sequence[str], options: BalanceOptions) -> Tolerance | None:
    """Tolerance of one or two planes; None where no grade is given."""
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
    stated = ToleranceOptions(weight, speed, grade, at, options.bearings, options.centre)
    return permissible(stated, names=("--rotor-mass", "--service-speed"))


def _judge(
    result: Correction, influence: Influence, job: Job, tolerance: Tolerance | None, mounted: Mounted | None
) -> Verdict | None:
    """Of the check run if there is one, else of the prediction; None without anything to judge by."""
    import numpy as np

    from balancing import verdict_of_check, verdict_of_prediction

    limited = result.limits is not None and bool(np.isfinite(result.limits.residual).any())
    if tolerance is None and not limited:
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
        limits = job.limits_of(influence.planes)
        return verdict_of_check(influence, job.check, tolerance=tolerance, radii=radii, limits=limits)
    return verdict_of_prediction(
        result,
        tolerance=tolerance,
        radii=radii,
        mounted=None if mounted is None or mounted.on_top_of is not None else mounted.weights,
        after=None if mounted is None else mounted.after,
    )
