"""One printed number beside what the program computes now: the row of the proof table."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any, Literal, cast

Status = Literal["agrees", "erratum", "consequence", "differs", "given"]
Kind = Literal["number", "bound", "selected", "given"]

AGREES: Status = "agrees"
ERRATUM: Status = "erratum"
CONSEQUENCE: Status = "consequence"
DIFFERS: Status = "differs"
GIVEN: Status = "given"

_NUMBER = re.compile(r"[+-]?(?:\d+(?P<decimals>\.\d*)?|(?P<bare>\.\d+))(?:[eE](?P<exponent>[+-]?\d+))?")


@dataclass(frozen=True)
class Row:
    """A printed number, the computed one, and what may lie between them.

    Attributes
    ----------
    source
        Where it is printed, such as ``"[S] task 9.1"``; rows of one source are one line of the summary.
    quantity
        What it is, with its unit.
    text
        The number as it is printed.
    computed
        The number as the program computes it now; not finite where that failed.
    tolerance
        The largest difference that still agrees, in the unit of the number.
    reason
        Why the tolerance is not half a unit of the last printed digit; empty where it is.
    erratum
        Why the printed number is wrong; empty where it is right.
    corrected
        The right number as text, for errata whose right number is known; the computed one must agree with it
        to half a unit of its last digit.
    kind
        ``number``; ``bound``: the print says that it is not exceeded; ``selected``: of a damaged print,
        intact as its agreement tells; ``given``: an input, which is computed from nothing and cannot fail.
    follows
        Source and quantity of the erratum that this one follows from; else empty.
    """

    source: str
    quantity: str
    text: str
    computed: float
    tolerance: float
    reason: str = ""
    erratum: str = ""
    corrected: str | None = None
    kind: Kind = "number"
    follows: str = ""

    @property
    def printed(self) -> float:
        """The printed number."""
        return number(self.text)

    @property
    def difference(self) -> float:
        """Computed minus printed; not finite where nothing was computed."""
        return self.computed - self.printed

    @property
    def misfit(self) -> float:
        """The difference as a part of its tolerance (agrees up to 1); of errata that from the correction."""
        if self.erratum and self.corrected is not None:
            return _parts(self.computed, number(self.corrected), half_unit(self.corrected))
        return self._from_print

    @property
    def _from_print(self) -> float:
        """The difference as a part of its tolerance; of a bound the computed number as a part of it."""
        if self.kind == "bound":
            return abs(self.computed / self.printed)
        return _parts(self.computed, self.printed, self.tolerance)

    @property
    def status(self) -> Status:
        """``agrees``, ``given``, ``differs``; ``erratum``, ``consequence``: wrong in print for a reason."""
        if not math.isfinite(self.computed):
            return DIFFERS
        near = self._from_print <= 1
        if not self.erratum:
            return DIFFERS if not near else GIVEN if self.kind == "given" else AGREES
        wrong = self.corrected is not None and self.misfit > 1
        return DIFFERS if near or wrong else CONSEQUENCE if self.follows else ERRATUM

    @property
    def note(self) -> str:
        """Why it is an erratum, why the tolerance is wide, and what is wrong with a row that differs."""
        parts = [self.erratum, f"follows from {self.follows}" if self.follows else "", self.reason]
        if self.status == DIFFERS and self.erratum and math.isfinite(self.computed):
            if self.corrected is not None and self.misfit > 1:
                parts.append(f"the corrected number is {self.corrected}, and the computed one is not that")
            else:
                parts.append("called an erratum, but the computed number agrees with the printed one")
        if not math.isfinite(self.computed):
            parts.append("nothing was computed")
        return "; ".join(part for part in parts if part)

    def to_dict(self) -> dict[str, Any]:
        """The row as numbers and texts; what is not finite is None."""
        known = math.isfinite(self.computed)
        return {
            "source": self.source,
            "quantity": self.quantity,
            "printed": self.printed,
            "printed_text": self.text,
            "computed": self.computed if known else None,
            "difference": self.difference if known else None,
            "tolerance": self.tolerance,
            "corrected": None if self.corrected is None else number(self.corrected),
            "status": self.status,
            "could_fail": self.kind != "given",
            "kind": self.kind,
            "follows": self.follows or None,
            "note": self.note,
        }


def row(
    source: str,
    quantity: str,
    printed: str,
    computed: float,
    tolerance: float | None = None,
    reason: str = "",
    erratum: str = "",
    corrected: str | None = None,
) -> Row:
    """Make a row of the fields of `Row`; without a `tolerance` it is half a unit of the last printed digit.

    Raises
    ------
    ValueError
        For a printed text that is no number.

    Examples
    --------
    >>> row("[S] task 7.2", "c1, N/m", "1.003e4", 10027.1).status
    'agrees'
    >>> row("[S] task 7.2", "c1, N/m", "1.003e4", 10036.0).status
    'differs'
    """
    chosen = half_unit(printed) if tolerance is None else float(tolerance)
    return Row(source, quantity, printed, float(computed), chosen, reason, erratum, corrected)


def number(text: str) -> float:
    """Read a printed number; a typographic minus counts as minus.

    Raises
    ------
    ValueError
        For a text that is no finite decimal number.
    """
    _match(text)
    value = float(text.replace("−", "-"))
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is no finite number")
    return value


def half_unit(text: str) -> float:
    """Half a unit of the last digit of a printed number.

    Examples
    --------
    >>> half_unit("135.2394"), half_unit("1.003e4"), half_unit("-42")
    (5e-05, 5.0, 0.5)
    """
    match = _match(text)
    decimals = len((match["decimals"] or match["bare"] or ".")[1:])
    return float(f"5e{int(match['exponent'] or 0) - decimals - 1}")


def printed_table(name: str) -> list[dict[str, str]]:
    """Rows of a table of printed numbers in `rotorid/validation/data`, as texts by the names of the columns.

    Lines that begin with ``#`` say where the table is printed.
    """
    path = resources.files("rotorid.validation") / "data" / name
    lines = path.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if line.strip() and not line.startswith("#")))


class Printed:
    """A table of printed numbers with the columns of `row`, by source and quantity.

    Raises
    ------
    KeyError
        For a number that the table has not.
    """

    def __init__(self, name: str) -> None:
        self.lines = {(line["source"], line["quantity"]): line for line in printed_table(name)}

    def number(self, source: str, quantity: str) -> float:
        """As it is printed."""
        return number(self.lines[source, quantity]["printed"])

    def rows(self, source: str, computed: Mapping[str, float]) -> list[Row]:
        """Computed numbers, by their quantities, beside the printed ones."""
        return [self._row(self.lines[source, quantity], value) for quantity, value in computed.items()]

    def _row(self, line: Mapping[str, str], computed: float) -> Row:
        made = row(
            line["source"],
            line["quantity"],
            line["printed"],
            computed,
            float(line["tolerance"]) if line["tolerance"] else None,
            line["reason"],
            line["erratum"],
            line["corrected"] or None,
        )
        kind = cast("Kind", line.get("kind") or "number")
        return replace(made, kind=kind, follows=line.get("follows") or "")


def tables() -> list[Path]:
    """Files of all tables of printed numbers."""
    return sorted((Path(__file__).parent / "data").glob("*.csv"))


def _match(text: str) -> re.Match[str]:
    match = _NUMBER.fullmatch(text.replace("−", "-")) if isinstance(text, str) else None
    if match is None:
        raise ValueError(
            f"{text!r} is no printed number: give it as text, digit for digit, such as '1.003e4'"
        )
    return match


def _parts(computed: float, printed: float, tolerance: float) -> float:
    """The distance as a part of the tolerance; halves that binary fractions cannot hold still agree."""
    if not math.isfinite(computed):
        return math.inf
    distance = max(0.0, abs(computed - printed) - 4 * math.ulp(printed))
    return distance / (tolerance * (1 + 1e-9))
