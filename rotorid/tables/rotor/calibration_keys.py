"""`[calibration]` of a rotor file: its keys, reading and writing."""

from __future__ import annotations

from typing import Any

import numpy as np

from fem import Calibration, Rotor
from fem.parameters import expand
from rotorid.base.text import counted
from rotorid.files.problems import Problems
from rotorid.files.settings_keys import Key, Said
from rotorid.files.value_kinds import FLAG, TEXT, each, number, numbers

PARAMETER = (
    Key("name", TEXT, "which of the rotor's numbers, such as `bearing[1].kxx.scale`", required="its name"),
    Key("value", number(), "what was found, in SI; a scale of the file calibrated", required="its value"),
    Key("std", number(0.0), "standard deviation; of a scale relative to this file", required="its std"),
    Key(
        "correlation",
        numbers("correlations such as [1.0, -0.3]", "1; -0.3"),
        "with all parameters in their order; default: with none",
    ),
)
DATA = (
    Key("file", TEXT, "name of a file that it was made from", required="its name"),
    Key("sha256", TEXT, "hash of its content", required="its hash"),
)
CALIBRATION = (
    Key("needs_trial_run", FLAG, "whether the data contradict the model", default=False),
    Key(
        "lack_of_fit",
        number(0.0),
        "what the model leaves of a coefficient, one relative standard deviation",
        default=0.0,
    ),
    Key("parameter", each(PARAMETER), "what was fitted", default=()),
    Key("data", each(DATA), "a file that it was made from, which must not count twice", default=()),
)


def read_calibration(said: Said, rotor: Rotor, problems: Problems) -> Calibration:
    """What `[calibration]` says of a rotor; raises `InputError` with its problems."""
    parameters, n = said["parameter"], len(said["parameter"])
    for one in parameters:
        try:
            single = expand(rotor, one["name"]) == (one["name"],)
        except ValueError as error:
            one.section.complain("name", f"a parameter of this rotor; {error}")
        else:
            if not single:
                one.section.complain("name", "a single parameter, without [*]")
        if one["correlation"] and len(one["correlation"]) != n:
            one.section.complain("correlation", f"{counted(n, 'number')}, one for each parameter")
    problems.stop()
    std = np.array([one["std"] for one in parameters])
    R = [one["correlation"] or row for one, row in zip(parameters, np.eye(n), strict=True)]
    try:
        return Calibration(
            tuple(one["name"] for one in parameters),
            np.array([one["value"] for one in parameters]),
            np.reshape(R, (n, n)) * np.outer(std, std),
            said["lack_of_fit"],
            said["needs_trial_run"],
            {one["file"]: one["sha256"] for one in said["data"]},
        )
    except ValueError as error:
        said.section.refuse(f"a possible calibration: {error}")
        problems.stop()
        raise


def calibration_table(found: Calibration) -> dict[str, Any]:
    """A calibration as `[calibration]` says it, with all digits."""
    R = np.where(np.abs(found.correlation) < 1e-20, 0.0, found.correlation)
    np.fill_diagonal(R, 1.0)
    table: dict[str, Any] = {"needs_trial_run": found.needs_trial_run}
    if found.lack_of_fit:
        table["lack_of_fit"] = found.lack_of_fit
    for key, keys, columns in (
        ("parameter", PARAMETER, (found.names, found.values.tolist(), found.std.tolist(), R.tolist())),
        ("data", DATA, (found.data.keys(), found.data.values())),
    ):
        names = [one.name for one in keys]
        if rows := [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]:
            table[key] = rows
    return table
