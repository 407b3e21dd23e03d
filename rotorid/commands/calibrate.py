"""`calibrate`: numbers of a rotor file from trial runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import counted, error_figures, figures
from rotorid.commands.model_places import model_places
from rotorid.commands.option_values import Names
from rotorid.report.options import file_of, rotor_of
from rotorid.report.outcome import Outcome, command, provenance

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.base.arrays import BoolArray
    from rotorid.calibration import CalibratedRotor, RunReadings, Unknown
    from rotorid.files import Job
    from rotorid.regression.estimate import Uncertain

_ROWS = 5
"""Of the short table, with two numbers each."""


@dataclass(frozen=True)
class CalibrateOptions:
    """Options of `calibrate`.

    Attributes
    ----------
    estimate : LIST
        Unknown numbers: "bearing[1].kxx, k2 = bearing[2].kxx", `bearing[*].*` is every coefficient of every
        bearing (of tables over speed their scales), `bearing.kxx` one value for all.
    prior : LIST
        What is known of them: bearing[*].*=20%, bearing[1].kxx=7e7+-1e7.
    exact
        Modulus (1 %), discs (1 %), pedestals (10 %) and angles of probes (2°) are not estimated; ± count that
        they may be off by so much. Else they are unknown, too, with these standard deviations.
    """

    estimate: Names
    prior: str | Mapping[str, str] = ""
    exact: bool = False
    outputs = (".csv", ".xlsx", ".toml")
    to = ("output", "table", "json")


def outcome(calibrated: CalibratedRotor, origin: Mapping[str, Any]) -> Outcome:
    """Whether the model explains the data; the numbers; what the data do not tell."""
    import numpy as np

    from rotorid.regression.estimate import parameter_columns, parameter_dict, parameter_text

    estimate, wished = calibrated.fit.estimate, calibrated.wished
    fits = "explains" if calibrated.explained else "does NOT explain"
    chi = f"χ² {calibrated.chi_square:.4g} with {counted(calibrated.dof, 'degree')} of freedom"
    why = {} if calibrated.prior is None else calibrated.prior.why
    names, every = _part(calibrated, wished | True)
    parameters = parameter_dict(names, every)
    for name, unknown, share in zip(names, calibrated.unknowns, calibrated.data_share, strict=True):
        parameters[name] |= {"path": unknown.path, "prior": unknown.prior, "data_share": share}
    notes = {
        calibrated.seen: bool(calibrated.seen),
        f"searched from {calibrated.searches} starting values": calibrated.searches > 1,
        f"± count what {counted(len(calibrated.exact), 'number')} taken as exact may be off": bool(
            calibrated.exact
        ),
    }
    document = {
        "parameters": parameters,
        "rank": estimate.rank,
        "condition_number": estimate.condition_number,
        "identifiable": estimate.full_rank,
        "unidentifiable": [] if estimate.full_rank else [estimate.describe_rank()],
        "combinations": {c.words: {"value": c.value, "std": c.std} for c in estimate.combinations},
        "correlation": every.correlation,
        "seen": calibrated.seen or None,
        "residual_rms": np.sqrt(np.mean(estimate.residuals**2)),
        "chi_square": calibrated.chi_square,
        "degrees_of_freedom": calibrated.dof,
        "probability": calibrated.chance,
        "exact": calibrated.exact,
        "explained": calibrated.explained,
        "lack_of_fit": calibrated.lack_of_fit,
        "warnings": calibrated.warnings,
        "rotor": None,
    }

    def rotor_files(path: Path) -> Mapping[Path, bytes]:
        from rotorid.files.rotor import rotor_file_bytes

        if lacking := calibrated.undetermined:
            raise ValueError(f"{path}: no rotor file can be written, {lacking}")
        return rotor_file_bytes(path, calibrated.rotor)

    return Outcome(
        result=calibrated,
        sentences=(f"The model {fits} the data ({chi}).",),
        tables=(_short(*_part(calibrated, wished)),),
        more=tuple(
            parameter_text(*_part(calibrated, which), why) for which in (wished, ~wished) if which.any()
        ),
        beyond="all numbers, with 95 %",
        short=True,
        file=Table(
            "numbers", (*parameter_columns(names, every), Column("data_share", calibrated.data_share))
        ),
        files={".toml": rotor_files},
        keys=plain(document),
        warnings=calibrated.warnings,
        notes=tuple(note for note, there in notes.items() if there),
        provenance=origin,
    )


def _part(calibrated: CalibratedRotor, which: BoolArray) -> tuple[tuple[str, ...], Uncertain]:
    """Names of some of the numbers, and these with their errors."""
    import numpy as np

    from rotorid.regression.estimate import Uncertain

    part = Uncertain()
    part.values, part.errors_stated, part.dof = calibrated.values[which], True, 0
    determined = np.where(np.isnan(calibrated.std), np.nan, calibrated.covariance)
    part.covariance = determined[np.ix_(which, which)]
    return tuple(name for name, taken in zip(calibrated.names, which, strict=True) if taken), part


def _short(names: Sequence[str], part: Uncertain) -> str:
    """The first numbers with one standard deviation, two a line."""
    import numpy as np

    from rotorid.base.text import aligned

    stds = [np.nan] * len(names) if part.std is None else part.std
    cells = []
    for name, value, std in zip(names, part.values, stds, strict=True):
        digits = 4
        if std > 0 and value:  # as many as stand before the second digit of the error
            digits = max(2 + int(np.floor(np.log10(abs(value))) - np.floor(np.log10(std))), 1)
        number = f"{figures(value, digits)} ± {error_figures(std)}"
        cells += [name, "not determined" if np.isnan(value) else number]
    cells += [""] * (-len(cells) % 4)
    return aligned([cells[k : 4 * _ROWS : 4] for k in range(4)], left=4)


class Prepared(NamedTuple):
    """What is calibrated: the rotor, unknown numbers, data; files of both."""

    rotor: Rotor
    numbers: list[Unknown]
    readings: list[RunReadings]
    rotor_files: tuple[Path, ...]
    data_files: list[Path]

    @property
    def probes(self) -> list[str]:
        """Names of all sensors, each once."""
        return list(dict.fromkeys(sensor for data in self.readings for sensor in data.trials.sensors))


@command
def calibrate(
    rotor: Rotor | Path | str, data: Sequence[Path | str] | Path | str, options: CalibrateOptions
) -> Outcome:
    """Numbers of a rotor file from trial runs, critical speeds and modes, with ±.

    --output FILE.toml writes the calibrated rotor with its errors: `balance` then needs one run, and
    critical, campbell and response show bands.

    Example: rotorid calibrate sample_data/compressor/rotor.toml sample_data/calibration/trial.toml
    --estimate "bearing[*].*" --prior "bearing[*].*=20%" --output calibrated.toml

    Parameters
    ----------
    rotor : ROTOR
        Rotor table (.csv, .xlsx) or rotor file (.toml).
    data : DATA
        Jobs with trial runs (.toml, .xlsx).
    options
        What is unknown, and what is known of it.

    Raises
    ------
    ValueError
        For files or options that cannot be, and for data that say nothing of the rotor.
    """
    from rotorid import calibration
    from rotorid.commands.calibrate_options import unknowns

    given = prepared(rotor, data, options)
    origin = provenance([*given.rotor_files, *given.data_files], options)
    paths = {number.path for number in given.numbers}
    beside = unknowns(given.rotor, given.probes, options.estimate, exact=False) if options.exact else []
    exact = [number for number in beside if number.path not in paths]
    result = calibration.calibrate(*given[:3], exact=exact)
    of_rotor = {one["sha256"] for one in origin["inputs"][: len(given.rotor_files)]}  # which jobs name, too
    made_from = [one for one in origin["inputs"] if one["sha256"] not in of_rotor]
    hashes = {Path(one["file"]).name: one["sha256"] for one in made_from}
    numbers = replace(result.rotor.calibration, data=hashes)  # type: ignore[type-var]
    result = replace(result, rotor=replace(result.rotor, calibration=numbers))
    return outcome(result, origin)


def prepared(
    rotor: Rotor | Path | str, data: Sequence[Path | str] | Path | str, options: CalibrateOptions
) -> Prepared:
    """Read what is calibrated.

    Raises
    ------
    ValueError
        As `calibrate`.
    """
    from rotorid.commands.calibrate_options import unknowns
    from rotorid.files import read_job, rotor_files

    model = rotor_of(rotor)
    files = rotor_files(Path(rotor)) if isinstance(rotor, Path | str) else ()
    given = [data] if isinstance(data, Path | str) else list(data)
    if len({*map(str, given)}) < len(given):
        raise ValueError("one of the data files is given twice: it would count twice")
    sources = [file_of(file, "data") for file in given]
    readings, read = [], list[Path]()
    for file in sources:
        job = read_job(file)
        try:
            readings.append(run_readings(job, model))
        except ValueError as error:
            raise ValueError(f"{file.name}: {error}") from None
        read += job.files
    without = Prepared(model, [], readings, files, read)
    numbers = unknowns(model, without.probes, options.estimate, options.prior, exact=options.exact)
    return without._replace(numbers=numbers)


def run_readings(job: Job, rotor: Rotor) -> RunReadings:
    """The runs of a job at their places in the model.

    Raises
    ------
    ValueError
        Where a plane or a sensor has no place in the model, or the runs say nothing of it.
    """
    if job.trials.special:
        raise ValueError(job.trials.special)
    trials, places = job.trials, model_places(job)
    if job.rotor is not None and job.rotor.n_nodes != rotor.n_nodes:
        raise ValueError(
            f"the job names a rotor of {counted(job.rotor.n_nodes, 'node')}, this one has {rotor.n_nodes}: "
            "its planes and sensors would be elsewhere"
        )
    if not (trials.weights != trials.weights[0]).any():
        raise ValueError(
            "these runs say nothing of the rotor: no weights change between them; runs with a trial weight "
            "are needed"
        )
    return places.of_runs(trials, job.key_phasor)
