"""`rotorid balance --split`: pieces in holes, planes where material is removed, and bad holes."""

from __future__ import annotations

import re

import pandas as pd
import pytest
from balance_sheets import turbo_job

from rotorid.samples import sample_data

HOLES = sample_data() / "turbo_job/holes.toml"


def test_material_removed_is_on_the_other_side(cli, tmp_path):
    hole = "holes = 12\navailable_g_mm = [150]\nper_hole = 2\nstock = [5]\n"
    added = cli("balance", HOLES, "--split", "--json").json
    path = turbo_job(
        tmp_path, "".join(f"[planes.{p}]\n{hole}remove = true\n" for p in ("left", "middle", "right"))
    )
    gone = cli("balance", path, "--split", "--json").json
    for a, b in zip(added["corrections"], gone["corrections"], strict=True):
        assert b["action"] == "remove"
        assert b["remove_at_deg"] == pytest.approx((a["angle_deg"] + 180) % 360)
        assert (a["mass"], a["angle_deg"]) == (b["mass"], b["angle_deg"])
    # twelve holes are symmetric: the pieces come out of the opposite holes
    places = {
        (r["plane"], round((r["angle_deg"] + 180) % 360) % 360, round(r["mass"]))
        for r in added["mounting"]["holes"]
    }
    assert {
        (r["plane"], round(r["angle_deg"]) % 360, round(r["mass"])) for r in gone["mounting"]["holes"]
    } == places
    assert "(remove)" in cli("balance", path).out


def test_the_table_says_where_to_take_material_away(cli, tmp_path):
    """`angle_deg` of a plane with `remove` is the place to drill, not where weight would be added."""
    job, table = turbo_job(tmp_path, "\n[planes.left]\nremove = true\n"), tmp_path / "weights_out.csv"
    rows = cli("balance", job, "--json", "--output", table).json["corrections"]
    frame = pd.read_csv(table)
    assert frame.columns[:2].tolist() == ["plane", "action"]
    for row, (_, line) in zip(rows, frame.iterrows(), strict=True):
        assert line["action"] == row["action"]
        turn = (line["angle_deg"] - line["equivalent_added_deg"]) % 360
        assert turn == pytest.approx(180.0 if row["action"] == "remove" else 0.0)
        assert line["equivalent_added_deg"] == pytest.approx(row["angle_deg"])


@pytest.mark.parametrize("remove", [False, True])
def test_a_split_says_how_sure_it_is_and_which_hole_is_the_first(cli, tmp_path, remove):
    holes = f"holes = 12\navailable_g_mm = [150]\nremove = {str(remove).lower()}\n"
    job = turbo_job(tmp_path, "".join(f"[planes.{p}]\n{holes}" for p in ("left", "middle", "right")))
    sheet, table = tmp_path / "s.html", tmp_path / "pieces.csv"
    outcome = cli("balance", job, "--split", "--angles", "against", "--report", sheet, "--output", table)
    words, page = " ".join(outcome.out.split()), sheet.read_text("utf-8")
    places = {False: 191.1, True: 11.1}  # 168.9° counted against the rotation, and opposite
    for text in (
        "Angles from the mark against the rotation: holes 1 at 0°, 2 at 30°.",
        f"Weights at any angle: left 423.0 ± 31 at {places[remove]}° ± 5.8°, middle",
    ):
        assert text in words
    most = float(re.search(r"rms 28.4 → (\S+) µm pp; a check run stays below (\S+) in", words)[2])
    assert 1.0 < most / cli("balance", job, "--split", "--json").json["mounting"]["rms_after"] < 1.3
    assert re.search(r"<p class=.note.>Errors between runs", page)
    assert set(pd.read_csv(table)["mass"]) <= {150.0, 300.0}
