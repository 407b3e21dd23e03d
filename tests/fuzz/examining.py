"""One mutant after the other: what its command did, and whether that is right."""

from __future__ import annotations

import contextlib
import io
import random
from dataclasses import dataclass
from functools import cache

import openpyxl
import tomli_w

from fuzz import meaning
from fuzz import mutations as m
from fuzz.judging import answer, same
from fuzz.spreadsheets import dress, mutate_workbook
from fuzz.subjects import SUBJECTS

REFUSED, SAME, CHANGED, FINDING = "refused", "same answer", "legitimate change", "FINDING"
DECK = [subject for subject in SUBJECTS for _ in range(subject.weight)]


@dataclass(frozen=True)
class Outcome:
    """Of one mutant: its number, the file, the mutation, what came of it, and why."""

    number: int
    file: str
    mutation: str
    result: str
    why: str = ""

    def __str__(self):
        return f"{self.number:6d} {self.file:28} {self.mutation:20} {self.result}: {self.why}"


@dataclass(frozen=True)
class Bench:
    """A subject made ready: its file, the command's words, the answer to the file as it is."""

    target: object
    words: list
    data: bytes
    document: object


@cache
def bench(subject, place):
    """A place of its own for each subject."""
    own = place / str(SUBJECTS.index(subject))
    target = subject.prepare(own)
    words = subject.words(own)
    first = answer(words, seconds=60)
    assert first.document is not None, (subject, first)
    return Bench(target, words, target.read_bytes(), first.document)


def generator(seed, number):
    """The random numbers of one mutant."""
    return random.Random(f"{seed}:{number}")


def mutate(rng, kind, data):
    """(what was done, the mutated file, its text where that is known and not plain UTF-8)."""
    if kind == "workbook":
        return *mutate_workbook(rng, data), None
    more = (m.COLUMNS, m.ENCODINGS, (dress,)) if kind == "table" else (m.SETTINGS,)
    done = rng.choice(rng.choice((m.BYTES, m.LINES, m.NUMBERS, m.NUMBERS, *more)))
    changed = done(rng, data)
    if done is dress:
        return *changed, None
    return done.__name__, *(changed if isinstance(changed, tuple) else (changed, None))


def examine(number, seed, place):
    """Make the mutant of this number, and judge what the program says of it."""
    rng = generator(seed, number)
    subject = DECK[rng.randrange(len(DECK))]
    ready = bench(subject, place)
    mutation, data, text = mutate(rng, subject.kind, ready.data)
    try:
        result, why = judge(subject.kind, ready, data, text)
    finally:
        ready.target.write_bytes(ready.data)
    return Outcome(number, subject.name, mutation, result, why)


def judge(kind, ready, data, text=None):
    """(result, why) of a mutated file."""
    found = _answer(ready, data)
    if found.broken:
        return FINDING, found.broken
    if found.status:
        return REFUSED, found.error.strip().splitlines()[-1][:120]
    changed = same(ready.document, found.document)
    readings = list(_readings(kind, data, text))
    original = next(iter(_readings(kind, ready.data, None)))
    if any(sense == original[0] for sense, _ in readings):
        return (SAME, "") if changed is None else (FINDING, f"the same content, another answer: {changed}")
    if not readings:
        if changed is None:
            return SAME, ""
        return FINDING, f"accepted, and nobody else can read it: {changed}"
    trouble = ""
    for _, plainly in readings:
        plain = _answer(ready, plainly)
        if plain.document is None:
            trouble = f"accepted, but its content written plainly is not: {plain.error or plain.broken}"
        elif (difference := same(plain.document, found.document)) is not None:
            trouble = f"another answer than the same content written plainly: {difference}"
        else:
            return (SAME, "") if changed is None else (CHANGED, changed)
    return FINDING, trouble


def _answer(ready, data):
    ready.target.write_bytes(data)
    return answer(ready.words)


def _readings(kind, data, text):
    """(sense, the file written plainly) for every way in which the second reader can read a file."""
    if kind == "toml":
        content = meaning.settings(data)
        if content is not None:
            yield repr(_sorted(content)), tomli_w.dumps(content).encode()
    elif kind == "workbook":
        content = meaning.workbook(data)
        if content is not None:
            yield content, _book(content)
    else:
        for known in [text] if text is not None else _texts(data):
            read = meaning.table(known)
            if read is not None:
                yield meaning.table_sense(read), meaning.table_file(read)


def _sorted(content):
    if isinstance(content, dict):
        return {key: _sorted(content[key]) for key in sorted(content)}
    return [_sorted(x) for x in content] if isinstance(content, list) else content


def _texts(data):
    marked = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    for encodings in (("utf-16",),) if marked else (("utf-8-sig",), ("cp1252", "cp1251")):
        texts = []
        for encoding in encodings:
            with contextlib.suppress(UnicodeDecodeError):
                texts.append(data.decode(encoding))
        if texts:
            return texts
    return []


def _book(content):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, cells in content.items():
        sheet = book.create_sheet(title)
        for (row, column), (value, number_format) in cells.items():
            cell = sheet.cell(row, column)
            cell.value, cell.number_format = value, number_format
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()
