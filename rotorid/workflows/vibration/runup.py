"""`runup`: Bode and polar plots, slow roll, critical speeds and damping of a machine that speeds up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from rotorid.base.suggestions import did_you_mean
from rotorid.base.text import listing
from rotorid.commands.input_checks import file_of
from rotorid.commands.outcome import command, provenance
from rotorid.commands.outcome import phase as timed
from rotorid.commands.quantities import Band, Names, Speeds, band, names, number, one_of, one_speed
from rotorid.commands.quantities import speeds as read_speeds
from rotorid.workflows.vibration.runup_result import RunUp, SlowRollVectors

if TYPE_CHECKING:
    from rotorid.harmonic.modal.run_up import SweepModes, SweepVectors

TABLES = (".csv", ".xlsx", ".txt")
Phase = Literal["lead", "lag"]
"""Whether positive phases lead or lag."""


@dataclass(frozen=True)
class RunUpOptions:
    """Options of `runup`; speeds without a unit are in that of the table.

    Attributes
    ----------
    phase
        What a positive phase is; default: lead, and that is said.
    run : NAME
        Whose modes are fitted, where there are several runs; all are drawn.
    sensors : LIST
        Only these.
    tacho : NAME
        Of a record: channel of the tacho, where no waveforms file says.
    unit : UNIT
        Of a record: of its numbers, um, mm_s, g, likewise.
    acceleration : A
        Where the table has no times: 50rpm/s, or -50rpm/s down; 0: the speed is held for each vector.
    bands : LIST
        Around each critical speed, one mode in each and nothing else counts: 700:1200,2000:3000; default:
        around each peak.
    slow_roll : SPEED|FILE
        Run-out is the mean at or below this speed, or a runs table of one run; default: fit, what no speed
        changes.
    speeds : SPEEDS
        Of --save-runs: 900,1500 or 600:3000:300.
    """

    phase: Phase | None = None
    run: str | None = None
    sensors: Names | None = None
    tacho: str | None = None
    unit: str | None = None
    acceleration: str | float | None = None
    bands: str | Sequence[Band] | None = None
    slow_roll: str | float | Path = "fit"
    speeds: Speeds | None = None


@command
def runup(data: Path | str | Sequence[SweepVectors], options: RunUpOptions | None = None) -> RunUp:
    """Fit critical speeds and damping to vectors of a run-up or run-down, the acceleration in the model.

    Parameters
    ----------
    data
        A table of vectors over speed, a record or waveforms file (.toml), or vectors.
    options
        What differs from the defaults.

    Raises
    ------
    ValueError
        For a table or an option that cannot be.
    """
    from rotorid.harmonic.modal.run_up import fit_sweep

    options = options or RunUpOptions()
    files: list[Path] = []
    assumed = options.phase is None and isinstance(data, Path | str)
    if isinstance(data, Path | str):
        file = file_of(data, "a table of vectors, or a record")
        recorded = file.suffix.lower() not in TABLES or options.tacho is not None
        data, read = (_of_records if recorded else _of_table)(file, options)
        files, assumed = [*read], assumed and not recorded
    sweeps = _ordered(data, options)
    labels = sweeps[0].labels
    given = options.bands.split(",") if isinstance(options.bands, str) else options.bands or []
    bands = [found for each in given if (found := band(each, "--bands", labels.speed_unit)) is not None]
    speeds = None
    if options.speeds is not None:
        import numpy as np

        speeds = np.unique(read_speeds(options.speeds, labels.speed_unit))
    sweeps = [_timed(sweep, options.acceleration) for sweep in sweeps]
    steady = _rate(options.acceleration) == 0.0
    modes: SweepModes | None = None
    why = ""
    with timed("modes"):
        try:
            modes = fit_sweep(sweeps[0], steady=steady, bands=bands or None)
        except ValueError as error:
            why = str(error)
    roll = _slow_roll(sweeps[0], modes, options.slow_roll, files)
    return RunUp(
        sweeps=tuple(sweeps),
        modes=modes,
        why=why,
        roll=roll,
        steady=steady,
        assumed=assumed,
        bands=tuple(bands),
        speeds=speeds,
        provenance=provenance(files, options),
    )


def _of_table(file: Path, options: RunUpOptions) -> tuple[tuple[SweepVectors, ...], Sequence[Path]]:
    """Vectors of each run in a table, and the files that were read."""
    from rotorid.tables.runs.vectors_table import read_vectors

    one_of(options.phase or "lead", "--phase", get_args(Phase))
    return read_vectors(file, options.phase or "lead"), (file,)


def _of_records(file: Path, options: RunUpOptions) -> tuple[tuple[SweepVectors, ...], Sequence[Path]]:
    """The same of a record, or of those of a waveforms file."""
    from rotorid.tables.reader.problems import Problems
    from rotorid.tables.runs.vectors_table import read_vectors
    from rotorid.tables.waveforms.vectors_of_records import read_vectors_grid
    from rotorid.tables.waveforms.waveforms import WaveformWishes

    given = WaveformWishes(
        tacho=options.tacho, sensors=names(options.sensors), unit=options.unit, phase=options.phase
    )
    problems = Problems()
    grid, phase, read = problems.need(read_vectors_grid(file, None, problems, given, moving=True))
    return read_vectors(grid, phase), read


def _ordered(sweeps: Sequence[SweepVectors], options: RunUpOptions) -> list[SweepVectors]:
    """The run whose modes are fitted, then the others, of the sensors asked for."""
    runs = [sweep.run for sweep in sweeps]
    if options.run is None and len(runs) > 1:
        raise ValueError(f"there are {len(runs)} runs: say with --run whose modes to fit, {listing(runs)}")
    first = runs[0] if options.run is None else options.run
    if first not in runs:
        hint = did_you_mean(first, runs)
        raise ValueError(f"--run: there is no run {first!r}{hint}; there are {listing(runs, 'and')}")
    own = sweeps[runs.index(first)]
    wanted = names(options.sensors) or list(own.sensors)
    for name in wanted:
        if name not in own.sensors:
            hint = did_you_mean(name, own.sensors)
            known = listing(own.sensors, "and")
            raise ValueError(f"--sensors: run {first!r} has no sensor {name!r}{hint}; it has {known}")
    found = []
    for sweep in (own, *(sweep for sweep in sweeps if sweep is not own)):
        there = [name for name in wanted if name in sweep.sensors]
        columns = [sweep.sensors.index(name) for name in there]
        stated = None if sweep.covariances is None else sweep.covariances[:, columns]
        found.append(
            replace(sweep, sensors=tuple(there), vectors=sweep.vectors[:, columns], covariances=stated)
        )
    return [sweep for sweep in found if sweep.sensors]


def _rate(given: str | float | None) -> float | None:
    """Read "-50rpm/s", rad/s²."""
    if given is None or not isinstance(given, str):
        return given
    text = given.strip()
    size = text.lstrip("+-").removesuffix("/s")
    if text.lstrip("+-") == size and number(size) != 0:
        raise ValueError(f"--acceleration {given!r}: a speed a second is needed, such as 50rpm/s, or 0")
    return (-1.0 if text.startswith("-") else 1.0) * one_speed(size, "--acceleration")


def _timed(sweep: SweepVectors, given: str | float | None) -> SweepVectors:
    """The same with the times that a constant acceleration makes, by rising time."""
    rate = _rate(given)
    if not rate:
        return sweep
    if sweep.time is not None:
        raise ValueError(
            "--acceleration: the table has times, which tell it; only 0, held speeds, can be said"
        )
    passed = sweep.speeds / rate
    order = passed.argsort()
    return replace(sweep.take(order), time=passed[order] - passed[order[0]])


def _slow_roll(
    sweep: SweepVectors, modes: SweepModes | None, given: str | float | Path, files: list[Path]
) -> SlowRollVectors:
    """Run-out: of the fit, the mean at slow speeds, or of a file."""
    from rotorid.harmonic.modal.run_up import constant_vectors, slow_vectors
    from rotorid.tables.runs.vectors_table import read_slow_roll

    if isinstance(given, str) and given == "fit":
        if modes is None or modes.fit.undetermined:
            return SlowRollVectors(None, None, "unknown: there is no fit to tell it (--slow-roll SPEED does)")
        words = "of the fit: what no speed changes, modes far below the sweep included"
        return SlowRollVectors(*constant_vectors(modes.fit), words)
    if isinstance(given, Path) or (isinstance(given, str) and Path(given).suffix.lower() in TABLES):
        file = file_of(given, "a runs table of one run at slow speed")
        files.append(file)
        vectors, said = read_slow_roll(file, sweep)
        return SlowRollVectors(vectors, None, f"of {file.name}", said)
    wanted = given if isinstance(given, str) else [float(given)]
    (speed,) = read_speeds(wanted, sweep.labels.speed_unit, "--slow-roll")
    words = f"mean of the vectors at or below {sweep.labels.speed_words(speed)}"
    return SlowRollVectors(*slow_vectors(sweep, speed), words)
