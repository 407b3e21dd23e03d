"""Options of `balance`, and which of them go together."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.commands.coefficients import KINDS
from rotorid.commands.quantities import Names, Speeds, one_of
from rotorid.report.options import check_choices
from rotorid.report.outcome import EQUATIONS, WITH_REPORT

if TYPE_CHECKING:
    from rotorid.base.registry import Method
    from rotorid.commands.option_quantities import Amount, Amplitudes, Positions, Weights


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
        How the readings count; default: weighted where their errors are known, else least-squares.
    influence : FILE
        Stored influence coefficients, in place of trial runs.
    waveforms : FILE
        A waveforms file (.toml) of the runs, in place of the runs table.
    coefficients : KIND
        measured, computed, combined: from the runs, from the job's rotor, or both; default: measured where
        there are trial weights.
    machine_type : --type FLEET:TYPE
        Coefficients of the machine's type, from a store of `rotorid fleet`; a baseline is enough.
    model_error : PERCENT from 0
        Standard deviation of computed coefficients; combined: 20 if not given.
    amplitude_error : PERCENT from 0
        Standard deviation of a reading's amplitude.
    phase_error : DEGREES from 0
        Standard deviation of a reading's phase.
    run_error : PERCENT from 0
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
        Small weights where planes act alike: 0.01 … 0.1.
    split
        Choose pieces in the holes of the job, all planes together: the fewest that keep the limits, or leave
        at most 1.2 times the least vibration or a fifth of the present one (a picture of discs).
    refine
        Add the job's check runs to its trial runs: coefficients and trim from all of them.
    best_planes : K from 1
        Use the best K planes, after comparing all choices.
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
    save_influence : FILE
        Write the coefficients, .csv or .xlsx.
    template : FILE.xlsx
        Write an empty workbook to fill in.
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
    ridge: float | None = None
    split: bool = False
    refine: bool = False
    best_planes: int | None = None
    grade: str | None = None
    rotor_mass: Amount | None = None
    service_speed: Amount | None = None
    positions: Positions | None = None
    bearings: str | tuple[float, float] | None = None
    centre: Amount | None = None
    save_influence: Path | None = None
    template: Path | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Input and conventions": "phase angles amplitude_error phase_error run_error waveforms",
        "Method": "method planes speeds best_planes coefficients",
        "Limits": "max_mass limit",
        "Mounting": "split",
        "Machines of a type": "machine_type",
        "Check run": "refine",
        "Grade": "grade rotor_mass service_speed positions bearings centre",
        "Output": "save_influence template",
        "Expert": "influence model_error ridge",
    }
    to: ClassVar[Sequence[str]] = (*WITH_REPORT, *EQUATIONS)
    writes: ClassVar[Mapping[str, Sequence[str]]] = {"save_influence": (".csv", ".xlsx")}

    def before(self, job: Sequence[Path] | None) -> str | None:
        """Write the empty workbook where it is asked for, and say so.

        Raises
        ------
        ValueError
            Without a job; for a workbook beside one, a name that is no workbook's, and an existing file.
        """
        from rotorid.commands.app import check_targets
        from rotorid.tables.job.workbook_template import template_bytes
        from rotorid.tables.reader.table_writing import write_bytes

        if self.template is None:
            if not job:
                raise ValueError(
                    "give a job (.toml, .xlsx) or a runs table and a weights table; --template writes a form"
                )
            return None
        path = self.template
        if job:
            raise ValueError(
                "--template writes an empty workbook: leave the job away, or use --output for its own"
            )
        check_targets([(path, (".xlsx",))])
        if path.exists():
            raise ValueError(
                f"{path}: exists already, and may be filled in; choose another name or delete it"
            )
        write_bytes(path, template_bytes())
        return f"written: {path}\nFill it in (its sheet notes says how), then: rotorid balance {path}"


def check_options(options: BalanceOptions) -> None:
    """Refuse options that are not known or do not go together, before anything is read."""
    check_choices(options, choices())
    if options.coefficients is not None:
        one_of(options.coefficients, "--coefficients", KINDS)
    if options.machine_type is not None and (options.coefficients or options.influence):
        raise ValueError("--type has the coefficients: leave --coefficients and --influence away")
    if options.ridge is not None and not 0 < options.ridge < math.inf:
        raise ValueError(f"--ridge {options.ridge:g}: a strength above 0, such as 0.03")
    if options.split and options.ridge is not None:
        raise ValueError(
            "--split takes the planes as they are, and would undo --ridge: use fewer planes (--planes, "
            "--best-planes) instead"
        )
