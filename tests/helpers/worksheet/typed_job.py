"""Jobs of the sample data, typed into an empty worksheet."""

import csv

from worksheet.window import SPACE


def rows(path):
    """Of a table, without its comments, each by column."""
    lines = [line for line in path.read_text(encoding="utf-8-sig").splitlines() if line[:1] != "#"]
    return list(csv.DictReader(lines))


def type_job(window, sample, radius=None):
    """A job of one speed by keyboard, from an empty folder; the first run is the page's baseline."""
    runs, weights = rows(sample / "runs.csv"), rows(sample / "weights.csv")
    names = list(dict.fromkeys(row["run"] for row in runs))
    own = {name: [row for row in runs if row["run"] == name] for name in names}
    window.type('[name="sensors"]', ", ".join(row["sensor"] for row in own[names[0]]))
    window.type('[name="speeds"]', runs[0]["speed_rpm"])
    window.push("#setup button")
    window.push('[id="phase lead"]', SPACE)
    window.push('[id="angles with rotation"]', SPACE)
    for name in names:
        card = f'[id="run {name}"]' if name != names[0] else "#baseline"
        mounted = [row for row in weights if row["run"] == name]
        if mounted:
            window.type('#new-run [name="name"]', name)
            window.type('#new-run [name="plane"]', mounted[0]["plane"])
            window.push("#new-run button")
        for k, weight in enumerate(mounted, 1):
            cell = f'{card} tr:nth-child({k}) [id^="weights|"]'
            if k > 1:
                window.push(f"{card} > button")
                window.type(f'{cell}[id$="|plane"]', weight["plane"])
            window.type(f'{cell}[id$="|mass_g"]', weight["mass_g"])
            window.next(weight["angle_deg"])
        first, *others = (text for row in own[name] for text in (row["amplitude"], row["phase_deg"]))
        window.type(f'{card} [id^="runs|"]', first)
        for text in others:
            window.next(text)
        window.leave()
    for plane in dict.fromkeys(row["plane"] for row in weights) if radius else ():
        window.type(f'[id="planes|{plane}|radius_mm"]', str(radius))
        window.leave()
    window.saved()
