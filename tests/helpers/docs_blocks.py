"""The code blocks of a documentation page, run as a reader would run them, from top to bottom.

Literal outputs are compared; with ROTORID_RENEW_PAGES=1 (`make pages`) they are written anew instead.
"""

import difflib
import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import openpyxl
from latex2mathml.converter import convert

FENCE = re.compile(
    r"^(?:(?:Prints|`([\w./]+)`):\n\n)?```(.*)\n((?::\w+:.*\n)*)((?:(?!```).*\n)*)```$", re.MULTILINE
)
INLINE_CODE = re.compile(r"`[^`\n]*`")
SHEET = re.compile(r"^\*\*Sheet `(\w+)`\*\*.*\n(?:.+\n)*\n((?:\|.*\n)+)", re.MULTILINE)
SKIPPED = ("...", "…")


@dataclass(frozen=True)
class Block:
    """One fenced block: its language or directive, its caption, its text, and the line where it begins."""

    kind: str
    caption: str
    text: str
    line: int


def blocks(page: Path) -> list[Block]:
    """All fenced blocks of a page, in their order.

    Their caption is that of the directive, or what the line before the block says: a file's name in
    backquotes, or "Prints:".
    """
    text = page.read_text(encoding="utf-8")
    found = []
    for match in FENCE.finditer(text):
        caption = re.search(r"^:caption: (.*)$", match[3], re.MULTILINE)
        line = text.count("\n", 0, match.start()) + 1
        name = caption[1].strip() if caption else match[1] or "prints" * match[0].startswith("Prints:")
        found.append(Block(match[2].strip(), name, match[4], line))
    found += [
        Block("sheet", match[1], match[2], text.count("\n", 0, match.start()) + 1)
        for match in SHEET.finditer(text)
    ]
    return sorted(found, key=lambda block: block.line)


def commands(block: Block) -> list[tuple[str, list[str]]]:
    """The commands of a console block, each with the lines it is said to print."""
    out: list[tuple[str, list[str]]] = []
    for line in block.text.splitlines():
        if line.startswith("$ "):
            out.append((line[2:], []))
        elif out:
            out[-1][1].append(line)
    return out


def first_difference(expected: list[str], printed: str) -> str | None:
    """The first expected line that is not printed in its place; None if all are.

    Spaces count as one; lines follow each other directly, unless `...` stands between them.
    """
    lines = [" ".join(line.split()) for line in printed.splitlines() if line.strip()]
    position, jump = 0, True
    for line in (" ".join(text.split()) for text in expected):
        if line in SKIPPED:
            jump = True
        elif line:
            if line not in lines[position:] or not (jump or lines[position] == line):
                return line
            position = lines.index(line, position) + 1
            jump = False
    return None


def renewed(expected: list[str], printed: str) -> list[str]:
    """What a page shows of an output now: all of it, or for each of its lines the most similar one."""
    lines = [line.rstrip() for line in printed.strip("\n").splitlines()]
    if not any(line.strip() in SKIPPED for line in expected):
        return lines if expected else []
    out: list[str] = []
    position = 0
    for line in expected:
        near = difflib.get_close_matches(line, lines[position:], n=1, cutoff=0.6) if line.strip() else []
        if line.strip() not in SKIPPED and near:
            found = lines.index(near[0], position)
            out += ["..."] * any(lines[position:found]) + [lines[found]]
            position = found + 1
    return [*out, *["..."] * any(lines[position:])]


def type_sheet(book: Path, name: str, table: str) -> None:
    """Type a table of a page into a sheet: numbers as numbers, new headers over the old ones."""
    workbook = openpyxl.load_workbook(book)
    sheet = workbook[name]
    rows = [[cell.strip() for cell in line.strip("| ").split("|")] for line in table.splitlines()]
    head, cells = rows[0], rows[2:]
    known = [cell.value for cell in sheet[1]]
    places = [known.index(word) + 1 if word in known else i for i, word in enumerate(head, 1)]
    below = {sheet.cell(row, 1).value: row for row in range(2, sheet.max_row + 1)}
    for column, word in zip(places, head, strict=True):
        sheet.cell(1, column).value = word
    for i, values in enumerate(cells, 2):
        for column, value in zip(places, values, strict=True):
            number = re.fullmatch(r"-?\d+(\.\d+)?", value)
            sheet.cell(below.get(values[0], i), column).value = float(value) if number else value
    workbook.save(book)


