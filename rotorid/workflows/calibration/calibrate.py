"""`calibrate`: numbers of a rotor file from trial runs, critical speeds and modes, or how to measure them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rotorid.base.answer import Answer
from rotorid.commands.input_checks import file_of, rotor_source
from rotorid.commands.outcome import Found, command, log_rotor, phase, provenance
from rotorid.commands.quantities import Names, Nodes, Speeds, nodes, rising_speeds

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fem import Rotor
    from rotorid.calibration import MeasuredFrequencies, RunReadings, Unknown

    DataFiles = Path | str | Sequence[Path | str]
    """Jobs, tables of critical speeds or natural frequencies, tables of modes."""


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
    bounds : LIST
        Lowest and largest value: bearing[1].kxx=1e6:1e9.
    exact
        Modulus (1 %), discs (1 %), pedestals (10 %) and angles of probes (2°) are as the files say; else they
        are unknown, too, with these standard deviations.
    unbalance_at : LIST
        Nodes where the rotor's own unbalance may stand: the readings of the bare rotor count, too.
    bow : N
        Shapes of an unknown bow, modes of the free shaft; with --unbalance-at.
    starts : N
        Searches from different starting values.
    design : N
        Instead of estimating: the N trial runs, of all planes and speeds, that would tell most.
    speeds : A:B:STEP
        Candidates for --design; default: those of the job.
    """

    estimate: Names
    prior: str | Mapping[str, str] = ""
    bounds: str | Mapping[str, str] = ""
    exact: bool = False
    unbalance_at: Nodes | None = None
    bow: int = 0
    starts: int = 3
    design: int | None = None
    speeds: Speeds | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibrated(Found):
    """The calibrated rotor, or a design; what was assumed of the data."""

    assumed: tuple[str, ...] = ()
    written: Path | None = None

    @property
    def answer(self) -> Answer:
        """With what was assumed."""
        own: Answer = self.found.answer
        return replace(own, notes=(*own.notes, *self.assumed))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, with the rotor file that is written."""
        found = super().to_dict()
        return {**found, "rotor": self.written and str(self.written)} if "explained" in found else found

    def files(self, path: Path) -> Mapping[Path, bytes]:
        """The calibrated rotor as a rotor file, .toml, with its tables; or the table of numbers.

        Raises
        ------
        ValueError
            For a rotor file of a design, or of numbers that were not found.
        """
        from rotorid.tables.reader.table_writing import table_bytes
        from rotorid.tables.rotor.rotor_writing import rotor_file_bytes

        if path.suffix.lower() != ".toml":
            return {path: table_bytes(path, self.to_frame())}
        if not hasattr(self.found, "rotor"):
            raise ValueError(f"{path}: --design finds no rotor; a table of the runs is .csv or .xlsx")
        if why := self.found.not_found:
            raise ValueError(f"{path}: no rotor file can be written, {why}")
        return rotor_file_bytes(path, self.found.rotor)

    def figure(self) -> Figure:
        """Measured and computed effects of the trial weights, and the numbers with what was known of them."""
        from rotorid.calibration.calibration_picture import calibration_figure

        if not hasattr(self.found, "rotor"):
            raise ValueError("--design has no picture")
        return calibration_figure(self.found)


@command
def calibrate(rotor: Rotor | Path | str, data: DataFiles, options: CalibrateOptions) -> Calibrated:
    """Estimate numbers of a rotor from data of any mixture, with errors, and what the data do not determine.

    Parameters
    ----------
    rotor
        As it is believed to be: a rotor, or its file.
    data
        Jobs with trial runs (or with readings of the bare rotor), tables of critical speeds, natural
        frequencies or modes.
    options
        What is unknown, and how to search.

    Raises
    ------
    ValueError
        For files or options that cannot be, and for data that say nothing of the rotor.
    """
    from rotorid import calibration
    from rotorid.workflows.calibration.unknown_options import unknowns

    model, numbers, readings, frequencies, files, read, assumed = prepared(rotor, data, options)
    probes = probes_of(readings)
    log_rotor(model, unknowns=len(numbers))
    told = provenance([*files, *read], options)
    if options.design is not None:
        from rotorid.workflows.calibration.calibration_design import design

        wished = [u.path for u in unknowns(model, probes, options.estimate, "", "", exact=True)]
        runs = _candidates(readings, options.speeds)
        return Calibrated(found=design(model, numbers, wished, runs, options.design), provenance=told)
    if options.speeds is not None:
        raise ValueError("--speeds are candidates for --design: the data have their own")
    paths = {number.path for number in numbers}
    beside = unknowns(model, probes, options.estimate, "", "", exact=False) if options.exact else []
    held = [number for number in beside if number.path not in paths]
    with phase("calibration"):
        found = calibration.calibrate(model, numbers, readings, frequencies, held=held, starts=options.starts)
    of_rotor = {one["sha256"] for one in told["inputs"][: len(files)]}  # which jobs name, too
    made_from = [one for one in told["inputs"] if one["sha256"] not in of_rotor]
    hashes = {Path(one["file"]).name: one["sha256"] for one in made_from}
    known = replace(found.rotor.calibration, data=hashes)  # type: ignore[type-var]
    found = replace(found, rotor=replace(found.rotor, calibration=known))
    return Calibrated(found=found, assumed=tuple(assumed), provenance=told)


class Prepared(NamedTuple):
    """What is calibrated: the rotor, unknown numbers, data; files of both; what was assumed."""

    rotor: Rotor
    numbers: list[Unknown]
    readings: list[RunReadings]
    frequencies: list[MeasuredFrequencies]
    rotor_files: tuple[Path, ...]
    data_files: list[Path]
    assumed: list[str]


def prepared(rotor: Rotor | Path | str, data: DataFiles, options: CalibrateOptions) -> Prepared:
    """Read what is calibrated.

    Raises
    ------
    ValueError
        As `calibrate`.
    """
    from rotorid.workflows.calibration.calibration_data import read_data
    from rotorid.workflows.calibration.unknown_options import unknowns

    model, files = rotor_source(rotor)
    given = [data] if isinstance(data, Path | str) else list(data)
    if len({*map(str, given)}) < len(given):
        raise ValueError("one of the data files is given twice: it would count twice")
    places = [] if options.unbalance_at is None else nodes(options.unbalance_at, "--unbalance-at")
    own = [model.node(node) for node in places]
    if len({*own}) < len(own):
        raise ValueError("--unbalance-at: one of its nodes stands twice")
    if options.bow < 0 or options.starts < 1:
        raise ValueError("--bow takes a number from 0, --starts one from 1")
    if options.bow and not own:
        raise ValueError("--bow counts beside unbalance: name the nodes where that may be, --unbalance-at")
    readings, frequencies, read, assumed = read_data(
        [file_of(file, "data") for file in given],
        model,
        own,
        options.bow,
        candidates=options.design is not None,
    )
    numbers = unknowns(
        model, probes_of(readings), options.estimate, options.prior, options.bounds, exact=options.exact
    )
    return Prepared(model, numbers, readings, frequencies, files, read, assumed)


def probes_of(readings: Sequence[RunReadings]) -> list[str]:
    """Names of all sensors, each once."""
    return list(dict.fromkeys(sensor for each in readings for sensor in each.trials.sensors))


def _candidates(readings: Sequence[RunReadings], speeds: Speeds | None) -> RunReadings:
    """The places of one job at the speeds in question."""
    import numpy as np

    if len(readings) != 1:
        raise ValueError("--design needs one job: its planes, sensors and errors")
    (one,) = readings
    if speeds is None:
        return one
    omega = np.array(rising_speeds(speeds))
    trials = one.trials
    blank = np.ones((1, omega.size, len(trials.sensors)), dtype=complex)
    bare = replace(
        trials,
        runs=("bare",),
        speeds=omega,
        readings=blank,
        weights=np.zeros((1, len(trials.planes)), dtype=complex),
        steps=None,
        covariance=None,
    )
    return replace(one, trials=bare)
