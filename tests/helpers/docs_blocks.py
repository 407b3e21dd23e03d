"""The code blocks of a documentation page, run as a reader would run them, from top to bottom."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

FENCE = re.compile(r"^```(.*)\n((?::\w+:.*\n)*)((?:(?!```).*\n)*)```$", re.MULTILINE)
SKIPPED = ("...", "…")


@dataclass(frozen=True)
class Block:
    """One fenced block: its language or directive, its caption, its text, and the line where it begins."""

    kind: str
    caption: str
    text: str
    line: int


def blocks(page: Path) -> list[Block]:
    """All fenced blocks of a page, in their order."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in FENCE.finditer(text):
        caption = re.search(r"^:caption: (.*)$", match[2], re.MULTILINE)
        line = text.count("\n", 0, match.start()) + 1
        found.append(Block(match[1].strip(), caption[1].strip() if caption else "", match[3], line))
    return found


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


def run_page(page: Path, folder: Path, cli, capsys) -> int:
    """Run a page's blocks within a folder (the current one); returns how many commands and scripts ran.

    Blocks with a caption are files; console blocks are compared with what is printed; python blocks of a
    page share their names, and a text block with the caption "prints" says what the one before it prints.
    """
    names: dict[str, object] = {"__name__": "docs"}
    ran, printed = 0, ""
    for block in blocks(page):
        where = f"{page.name}, line {block.line}"
        if block.kind == "console":
            for command, expected in commands(block):
                program, *words = shlex.split(command)
                assert program == "rotorid", f"{where}: {command}"
                outcome = cli(*words)
                wrong = first_difference(expected, outcome.out + outcome.err)
                refused = any(line.startswith("rotorid: ") for line in expected)
                assert outcome.code == (2 if refused else 0), f"{where}: {command}\n{outcome.err}"
                assert wrong is None, f"{where}: {command}\nnot printed: {wrong}\n{outcome.out}{outcome.err}"
                ran += 1
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
