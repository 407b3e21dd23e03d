"""Balancing sheets for the tests: jobs, and the sheet each makes."""

from pathlib import Path

from sheets import read_sheet

from rotorid.commands.balance import BalanceOptions, balance

DATA = Path(__file__).parents[2] / "sample_data"
SETTINGS = """
runs = "runs.csv"
weights = "weights.csv"
slow_roll = "slow.csv"
phase = "lag"
angles = "counter-clockwise"
rotation = "clockwise"
view = "drive end"
[key_phasor]
angle_deg = 40
[errors]
amplitude_percent = 1
phase_deg = 1
[planes.left]
radius_mm = 120
holes = 12
available_g_mm = [50, 100, 150]
per_hole = 3
max_unbalance_g_mm = 500
[planes.middle]
radius_mm = 100
remove = true
holes = 24
available_g_mm = [50, 100]
per_hole = 2
[planes.right]
max_unbalance_g_mm = 500
forbidden_deg = [[20, 60]]
[sensors."probe 1"]
limit = 0.8
[sensors."probe 3"]
limit = 60
"""


def parts_of(path, **options):
    """The job, and everything that is made of it."""
    found = balance(path, BalanceOptions(**options))
    return found.job, found


def sheet_of(path, **options):
    job, found = parts_of(path, **options)
    sheet = read_sheet(found.sheet())
    return sheet.text, sheet, found, job


def turbo_job(folder, more="", job="job.toml"):
    """The sample in another folder, its job with more keys."""
    for name in ("runs.csv", "weights.csv", "check.csv", "check_weights.csv"):
        (folder / name).write_text((DATA / "turbo_job" / name).read_text())
    path = folder / "job.toml"
    path.write_text((DATA / "turbo_job" / job).read_text() + more)
    return path


def hard(folder):
    turbo_job(folder)
    slow = "speed_rpm,sensor,amplitude_um_pp,phase_deg\n150,probe 1,0.3,35\n"
    (folder / "slow.csv").write_text(slow)
    (folder / "hard.toml").write_text(SETTINGS)
    return folder / "hard.toml"


def on_top(folder):
    """A trial run again as a check run, whose weight stays: further pieces in other holes."""
    planes = "".join(
        f"[planes.{p}]\nholes = 12\navailable_g_mm = [100, 200]\n" for p in ("left", "middle", "right")
    )
    path = turbo_job(folder, planes + "taken = { '1' = 800 }\n", "checked.toml")
    head, *lines = (folder / "runs.csv").read_text().splitlines(keepends=True)
    again = [line.replace("trial 3", "check") for line in lines if line.startswith("trial 3")]
    (folder / "check.csv").write_text("".join([head, *again]))
    (folder / "check_weights.csv").write_text("run,plane,unbalance_g_mm,angle_deg\ncheck,right,800,0\n")
    return path
