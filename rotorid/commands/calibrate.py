"""`calibrate`: numbers of a rotor file from trial runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rotorid.base.answer import COLUMNS, Answer, Answered
from rotorid.base.json import plain
from rotorid.base.result import Column, frame, rows, text
from rotorid.base.rpm import range_text
from rotorid.base.text import capital, counted, error_figures
from rotorid.commands.quantities import Names, Nodes, nodes
from rotorid.report.options import file_of, rotor_source
from rotorid.report.outcome import Outcome, command, outcome_of, provenance

if TYPE_CHECKING:
    import pandas as pd

    from fem import Rotor
    from rotorid.base.arrays import BoolArray
    from rotorid.calibration import CalibratedRotor, RunReadings, Unknown
    from rotorid.regression.estimate import Uncertain


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
    to: ClassVar[Sequence[str]] = ("output", "table", "json")


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibrated(Answered):
    """The calibrated rotor."""

    found: CalibratedRotor

    @property
    def answer(self) -> Answer:
        """Whether the model explains the data; the wished numbers; what the data do not tell."""
        from rotorid.regression.estimate import parameter_text

        found = self.found
        fits = "explains" if found.explained else "does NOT explain"
        chi = f"χ² {found.chi_square:.4g} with {counted(found.dof, 'degree')} of freedom"
        first = [f"The model {fits} the data ({chi})."]
        speeds = [speed for data in found.readings for speed in data.trials.speeds.tolist()]
        if seen := found.seen:
            at = f"at {range_text(min(speeds), max(speeds))} " if speeds else ""
            first.append(capital(f"{at}{seen}."))
        why = {} if found.prior is None else found.prior.why
        beside = ~found.wished
        tables = [parameter_text(*self._part(which), why) for which in (~beside, beside) if which.any()]
        if found.bare:
            tables.append(text(self._unbalance(), width=COLUMNS))
        more = "what else is not known exactly" if beside.any() else "unbalance"
        notes = []
        if found.searches > 1:
            notes.append(f"searched from {found.searches} starting values")
        if found.exact:
            exact = counted(len(found.exact), "number")
            notes.append(f"± count what {exact} taken as exact may be off")
        return Answer(
            "\n".join(first),
            tables[0],
            found.warnings,
            tuple(notes),
            tables=tuple(tables[1:]),
            more=more if tables[1:] else "",
        )

    def to_frame(self) -> pd.DataFrame:
        """One row per number: value, standard deviation, 95 % interval, share of the data."""
        from rotorid.regression.estimate import parameter_columns

        every = parameter_columns(*self._part(self.found.wished | True))
        return frame((*every, Column("data_share", self.found.data_share)))

    def to_dict(self) -> dict[str, Any]:
        """As JSON types, without the provenance; None where not determined."""
        import numpy as np

        from rotorid.regression.estimate import parameter_dict

        found, estimate = self.found, self.found.fit.estimate
        names, every = self._part(found.wished | True)
        parameters = parameter_dict(names, every)
        for name, unknown, share in zip(names, found.unknowns, found.data_share, strict=True):
            parameters[name] |= {"path": unknown.path, "prior": unknown.prior, "data_share": share}
        return plain(
            {
                "parameters": parameters,
                "rank": estimate.rank,
                "condition_number": estimate.condition_number,
                "identifiable": estimate.full_rank,
                "unidentifiable": [] if estimate.full_rank else [estimate.describe_rank()],
                "combinations": {c.words: {"value": c.value, "std": c.std} for c in estimate.combinations},
                "correlation": every.correlation,
                "seen": found.seen or None,
                "residual_rms": np.sqrt(np.mean(estimate.residuals**2)),
                "chi_square": found.chi_square,
                "degrees_of_freedom": found.dof,
                "probability": found.chance,
                "exact": found.exact,
                "explained": found.explained,
                "lack_of_fit": found.lack_of_fit,
                "unbalance": rows(self._unbalance()) if found.bare else [],
                "warnings": found.warnings,
                "rotor": None,
            }
        )

    def rotor_files(self, path: Path) -> Mapping[Path, bytes]:
        """The calibrated rotor as a rotor file, with its tables.

        Raises
        ------
        ValueError
            For numbers that the data do not determine.
        """
        from rotorid.files.rotor_writing import rotor_file_bytes

        if why := self.found.undetermined:
            raise ValueError(f"{path}: no rotor file can be written, {why}")
        return rotor_file_bytes(path, self.found.rotor)

    def _part(self, which: BoolArray) -> tuple[tuple[str, ...], Uncertain]:
        """Names of some of the numbers, and these with their errors."""
        import numpy as np

        from rotorid.regression.estimate import Uncertain

        found, part = self.found, Uncertain()
        part.values, part.errors_stated, part.dof = found.values[which], True, 0
        part.covariance = np.where(np.isnan(found.std), np.nan, found.covariance)[np.ix_(which, which)]
        return tuple(name for name, taken in zip(found.names, which, strict=True) if taken), part

    def _unbalance(self) -> tuple[Column, ...]:
        """What the bare rotor's readings say of its unbalances and bows."""
        import numpy as np

        names, values = self.found.bare, np.concatenate(self.found.unbalance)
        return (
            Column("unbalance", names, str),
            Column("size", np.abs(values), "{:.4g}".format),
            Column("std", np.concatenate(self.found.unbalance_std), error_figures, "±"),
            Column("unit", ["m" if name.startswith("bow") else "kg·m" for name in names], str),
            Column("angle_deg", np.degrees(np.angle(values)) % 360, "{:.1f}".format, "angle, °"),
        )


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
    from rotorid.commands.unknown_numbers import unknowns

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
    calibrated = Calibrated(found=result)
    made = outcome_of(calibrated, origin, files={".toml": calibrated.rotor_files})
    return replace(made, result=result)


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
    readings, read = read_data(sources, model, places, options.bow)
    without = Prepared(model, [], readings, files, read)
    numbers = unknowns(
        model, without.probes, options.estimate, options.prior, options.bounds, exact=options.exact
    )
    return without._replace(numbers=numbers)
