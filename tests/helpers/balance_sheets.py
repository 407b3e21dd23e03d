"""Balancing sheets for the tests: jobs, and the sheet each makes."""

from pathlib import Path

from sheets import read_sheet

from rotorid.commands.balance import BalanceOptions, balance

DATA = Path(__file__).parents[2] / "sample_data"
SETTINGS = """
runs = "runs.csv"
weights = "weights.csv"
phase = "lag"
angles = "counter-clockwise"
rotation = "clockwise"
view = "drive end"
[key_phasor]
angle_deg = 40
[errors]
amplitude_percent = 1
phase_deg = 1
[slow_roll."probe 1"]
amplitude = 0.3
phase_deg = 35
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


def hard(folder, drop=""):
    for name in ("runs.csv", "weights.csv"):
        (folder / name).write_text((DATA / "turbo_job" / name).read_text())
    (folder / "hard.toml").write_text(SETTINGS.replace(drop, "") if drop else SETTINGS)
    return folder / "hard.toml"


def on_top(folder):
    """After a check run whose weights stay: further pieces in other holes."""
    for name in ("runs.csv", "weights.csv", "check.csv", "check_weights.csv"):
        (folder / name).write_text((DATA / "turbo_job" / name).read_text())
    planes = "".join(
        f"[planes.{plane}]\nholes = 12\navailable_g_mm = [5, 10]\ntaken = {{ '{hole}' = {size} }}\n"
        for plane, hole, size in (("left", 7, 417), ("middle", 10, 282), ("right", 1, 448))
    )
    (folder / "job.toml").write_text((DATA / "turbo_job" / "checked.toml").read_text() + planes)
    return folder / "job.toml"
