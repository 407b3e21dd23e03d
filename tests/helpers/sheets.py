"""Makes the sheets of the tests, and reads which numbers they show, and whether these are the document's."""

import functools
import json
import re
from dataclasses import dataclass
from decimal import Decimal
from html.parser import HTMLParser

from pictures import outcome_of

COMPRESSOR = (
    "response compressor/rotor.toml --unbalance compressor/unbalance.csv --speeds 1000:15000:500rpm "
    "--operating 5300:6500rpm"
)
COMMANDS = {
    "balance": "balance turbo_job/job.toml",
    "balance holes": "balance turbo_job/holes.toml --split",
    "balance two planes": "balance bk_two_plane/job.toml",
    "critical": "critical compressor/rotor.toml -n 4 --map --operating 4000:6500rpm",
    "critical table": "critical rotor23.csv -n 5",
    "response": COMPRESSOR + " --sensors probe_DE:45,probe_NDE:45",
    "reduce": "reduce rotor23.csv --nodes 7,12,18 --methods --response auto "
    "--stability 0:9000rpm --errors compliance=1,shapes=1",
    "reduce measured": "reduce --compliance book_task_9/compliance_printed.csv --measured "
    "book_task_9/modes_printed.csv --modes 1",
    "fit from record": "fit fit/three_masses/from_record.toml fit/three_masses/record.csv",
    "identify": "identify identify/section_1_6/model.toml identify/section_1_6/data.csv --errors 2,1",
    "identify several": "identify identify/task_3_3/model.toml identify/task_3_3/data.csv",
    "identify singular": "identify identify/task_4_1/model.toml identify/task_4_1/data.csv",
}
"""Sheets by name, as `outcome_of` reads a command line."""

NUMBER = re.compile(r"[+-]?\d+(\.\d+)?(e[+-]?\d+)?")
ROUNDED = 3  # significant digits that a whole number with zeros at its end has at least


@dataclass(frozen=True)
class Shown:
    """An element that shows a value of the embedded document, times `scale`."""

    key: str
    text: str
    scale: float = 1.0
    visible: bool = True


def value_at(document, key):
    """What the document holds at a dotted path."""
    for part in key.split("."):
        document = document[int(part)] if isinstance(document, list) else document[part]
    return document


def disagreement(shown, document):
    """Why an element does not show the document's number, or None: half a unit of the last digit is free."""
    value = value_at(document, shown.key)
    text = shown.text.replace("−", "-").strip()
    if value is None:
        return None if text in ("–", "-", "") else f"{shown.key} is null, shown as {text}"
    found = NUMBER.match(text)
    if found is None:
        return None if text == str(value) else f"{shown.key} is {value}, shown as {text!r}"
    number = Decimal(found.group())
    digits = len(number.as_tuple().digits)
    unit = Decimal(1).scaleb(number.as_tuple().exponent)
    if number and number == number.to_integral() and "." not in found.group():
        zeros = len(str(abs(int(number)))) - len(str(abs(int(number))).rstrip("0"))
        unit *= 10 ** min(zeros, max(0, digits - (2 if text.endswith("%") else ROUNDED)))
    expected = Decimal(float(value) * shown.scale)
    off = abs(number - expected)
    if text.endswith("°") or shown.key.endswith("_deg"):
        off = min(off, abs(off - 360))
    if off > unit / 2 + abs(expected) * Decimal("1e-12"):
        return f"{shown.key} is {float(expected)!r}, shown as {text}"
    return None


def disagreements(shown, document):
    """All of them."""
    return [said for element in shown if (said := disagreement(element, document))]


@dataclass(frozen=True)
class Made:
    """A sheet, and the document that the same run printed."""

    html: bytes
    document: dict


@functools.cache
def make(name):
    """The page of a command of COMMANDS, and its document."""
    outcome = outcome_of(COMMANDS[name])
    return Made(outcome.sheet(), json.loads(json.dumps(outcome.document, allow_nan=False)))


class _Reader(HTMLParser):
    def __init__(self):
        super().__init__()
        self.shown, self.ids, self.references, self.order, self.result = [], [], [], [], ""
        self._open, self._script = [], False

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.ids += [attrs["id"]] if "id" in attrs else []
        self.references += [
            v for k, v in attrs.items() if k.split(":")[-1] in ("href", "src", "action", "data")
        ]
        self.order.append((tag, attrs.get("id"), attrs.get("class") or ""))
        self._script = tag == "script"
        if "data-key" in attrs:
            self._open.append([attrs["data-key"], "", float(attrs.get("data-scale") or 1.0), tag])

    def handle_endtag(self, tag):
        self._script = False
        if self._open and self._open[-1][3] == tag:
            key, text, scale, _ = self._open.pop()
            self.shown.append(Shown(key, text, scale))

    def handle_data(self, data):
        if self._script:
            self.result += data
        for element in self._open:
            element[1] += data


@dataclass(frozen=True)
class Sheet:
    """A sheet taken apart."""

    text: str
    document: dict
    shown: list
    ids: list
    references: list
    order: list

    @property
    def keys(self):
        return {element.key for element in self.shown}


def read_sheet(html):
    """Take a sheet apart without a browser."""
    text = html.decode("utf-8")
    reader = _Reader()
    reader.feed(text)
    reader.close()
    document = json.loads(reader.result)
    return Sheet(text, document, reader.shown, reader.ids, reader.references, reader.order)
