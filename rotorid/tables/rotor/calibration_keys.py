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
COMPARED = (
    Key("sensor", TEXT, "name", required="its name"),
    Key(
        "lack_of_fit",
        numbers("relative errors such as [0.02, 0.05]", "0.02; 0.05"),
        "what the model leaves of a coefficient, one relative standard deviation, at each of the speeds",
        required="a number for each speed",
    ),
)
CALIBRATION = (
    Key("needs_trial_run", FLAG, "whether the data contradict the model", default=False),
    Key("speeds_rad_s", numbers("speeds such as [300, 350]", "300; 350"), "speeds compared", default=()),
    Key("parameter", each(PARAMETER), "what was fitted", default=()),
    Key("compared", each(COMPARED), "a sensor, and how well the model agrees", default=()),
    Key("data", each(DATA), "a file that it was made from, which must not count twice", default=()),
)


def read_calibration(said: Said, rotor: Rotor, problems: Problems) -> Calibration:
    """What `[calibration]` says of a rotor; raises `InputError` with its problems."""
    parameters, compared = said["parameter"], said["compared"]
    n, speeds = len(parameters), said["speeds_rad_s"]
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
    for one in compared:
        if len(one["lack_of_fit"]) != len(speeds):
            expected = f"{counted(len(speeds), 'number')}, one for each of speeds_rad_s"
            one.section.complain("lack_of_fit", expected)
    problems.stop()
    std = np.array([one["std"] for one in parameters])
    R = [one["correlation"] or row for one, row in zip(parameters, np.eye(n), strict=True)]
    try:
        return Calibration(
            tuple(one["name"] for one in parameters),
            np.array([one["value"] for one in parameters]),
            np.reshape(R, (n, n)) * np.outer(std, std),
            np.array(speeds),
            tuple(one["sensor"] for one in compared),
            np.array([one["lack_of_fit"] for one in compared]).T,
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
    if found.speeds.size:
        table["speeds_rad_s"] = found.speeds.tolist()
    for key, keys, columns in (
        ("parameter", PARAMETER, (found.names, found.values.tolist(), found.std.tolist(), R.tolist())),
        ("compared", COMPARED, (found.sensors, found.lack_of_fit.T.tolist())),
        ("data", DATA, (found.data.keys(), found.data.values())),
    ):
        names = [one.name for one in keys]
        if rows := [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]:
            table[key] = rows
    return table
