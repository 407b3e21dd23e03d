"""Writes the tables of docs/sure.md anew: `make sure`, or `python tests/coverage/sure.py [TABLE …]`.

A line `% table NAME` of the page stands before each block of the table. A table with several blocks has one
for each paragraph that its program prints.
"""

import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
PAGE = HERE.parents[1] / "docs" / "sure.md"
ARGUMENTS = {
    "balance": (1000,),
    "calibrate": (1, 510, 90),
    "fleet": (50, 1),
    "fits": (1000,),
    "identify": (1000,),
    "special": (1000,),
    "without_phase": (1000,),
    "runup": (1, 500),
    "vectors": (10,),
    "what_if": (1000,),
}
"""Of the program coverage_NAME.py of each table: three quarters of an hour in all on two cores."""
BLOCK = re.compile(r"^% table ([^\n]+)\n\n```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(name, page=None):
    """What the page shows of a table."""
    page = PAGE.read_text(encoding="utf-8") if page is None else page
    return [text for found, text in BLOCK.findall(page) if found == name]


def titles(text):
    """What the lines of a table are about, without their numbers."""
    return [re.split(r"  +[\d–]| [\d.–]+ % of", line)[0].rstrip() for line in text.splitlines() if line]


def renewed(page, name, printed):
    """The page with what the program of a table prints now."""
    shown = blocks(name, page)
    parts = [printed.strip("\n")] if len(shown) == 1 else printed.strip("\n").split("\n\n")
    if len(parts) != len(shown):
        raise ValueError(f"{name}: {len(parts)} paragraphs for {len(shown)} blocks of the page")
    left = iter(parts)

    def write(match):
        return f"% table {name}\n\n```text\n{next(left)}\n```" if match[1] == name else match[0]

    return BLOCK.sub(write, page)


def printed(name):
    """What the program of a table prints."""
    command = [sys.executable, HERE / f"coverage_{name}.py", *map(str, ARGUMENTS[name])]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout


def main(*names):
    names = names or tuple(ARGUMENTS)
    with ThreadPoolExecutor(2) as pool:
        for name, text in zip(names, pool.map(printed, names), strict=True):
            page = PAGE.read_text(encoding="utf-8")
            PAGE.write_text(renewed(page, name, text), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
