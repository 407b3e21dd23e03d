"""Tables of critical speeds or natural frequencies, and of modes with shapes, for a calibration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem import Rotor
from rotorid.calibration.frequencies import MeasuredFrequencies
from rotorid.files import units
from rotorid.files.columns import Column, read_grid, read_table
from rotorid.files.excel_workbook import is_workbook
from rotorid.files.problems import Problems
from rotorid.files.units import one_of, ratio
from rotorid.tables.data.modes_table import read_modes

FREQUENCY_ERROR, SHAPE_ERROR = 0.005, 0.05
"""Assumed, relative, of a table of modes that states none."""
MOST_MODES = 1000
COUNTED = "modes count the forward critical speeds, as of any rotor on supports alike in x and y"
_SPEED = one_of(units.SPEED)
_PERCENT = one_of({"percent": units.Unit("percent", "ratio", 1.0, 100.0)})
COLUMNS = (
    Column("mode", ratio),
    Column("critical_speed", _SPEED, ("critical_speed_rpm", "critical_speed_rad_s"), required=False),
    Column("natural_frequency", _SPEED, ("natural_frequency_Hz", "natural_frequency_rad_s"), required=False),
    Column("std", _PERCENT, ("std_percent",), required=False),
)


@dataclass(frozen=True)
class FrequencyTable:
    """What a table says, and what was assumed of its errors."""

    data: MeasuredFrequencies
    assumed: tuple[str, ...] = ()


def is_job(path: Path) -> bool:
    """Whether a file is a job: settings, or a workbook with a sheet `runs`."""
    if not is_workbook(path):
        return path.suffix.lower() == ".toml"
    from rotorid.files.excel_workbook import read_workbook

    problems = Problems()
    return "runs" in [name.strip().casefold() for name in problems.need(read_workbook(path, problems))]


def read_frequencies(path: Path, rotor: Rotor) -> FrequencyTable:
    """Read `mode`, `critical_speed_rpm` (or another unit) or `natural_frequency_Hz`, and `std_percent`.

    Without `std_percent` the error is that of the digits. A table with a column `shape` is one of modes at
    rest (with `critical_speed_rpm`: at these), see `read_modes`; 0.5 % of its frequencies and 5 % of its
    shapes are assumed where it states none.

    Raises
    ------
    InputError
        With all problems of the file.
    """
    problems = Problems()
    grid = problems.need(read_grid(path, "modes", problems, first=True))
    if any(name.strip() == "shape" for name in grid.header):
        return _modes(path, rotor)
    table = problems.need(read_table(path, "frequencies", COLUMNS, problems, first=True))
    stem = table.only(
        ("critical_speed", "natural_frequency"),
        "critical_speed_rpm",
        "one column critical_speed_rpm (or another unit) or natural_frequency_Hz",
    )
    number = table.numbers("mode")
    whole = (number >= 1) & (number <= MOST_MODES) & (number == np.floor(number))
    table.must_be("mode", whole, "a mode number: 1, 2, …")
    table.once("mode", table.numbers("mode").tolist(), "another mode than in row {}")
    table.must_be("std", table.numbers("std") > 0, "a standard deviation above 0 percent")
    if stem is not None:
        table.must_be(stem, table.numbers(stem) > 0, "a number above 0")
        below = [table.numbers(stem)[number < k].max(initial=0.0) for k in number]
        table.must_be(stem, table.numbers(stem) >= below, "no less than of a mode with a lower number")
    stem = problems.need(stem)
    problems.stop()
    values = table.numbers(stem)
    std = values * table.numbers("std") if "std" in table else table.steps(stem) / np.sqrt(12.0)
    rest = stem == "natural_frequency"
    said = (COUNTED,) if rotor.symmetric and not rest else ()
    return FrequencyTable(MeasuredFrequencies(number.astype(np.int64), values, std, rest), said)


def _modes(path: Path, rotor: Rotor) -> FrequencyTable:
    modes = read_modes(path, rotor)
    assumed = [COUNTED] if rotor.symmetric and modes.critical else []
    relative, spread = modes.frequency_std, SHAPE_ERROR
    for name, std in (("frequency", relative), ("shape", modes.shape_std)):
        if std is not None and not std.all():
            problems = Problems()
            expected = "standard deviations above 0: nothing is measured exactly"
            problems.add(path.name, None, f"{name}_std_percent", None, expected)
            problems.stop()
    if relative is None:
        relative = np.full(modes.frequencies.size, FREQUENCY_ERROR)
        assumed.append(f"{100 * FREQUENCY_ERROR:g} % of each frequency is assumed as its standard deviation")
    if modes.shape_std is None:
        assumed.append(f"{100 * SHAPE_ERROR:g} % of each shape is assumed as its standard deviation")
    else:
        spread = float(np.sqrt(np.mean(modes.shape_std**2)))
    data = MeasuredFrequencies(
        np.arange(1, modes.frequencies.size + 1),
        modes.frequencies,
        relative * modes.frequencies,
        rest=not modes.critical,
        nodes=tuple(rotor.node(node) for node in modes.nodes),
        shapes=modes.shapes,
        shape_std=spread,
    )
    return FrequencyTable(data, tuple(assumed))
