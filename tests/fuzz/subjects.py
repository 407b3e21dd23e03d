"""What is mutated: one file of a command that reads it, and the command."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from fuzz.meaning import PLAIN
from rotorid.samples import sample_data


@dataclass(frozen=True)
class Subject:
    """A command, the folder of samples that it reads, and the one file that is mutated."""

    folder: str
    target: str
    command: str
    weight: int = 2

    @property
    def kind(self):
        return {".toml": "toml", ".xlsx": "workbook"}.get(Path(self.target).suffix, "table")

    @property
    def name(self):
        return f"{self.folder}/{self.target}"

    def prepare(self, place):
        """Copy the folder to a place, with the files that a command had to write first; the mutated file."""
        shutil.copytree(sample_data() / self.folder, place / self.folder, dirs_exist_ok=True)
        if self.folder != "rotor":
            shutil.copy(sample_data() / "rotor23.csv", place / self.folder / "rotor23.csv")
        for name, write in MADE.items():
            if name == self.target:
                write(place / self.folder)
        return place / self.folder / self.target

    def words(self, place):
        return [
            str(place / self.folder / word) if (place / self.folder / word).is_file() else word
            for word in self.command.split()
        ]


def _influence(folder):
    from rotorid.commands.balance import balance
    from rotorid.files import write_influence

    write_influence(folder / "influence.csv", balance(folder / "job.toml").influence)
    lines = (folder / "runs.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    first = [line for line in lines if line.startswith(("run,", "initial,"))]
    (folder / "first.csv").write_text("".join(first), encoding="utf-8")


def _workbook(folder):
    import openpyxl

    sheets = {
        "planes": "plane,max_mass_g\n1,6.5\n2,7.5\n",
        "settings": "key,value\nphase,lag\nangles,with rotation\nerrors.phase_deg,2\n",
    }
    sheets |= {name: (folder / f"{name}.csv").read_text(encoding="utf-8") for name in ("runs", "weights")}
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name in ("runs", "weights", "planes", "settings"):
        sheet = book.create_sheet(name)
        for line in sheets[name].splitlines():
            sheet.append([float(text) if PLAIN.fullmatch(text) else text for text in line.split(",")])
    book.save(folder / "job.xlsx")


MADE = {"influence.csv": _influence, "job.xlsx": _workbook}

RESPONSE = "response rotor.toml --unbalance unbalance.csv --speeds 500:700:100"
SUBJECTS = (
    Subject("bk_two_plane", "runs.csv", "balance runs.csv weights.csv", 4),
    Subject("bk_two_plane", "weights.csv", "balance runs.csv weights.csv", 3),
    Subject("bk_two_plane", "job.toml", "balance job.toml", 3),
    Subject("bk_two_plane", "influence.csv", "balance first.csv --influence influence.csv"),
    Subject("bk_two_plane", "job.xlsx", "balance job.xlsx", 4),
    Subject("compressor", "rotor23.csv", "critical rotor23.csv -n 2", 3),
    Subject("compressor", "rotor.toml", "critical rotor.toml -n 2", 3),
    Subject("compressor", "shaft.csv", "critical rotor.toml -n 2"),
    Subject("compressor", "bearing.csv", "critical rotor.toml -n 2"),
    Subject("compressor", "unbalance.csv", RESPONSE, 1),
    Subject("book_task_9", "modes.csv", "reduce --measured modes.csv --compliance compliance.csv"),
    Subject("book_task_9", "compliance.csv", "reduce --measured modes.csv --compliance compliance.csv"),
    Subject("identify/task_1_1", "data.csv", "identify model.toml data.csv", 3),
    Subject("identify/task_1_1", "model.toml", "identify model.toml data.csv"),
    Subject("fit/run_down", "record.csv", "fit model.toml record.csv", 1),
    Subject("fit/run_down", "model.toml", "fit model.toml record.csv", 1),
)
