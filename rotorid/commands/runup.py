"""`runup`: Bode and polar plots, slow roll, critical speeds and damping of a machine that speeds up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from rotorid.base.json import plain
from rotorid.base.tables import Column, Table
from rotorid.base.text import RPM, counted, error_figures, figures, listing
from rotorid.commands.modes import bands, frequencies
from rotorid.commands.option_values import Band, acceleration, one_of
from rotorid.report.options import file_of
from rotorid.report.outcome import USUAL, Outcome, command, provenance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from rotorid.base.arrays import ComplexArray, FloatArray
    from rotorid.identify.modes_result import FittedModes, Readings

FEW_TURNS = 10.0
"""In the half-power band of a mode: vectors, means over turns, flatten one that is passed within fewer."""
TABLES = (".csv", ".xlsx", ".txt")
Phase = Literal["lead", "lag"]


@dataclass(frozen=True)
class RunUpOptions:
    """Options of `runup`; speeds without a unit are in that of the table.

    Attributes
    ----------
    phase
        What a positive phase is; default: lead, and that is said.
    tacho : NAME
        Of a record: channel of the tacho, where no waveforms file says.
    unit : UNIT
        Of a record: of its numbers, um, mm_s, g, likewise.
    acceleration : A
        Where the table has no times: 50rpm/s, or -50rpm/s down; 0: the speed is held for each vector.
    bands : LIST
        Around each critical speed, one mode in each: 700:1200,2000:3000; default: around each peak.
    """

    phase: Phase | None = None
    tacho: str | None = None
    unit: str | None = None
    acceleration: str | float | None = None
    bands: str | Sequence[Band] | None = None
    to = USUAL


@command
def runup(data: Path | str | Sequence[Readings], options: RunUpOptions | None = None) -> Outcome:
    """Critical speeds and damping of a run-up, its acceleration in the model, with ±.

    The table of modes (--output) is for `reduce --measured` and `calibrate`, if sensors are named as nodes or
    stations of the rotor.

    Example: rotorid runup sample_data/waveforms/run_up.wav --tacho 1 --unit um --phase lag --plot bode.png

    Parameters
    ----------
    data : RECORD|VECTORS
        A record, .wav, .mat, .npz, or .csv with --tacho; a waveforms file (.toml); or a runs
        table with time_s, .csv or .xlsx: what `vectors` writes.
    options
        What differs from the defaults.

    Raises
    ------
    ValueError
        For a table or an option that cannot be.
    """
    from rotorid.identify.modes import constant_vectors, fit_sweep

    options = options or RunUpOptions()
    files: Sequence[Path] = ()
    notes = []
    if isinstance(data, Path | str):
        file = file_of(data, "a table of vectors, or a record")
        recorded = file.suffix.lower() not in TABLES or options.tacho is not None
        data, files = _read(file, options, recorded)
        if options.phase is None and not recorded:
            notes.append("nobody says whether phases lead or lag: lead is assumed (--phase)")
    if len(data) > 1:
        raise ValueError(f"one run is needed, not {len(data)}: {listing(sweep.run for sweep in data)}")
    rate = None if options.acceleration is None else acceleration(options.acceleration, "--acceleration")
    sweep = _timed(data[0], rate)
    around = bands(options.bands, sweep.labels.speed_unit)
    modes, why = None, ""
    try:
        modes = fit_sweep(sweep, steady=rate == 0.0, bands=around or None)
    except ValueError as error:
        why = str(error)
    turned = _turned(sweep, modes) if modes else ()
    doubts = (*turned, *modes.undetermined) if modes else (why,)
    fit = None if doubts else modes
    roll, slow = None, None
    if modes and not modes.undetermined:
        roll, std = constant_vectors(modes)
        slow = _roll_table(sweep, roll, std)
    mean, time = 0.0 if rate == 0.0 else None, sweep.time
    if mean is None and time is not None and len(time) > 1:
        mean = float((sweep.speeds[-1] - sweep.speeds[0]) / (time[-1] - time[0]))
    steady, estimate = (modes.steady, modes.fit.estimate) if modes else (None, None)
    warnings = (*turned, *modes.warnings) if modes else (f"no modes: {why}",)
    warnings = (*warnings, *(_hasty(fit) if fit else ()))
    document = {
        "run": sweep.run,
        "phase": sweep.labels.phase,
        "modes": _modes(fit, steady) if fit else [],
        "slow_roll": slow.records if slow else [],
        "acceleration_rad_s2": mean,
        "chi_square": estimate and estimate.chi_square,
        "degrees_of_freedom": estimate and estimate.dof,
        "warnings": warnings,
    }
    return Outcome(
        result=modes,
        sentences=(_sentence(sweep.run, fit),),
        tables=(*([_table(fit, steady)] if fit else []), *([slow] if slow else [])),
        file=fit.file_table("critical_speed_rpm", RPM) if fit else f"there is no table of modes: {doubts[0]}",
        title="Run-up",
        keys=dict(plain(document)),
        pictures={"Vectors over speed, less the slow roll.": lambda: _figure(sweep, fit, roll)},
        warnings=warnings,
        notes=(*_course(mean), *notes, *(fit.notes if fit else ())),
        provenance=provenance(files, options),
    )


def _read(file: Path, options: RunUpOptions, recorded: bool) -> tuple[Sequence[Readings], Sequence[Path]]:
    """Vectors of each run in a table, or of records, and the files that were read."""
    from rotorid.files.runs import read_vectors
    from rotorid.files.waveform_jobs import read_vectors_grid

    if not recorded:
        return read_vectors(file, one_of(options.phase or "lead", "--phase", get_args(Phase))), (file,)
    given = {"tacho": options.tacho, "unit": options.unit, "phase": options.phase}
    grid, phase, read = read_vectors_grid(file, None, given, moving=True)
    return read_vectors(grid, phase), read


def _timed(sweep: Readings, rate: float | None) -> Readings:
    """The same with the times that a constant acceleration makes, by rising time."""
    if not rate:
        return sweep
    if sweep.time is not None:
        raise ValueError(
            "--acceleration: the table has times, which tell it; only 0, held speeds, can be said"
        )
    passed = sweep.speeds / rate
    order = passed.argsort()
    return replace(sweep.take(order), time=passed[order] - passed[order[0]])


def _turned(sweep: Readings, modes: FittedModes) -> tuple[str, ...]:
    """That modes explain phases of the other sign: as they are, the damping is negative."""
    _, zeta, _, error = (modes.steady or modes).values
    if modes.explains or not (zeta + 2 * error < 0).all():
        return ()
    sign = "lag" if sweep.labels.phase == "lead" else "lead"
    return (f"phases are read as {sweep.labels.phase}s; modes explain them as {sign}s (--phase {sign})",)


def _hasty(fit: FittedModes) -> list[str]:
    """Say which modes are passed so fast that vectors flatten them: their ± may hold in half of the cases."""
    import numpy as np

    from rotorid.identify.answers import SweptAnswers

    if not isinstance(fit.answers, SweptAnswers):
        return []
    omega, zeta = fit.values[:2]
    rate = abs(fit.answers.speed.derivative()(fit.answers.at(omega).time))
    turns = zeta * omega**2 / np.pi / np.maximum(rate, 1e-12)  # 2ζω / rate seconds of ω / 2π turns
    return [
        f"mode {mode + 1} is passed within {turns[mode]:.2g} turns of its half-power band: vectors, means "
        "over turns, flatten it, and ± of its damping are too small; let the speed change more slowly"
        for mode in np.flatnonzero(turns < FEW_TURNS)
    ]


def _table(fit: FittedModes, steady: FittedModes | None) -> Table:
    """A row a mode: with the acceleration, and as a steady fit has it."""
    columns = frequencies(fit, "critical rpm", RPM)
    if steady is not None:
        held = frequencies(steady, "steady fit: rpm", RPM)
        columns = (*columns, held[1], replace(held[3], heading="ζ, % "))
    return Table("critical speeds", columns)


def _roll_table(sweep: Readings, vectors: ComplexArray, std: FloatArray) -> Table:
    """A row a sensor: what no speed changes, run-out and modes far below the sweep."""
    labels = sweep.labels
    unit = f"_{labels.vibration_unit}" if labels.vibration_unit else ""
    size, angle = labels.vibration(vectors)
    columns = (
        Column("sensor", sweep.sensors),
        Column(f"amplitude{unit}", size, figures, title=f"slow roll, {labels.vibration_in}".rstrip(", ")),
        Column(f"std{unit}", labels.vibration_scale * std, error_figures, title="±"),
        Column("phase_deg", angle, "{:.1f}".format, title=f"phase ({labels.phase}), °"),
    )
    return Table("slow roll", columns)


def _modes(fit: FittedModes, steady: FittedModes | None) -> list[dict[str, Any]]:
    """Of the document."""
    names = ("frequency_rad_s", "damping_ratio")

    def named(values: FloatArray) -> dict[str, Any]:
        return dict(zip(names, values, strict=True))

    k, ci95 = len(fit.ends), fit.fit.ci95
    return [
        {
            "mode": r + 1,
            **named(fit.values[:2, r]),
            "critical_speed_rpm": RPM * fit.values[0, r],
            "std": named(fit.values[2:, r]),
            "ci95": dict.fromkeys(names) if ci95 is None else named(ci95[[r, k + r]]),
            "steady": None if steady is None else named(steady.values[:2, r]),
        }
        for r in range(k)
    ]


def _sentence(run: str, fit: FittedModes | None) -> str:
    """How many critical speeds, and where."""
    if fit is None:
        return f"Run {run}: no critical speed is determined."
    speeds = [f"{RPM * omega:.0f}" for omega in fit.values[0]]
    return f"Run {run}: {counted(len(speeds), 'critical speed')}, {listing(speeds, 'and')} rpm."


def _course(rate: float | None) -> list[str]:
    """What the acceleration means for the result."""
    if rate is None:
        return [
            "nobody says how fast the speed changes (a column time_s, or --acceleration): the fit is of held "
            "speeds, and a sweep shifts it"
        ]
    return [
        f"the speed changes by {RPM * rate:.4g} rpm a second; critical: where the phase of the mode has "
        "turned by 90° when the speed is held"
    ] * bool(rate)


def _figure(sweep: Readings, fit: FittedModes | None, roll: ComplexArray | None) -> Figure:
    """Amplitude and phase over speed, less the slow roll."""
    import numpy as np

    from rotorid.identify.plots import bode_plot

    return bode_plot(sweep, np.zeros(len(sweep.sensors), dtype=complex) if roll is None else roll, fit)
