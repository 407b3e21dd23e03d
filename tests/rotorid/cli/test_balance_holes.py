"""`rotorid balance --split`: pieces in holes, planes where material is removed, and bad holes."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from balancing import correct, estimate_influence, mount
from rotorid.files import read_job
from rotorid.samples import sample_data

TURBO = sample_data() / "turbo_job"
HOLES = TURBO / "holes.toml"


def vector(rows):
    return sum(r["mass"] * np.exp(1j * np.deg2rad(r["angle_deg"])) for r in rows)


@pytest.mark.parametrize("method", ["least-squares", "minmax", "weighted"])
def test_pieces_stand_in_their_holes(cli, method):
    found = cli("balance", HOLES, "--split", "--method", method, "--json")
    assert found.code == 0, found.err
    m = found.json["mounting"]
    assert m["rms_after"] < 0.2 * found.json["rms_before"]
    for plane in m["planes"]:
        own = [r for r in m["holes"] if r["plane"] == plane["plane"]]
        assert all(r["mass"] in (pytest.approx(150), pytest.approx(300)) for r in own)
        assert all(abs((r["angle_deg"] + 15) % 30 - 15) < 1e-6 for r in own)
        total = plane["mass"] * np.exp(1j * np.deg2rad(plane["angle_deg"]))
        assert vector(own) == pytest.approx(total, abs=1e-6)


def test_prediction_of_what_is_mounted():
    job = read_job(HOLES)
    influence = estimate_influence(job.trials)
    found = correct(influence)
    m = mount(found, influence, None, job.holes)
    np.testing.assert_allclose(m.after, found.before + influence.W @ m.weights, rtol=1e-12)
    assert np.sqrt(np.mean(np.abs(m.after) ** 2)) < m.check_rms < 0.2 * np.abs(found.before).max()
    assert np.linalg.norm(m.after) >= np.linalg.norm(found.after)


def job_with(tmp_path, text):
    for name in ("runs.csv", "weights.csv"):
        (tmp_path / name).write_text((TURBO / name).read_text())
    path = tmp_path / "job.toml"
    path.write_text((TURBO / "job.toml").read_text() + text)
    return path


def test_material_removed_is_on_the_other_side(cli, tmp_path):
    hole = "holes = 12\navailable_g_mm = [150]\nper_hole = 2\nstock = [5]\n"
    added = cli("balance", HOLES, "--split", "--json").json
    path = job_with(
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


@pytest.mark.full
def test_table_of_holes_is_written(cli, tmp_path):
    target = tmp_path / "holes.csv"
    assert cli("balance", HOLES, "--split", "--output", target).code == 0
    head = target.read_text(encoding="utf-8-sig").splitlines()[0]
    assert head == "plane,action,hole,angle_deg,mass,unit,pieces"


def test_job_without_holes(cli):
    outcome = cli("balance", TURBO / "job.toml", "--split")
    assert outcome.code == 2
    assert "no plane has holes" in outcome.err


def test_pieces_on_top_of_what_a_check_run_had(cli, tmp_path):
    """The pieces of the first choice are mounted and checked; the next are a small trim in free holes."""
    job = read_job(HOLES)
    first = cli("balance", HOLES, "--split", "--json").json["mounting"]
    influence = estimate_influence(job.trials)
    rows = ["run,plane,unbalance_g_mm,angle_deg"]
    keys = []
    total = np.zeros(3, complex)
    for p, plane in enumerate(influence.planes):
        own = [r for r in first["holes"] if r["plane"] == plane]
        z = vector(own)
        total[p] = z * 1e-6
        keys.append(f"[planes.{plane}]\nholes = 12\navailable_g_mm = [10]\nper_hole = 2\n")
        if not own:
            continue
        rows.append(f"check,{plane},{abs(z):.9g},{np.degrees(np.angle(z)) % 360:.9g}")
        taken = ", ".join(f'"{r["hole"]}" = {r["mass"]:.9g}' for r in own)
        keys.append(f"taken = {{ {taken} }}\n")
    after = influence.baseline + influence.W @ total
    check = ["run,speed_rpm,sensor,amplitude_um_pp,phase_deg"]
    for s, speed in enumerate(influence.speeds * 30 / np.pi):
        for c, sensor in enumerate(influence.sensors):
            z = after[s, c] * 2e6
            check.append(f"check,{speed:.9g},{sensor},{abs(z):.9g},{np.degrees(np.angle(z)) % 360:.9g}")
    path = job_with(tmp_path, "".join(keys))
    (tmp_path / "check.csv").write_text("\n".join(check) + "\n")
    (tmp_path / "check_weights.csv").write_text("\n".join(rows) + "\n")
    both = 'weights = "weights.csv"\ncheck = "check.csv"\ncheck_weights = "check_weights.csv"'
    path.write_text(path.read_text().replace('weights = "weights.csv"', both))
    found = cli("balance", path, "--refine", "--split", "--json")
    assert found.code == 0, found.err
    m = found.json["mounting"]
    assert m["on_top_of"] == "check"
    assert all(p["mass"] < 150 for p in m["planes"])  # of a total of 400
    assert m["rms_after"] < first["rms_after"]
    taken = {(r["plane"], r["hole"]) for r in first["holes"]}
    assert not taken & {(r["plane"], r["hole"]) for r in m["holes"]}
    # the same without saying in which holes the weights of the check run stand
    path.write_text("\n".join(line for line in path.read_text().splitlines() if not line.startswith("taken")))
    outcome = cli("balance", path, "--refine", "--split")
    assert outcome.code == 2
    assert "not named" in outcome.err


def test_the_table_says_where_to_take_material_away(cli, tmp_path):
    """`angle_deg` of a plane with `remove` is the place to drill, not where weight would be added."""
    for name in ("runs.csv", "weights.csv"):
        (tmp_path / name).write_bytes((TURBO / name).read_bytes())
    job, table = tmp_path / "job.toml", tmp_path / "weights_out.csv"
    job.write_text((TURBO / "job.toml").read_text() + "\n[planes.left]\nremove = true\n")
    rows = cli("balance", job, "--json", "--output", table).json["corrections"]
    frame = pd.read_csv(table)
    assert frame.columns[:2].tolist() == ["plane", "action"]
    for row, (_, line) in zip(rows, frame.iterrows(), strict=True):
        assert line["action"] == row["action"]
        turn = (line["angle_deg"] - line["equivalent_added_deg"]) % 360
        assert turn == pytest.approx(180.0 if row["action"] == "remove" else 0.0)
        assert line["equivalent_added_deg"] == pytest.approx(row["angle_deg"])
