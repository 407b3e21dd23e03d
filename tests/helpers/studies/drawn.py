"""Samples of their own for the engine of studies, and a small study; workers import them by name."""

import os
import signal
from pathlib import Path

ROTOR = """element,length_m,diameter_m,support_stiffness_N_per_m,mass_kg
1,0.2,0.04,1e7,0
2,0.2,0.04,0,5
3,0.2,0.04,0,0
4,0.2,0.04,1e7,0
"""
STUDY = """
kind = "balance"
rotor = "rotor.csv"
speeds_rpm = [3000]
samples = 60
[planes.middle]
node = 3
[sensors.probe]
node = 3
limit_um_pp = 20
[unbalance.3]
rms_g_mm = 500
"""
TWO = STUDY.replace(
    "[planes.middle]\nnode = 3\n", "corrections = 3\n[planes.left]\nnode = 2\n[planes.right]\nnode = 4\n"
).replace(
    "[unbalance.3]",
    "[sensors.other]\nnode = 2\nlimit_mm_s_rms = 1.2\n[unbalance.2]\nrms_g_mm = 360\n[unbalance.4]",
)
SCATTER = """
[scatter]
"bearing[*].stiffness" = 20
[readings]
amplitude_percent = 2
run_percent = 2
"""


def write(folder, text=STUDY):
    """The file of a study, with its rotor."""
    (folder / "rotor.csv").write_text(ROTOR)
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


def number(rng):
    """A normal number."""
    return {"x": float(rng.standard_normal())}


def noted(data, rng):
    """The same; each call leaves a line, and the number of one sample is wrong."""
    row = number(rng)
    with open(data["calls"], "a") as stream:
        stream.write(f"{row['x']}\n")
    if row["x"] == data["wrong"]:
        raise ZeroDivisionError("no such bearing")
    return row


def fatal(data, rng):
    """The same; the worker dies once of one sample."""
    row = number(rng)
    flag = Path(data["flag"])
    if row["x"] == data["deadly"] and not flag.exists():
        flag.touch()
        os.kill(os.getpid(), getattr(signal, "SIGKILL", signal.SIGTERM))
    return row
