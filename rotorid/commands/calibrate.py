"""`calibrate`: numbers of a rotor file from trial runs, critical speeds and modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from rotorid.commands.quantities import Names, Nodes, nodes
from rotorid.report.options import file_of, rotor_source
from rotorid.report.outcome import USUAL, Outcome, command, outcome_of, provenance

if TYPE_CHECKING:
    from fem import Rotor
    from rotorid.calibration import MeasuredFrequencies, RunReadings, Unknown


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
        Modulus (1 %), discs (1 %), pedestals (10 %) and angles of probes (2°) are not estimated; ± count that
        they may be off by so much. Else they are unknown, too, with these standard deviations.
    unbalance_at : LIST
        Nodes where the rotor's own unbalance may stand: the readings of the bare rotor count, too.
    bow : N
        Shapes of an unknown bow, modes of the free shaft; with --unbalance-at.
    """

    estimate: Names
    prior: str | Mapping[str, str] = ""
    bounds: str | Mapping[str, str] = ""
    exact: bool = False
    unbalance_at: Nodes | None = None
    bow: int = 0
    outputs: ClassVar[Sequence[str]] = (".csv", ".xlsx", ".toml")
    to: ClassVar[Sequence[str]] = USUAL


class Prepared(NamedTuple):
    """What is calibrated: the rotor, unknown numbers, data; files of both; what was assumed."""

    rotor: Rotor
    numbers: list[Unknown]
    readings: list[RunReadings]
    frequencies: list[MeasuredFrequencies]
    rotor_files: tuple[Path, ...]
    data_files: list[Path]
    assumed: list[str]

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
        Jobs with trial runs (.toml, .xlsx), tables of critical speeds, frequencies or modes.
    options
        What is unknown, and what is known of it.

    Raises
    ------
    ValueError
        For files or options that cannot be, and for data that say nothing of the rotor.
    """
    from rotorid import calibration
    from rotorid.calibration.plots import calibration_figure
    from rotorid.commands.unknown_numbers import unknowns

    given = prepared(rotor, data, options)
    origin = provenance([*given.rotor_files, *given.data_files], options)
    paths = {number.path for number in given.numbers}
    beside = unknowns(given.rotor, given.probes, options.estimate, exact=False) if options.exact else []
    exact = [number for number in beside if number.path not in paths]
    result = calibration.calibrate(*given[:4], exact=exact)
    of_rotor = {one["sha256"] for one in origin["inputs"][: len(given.rotor_files)]}  # which jobs name, too
    made_from = [one for one in origin["inputs"] if one["sha256"] not in of_rotor]
    hashes = {Path(one["file"]).name: one["sha256"] for one in made_from}
    numbers = replace(result.rotor.calibration, data=hashes)  # type: ignore[type-var]
    result = replace(result, rotor=replace(result.rotor, calibration=numbers))

    def rotor_file(path: Path) -> Mapping[Path, bytes]:
        from rotorid.tables.rotor.rotor_writing import rotor_file_bytes

        if why := result.undetermined:
            raise ValueError(f"{path}: no rotor file can be written, {why}")
        return rotor_file_bytes(path, result.rotor)

    return outcome_of(
        result,
        origin,
        notes=(*result.answer.notes, *given.assumed),
        keys=lambda: {**result.to_dict(), "rotor": None},
        files={".toml": rotor_file},
        pictures={"The numbers, with what was known of them.": lambda: calibration_figure(result)},
        title="Calibration",
    )


def prepared(
    rotor: Rotor | Path | str, data: Sequence[Path | str] | Path | str, options: CalibrateOptions
) -> Prepared:
    """Read what is calibrated.

    Raises
    ------
    ValueError
        As `calibrate`.
    """
    from rotorid.commands.calibration_data import read_data
    from rotorid.commands.unknown_numbers import unknowns

    model, files = rotor_source(rotor)
    given = [data] if isinstance(data, Path | str) else list(data)
    if len({*map(str, given)}) < len(given):
        raise ValueError("one of the data files is given twice: it would count twice")
    named = [] if options.unbalance_at is None else nodes(options.unbalance_at, "--unbalance-at")
    places = [model.node(node) for node in named]
    if len({*places}) < len(places):
        raise ValueError("--unbalance-at: one of its nodes stands twice")
    if options.bow < 0:
        raise ValueError("--bow takes a number from 0")
    if options.bow and not places:
        raise ValueError("--bow counts beside unbalance: name the nodes where that may be, --unbalance-at")
    sources = [file_of(file, "data") for file in given]
    readings, frequencies, read, assumed = read_data(sources, model, places, options.bow)
    without = Prepared(model, [], readings, frequencies, files, read, assumed)
    numbers = unknowns(
        model, without.probes, options.estimate, options.prior, options.bounds, exact=options.exact
    )
    return without._replace(numbers=numbers)