def run_page(page: Path, folder: Path, cli, capsys, renewals: dict[str, str] | None = None) -> int:
    """Run a page's blocks within a folder (the current one); returns how many commands and scripts ran.

    Blocks with a caption are files; console blocks are compared with what is printed; python blocks of a page
    share their names, and a text block with the caption "prints" says what the one before it prints. Tables
    below **Sheet `name`** are typed into the workbook. With `renewals` nothing fails: it takes old and new
    console blocks.
    """
    names: dict[str, object] = {"__name__": "docs"}
    ran, printed = 0, ""
    for block in blocks(page):
        where = f"{page.name}, line {block.line}"
        if block.kind == "console":
            shown: list[str] = []
            for command, expected in commands(block):
                program, *words = shlex.split(command)
                assert program == "rotorid", f"{where}: {command}"
                outcome = cli(*words)
                wrong = first_difference(expected, outcome.out + outcome.err)
                refused = any(line.startswith("rotorid: ") for line in expected)
                now = expected if wrong is None else renewed(expected, outcome.out + outcome.err)
                shown += [f"$ {command}", *now]
                ran += 1
                if renewals is not None:
                    continue
                assert outcome.code == (2 if refused else 0), f"{where}: {command}\n{outcome.err}"
                assert wrong is None, f"{where}: {command}\nnot printed: {wrong}\n{outcome.out}{outcome.err}"
            if renewals is not None:
                renewals[block.text] = "\n".join(shown) + "\n"
        elif block.kind == "sheet":
            [book] = folder.glob("*.xlsx")
            type_sheet(book, block.caption, block.text)
        elif block.kind == "python":
            capsys.readouterr()
            exec(compile("\n" * block.line + block.text, str(page), "exec"), names)
            printed = capsys.readouterr().out
            ran += 1
        elif block.caption == "prints":
            wrong = first_difference(block.text.splitlines(), printed)
            assert wrong is None, f"{where}: not printed: {wrong}\n{printed}"
        elif block.caption:
            target = folder / block.caption
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.text, encoding="utf-8")
    return ran


def formulas(page: Path) -> tuple[list[str], list[str]]:
    """Displayed and inline formulas of a page, without its code."""
    text = INLINE_CODE.sub("", FENCE.sub("", page.read_text(encoding="utf-8")))
    shown = re.findall(r"\$\$(.*?)\$\$", text, re.DOTALL)
    rest = re.sub(r"\$\$.*?\$\$", "", text, flags=re.DOTALL)
    assert rest.count("$") % 2 == 0, page
    return shown, re.findall(r"\$([^$]+)\$", rest)


def check_formulas(page: Path) -> int:
    """Each becomes well-formed MathML, as docs/_ext/mathml.py writes it; how many."""
    shown, within = formulas(page)
    for formula, display in [(f, "block") for f in shown] + [(f, "inline") for f in within]:
        tree = ElementTree.fromstring(convert(formula.strip(), display=display))
        assert "\\" not in "".join(tree.itertext()), formula
        assert "$" not in formula
    return len(shown) + len(within)


def check_links(page: Path) -> None:
    """Links to files lead somewhere, and those to sections of pages to a heading."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    for link, section in re.findall(r"\]\((?!https?:)([^)#\s]*)(?:#([^)]*))?\)", text):
        target = page.parent / link if link else page
        assert target.exists(), f"{page.name}: {link}"
        if section and target.suffix == ".md" and not section.startswith("rotorid-"):
            heads = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE)
            assert section in {anchor(head) for head in heads}, f"{page.name}: {link}#{section}"


def anchor(heading: str) -> str:
    """What GitHub and MyST call a heading in addresses."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
