"""Balancing sheets for the tests: jobs, the sheet each makes, and a reader of its numbers."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

from rotorid.workflows.balance import BalanceOptions, balance

DATA = Path(__file__).parents[2] / "sample_data"
VOID = {"meta", "link", "br", "img", "input", "hr"}
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


class Sheet(HTMLParser):
    """Texts by data-key, ids, references, sections in their order, cells of numbers."""

    def __init__(self, made):
        super().__init__()
        self.open, self.shown, self.ids, self.targets = [], [], [], []
        self.script, self.cells = "", []
        self.feed(made)
        self.document = json.loads(self.script)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if "id" in attrs:
            self.ids.append(attrs["id"])
        for name in ("href", "xlink:href"):
            if name in attrs:
                self.targets.append(attrs[name])
        self.targets += re.findall(r"url\((.*?)\)", " ".join(v or "" for v in attrs.values()))
        if tag == "td":
            self.cells.append({"class": attrs.get("class", ""), "text": "", "keys": 0})
        if "data-key" in attrs:
            self.shown.append([attrs["data-key"], ""])
            if any(t == "td" for t, _ in self.open):
                self.cells[-1]["keys"] += 1
        if tag not in VOID:
            self.open.append((tag, attrs))

    def handle_endtag(self, tag):
        while self.open and self.open.pop()[0] != tag:
            pass

    def handle_data(self, data):
        tags = [tag for tag, _ in self.open]
        if "script" in tags:
            self.script += data
        if tags and tags[-1] == "span" and "data-key" in self.open[-1][1]:
            self.shown[-1][1] += data
        if "td" in tags:
            self.cells[-1]["text"] += data


def value_at(document, key):
    for part in key.split("."):
        document = document[int(part)] if isinstance(document, list) else document[part]
    return document


def parts_of(path, *, grade=(None, None, None), **options):
    """The job, and everything that is made of it."""
    words = dict(zip(("grade", "rotor_mass", "service_speed"), grade, strict=True))
    found = balance(path, BalanceOptions(**words, **options))
    return found.job, found


def sheet_of(path, **options):
    job, found = parts_of(path, **options)
    made = found.sheet().decode()
    return made, Sheet(made), found, job


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
