"""Options of `balance`, and which of them go together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rotorid.commands.quantities import Names, Speeds
from rotorid.report.outcome import EQUATIONS, WITH_REPORT

if TYPE_CHECKING:
    from rotorid.base.registry import Method
    from rotorid.commands.option_quantities import Amount, Amplitudes, Weights


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
    amplitude_error : PERCENT from 0
        Standard deviation of a reading's amplitude.
    phase_error : DEGREES from 0
        Standard deviation of a reading's phase.
    phase : lead|lag
        What a positive phase means.
    angles : DIRECTION
        with rotation, against rotation; where the job states its rotation, clockwise or counter-clockwise.
    planes : LIST
        Use these planes only.
    speeds : LIST
        Use these speeds only, as in the runs, or 20Hz,25Hz.
    max_mass : MASS
        Largest weight of every plane, 5g; or left=5g,right=3g.
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
    save_influence : FILE
        Write the coefficients: .json keeps their errors; .csv or .xlsx.
    template : FILE.xlsx
        Write an empty workbook to fill in.
    """

    method: str | None = None
    influence: Path | str | None = None
    coefficients: str | None = None
    machine_type: str | None = None
    amplitude_error: float | None = None
    phase_error: float | None = None
    phase: str | None = None
    angles: str | None = None
    planes: Names | None = None
    speeds: Speeds | None = None
    max_mass: Weights | None = None
    limit: Amplitudes = ()
    ridge: float | None = None
    split: bool = False
    refine: bool = False
    grade: str | None = None
    rotor_mass: Amount | None = None
    service_speed: Amount | None = None
    save_influence: Path | None = None
    template: Path | None = None
    panels: ClassVar[Mapping[str, str]] = {
        "Input and conventions": "phase angles amplitude_error phase_error",
        "Method": "method planes speeds coefficients machine_type influence ridge",
        "Limits, mounting, check run": "max_mass limit split refine grade rotor_mass service_speed",
        "Output": "save_influence template",
    }
    to: ClassVar[Sequence[str]] = (*WITH_REPORT, *EQUATIONS)
    writes: ClassVar[Mapping[str, Sequence[str]]] = {"save_influence": (".json", ".csv", ".xlsx")}

    def before(self, job: Sequence[Path] | None) -> str | None:
        """Write the empty workbook where it is asked for, and say so.

        Raises
        ------
        ValueError
            Without a job; for a workbook beside one, a name that is no workbook's, and an existing file.
        """
        from rotorid.commands.app import check_targets
        from rotorid.files.job_excel import template_bytes
        from rotorid.files.table_writing import write_bytes

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
