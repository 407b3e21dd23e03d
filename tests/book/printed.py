"""Tables of printed numbers in `tests/data/book`, and the rule by which a computed number agrees.

A row has `source` and `quantity`, the number as it is `printed`, and `why` it is taken: `printed` in one of
the three books; `chosen` because it agrees, where the print is damaged or does not say how; from
`elsewhere`. Its `kind` is empty, or `bound` (the text says that it is not exceeded), `given` (computed from
nothing: it cannot fail) or `not compared` (the reason says why). The tolerance is half a unit of the last
printed digit unless another is given with its reason. A wrong print has its `erratum`, the `corrected`
number where it is known, and `follows` names the misprint that it follows from.
"""

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

DATA = Path(__file__).parents[1] / "data" / "book"
WHY = ("printed", "chosen", "elsewhere")
STATUSES = ("agrees", "misprint", "consequence", "given", "not compared", "differs")
NUMBER = re.compile(r"[+-]?(?:\d+(?P<decimals>\.\d*)?|(?P<bare>\.\d+))(?:[eE](?P<exponent>[+-]?\d+))?")


def half_unit(text):
    """Half a unit of the last digit of a printed number: 999.935 -> 5e-4, 1.991e4 -> 5."""
    match = NUMBER.fullmatch(text)
    decimals = len((match["decimals"] or match["bare"] or ".")[1:])
    return float(f"5e{int(match['exponent'] or 0) - decimals - 1}")


def near(computed, text, tolerance):
    """Whether a number is as close to a printed one; halves that binary fractions cannot hold are."""
    return abs(computed - float(text)) - 4 * math.ulp(float(text)) <= tolerance * (1 + 1e-9)


@dataclass(frozen=True)
class Row:
    source: str
    quantity: str
    printed: str
    why: str
    kind: str = ""
    tolerance: str = ""
    reason: str = ""
    erratum: str = ""
    corrected: str = ""
    follows: str = ""

    @property
    def key(self):
        return self.source, self.quantity

    @property
    def allowed(self):
        """The largest difference that still agrees."""
        return float(self.tolerance) if self.tolerance else half_unit(self.printed)

    def status(self, computed):
        """One of `STATUSES`; an erratum that agrees with the print, or not with the correction, differs."""
        if self.kind == "not compared":
            return self.kind
        if self.kind == "bound":
            agrees = computed <= float(self.printed)
        else:
            agrees = near(computed, self.printed, self.allowed)
        if not self.erratum:
            return (self.kind if self.kind == "given" else "agrees") if agrees else "differs"
        wrong = self.corrected and not near(computed, self.corrected, half_unit(self.corrected))
        if agrees or wrong or math.isnan(computed):
            return "differs"
        return "consequence" if self.follows else "misprint"

    @property
    def note(self):
        """What is to be said beside the number."""
        follows = self.follows and f"follows from {self.follows}"
        return "; ".join(part for part in (self.erratum, follows, self.reason) if part)


def lines(name):
    """Rows of a table as dictionaries; lines that begin with # say where it is printed."""
    text = (DATA / name).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in text if not line.startswith("#")))


def read(name):
    """Rows of a table, by source and quantity."""
    rows = [Row(**line) for line in lines(name)]
    return {row.key: row for row in rows}


def parts(quantity, values):
    """Numbered quantities: "m{}, kg" and three masses give m1 to m3."""
    return {quantity.format(i): float(value) for i, value in enumerate(values, 1)}


def below(source, computed):
    """Computed quantities of one source, by source and quantity."""
    return {(source, quantity): float(value) for quantity, value in computed.items()}
