"""Rows of jobs: numbers by hand, in every unit and convention; readings of the store as they were read."""

import datetime
import shutil

import numpy as np
import openpyxl
import pandas as pd
import pytest
from cases import each_of
from workbook_jobs import as_workbook

from balancing import estimate_influence
from rotorid.fleet.adding import FleetAddOptions, fleet_add
from rotorid.samples import sample_data
from rotorid.tables import read_job
from rotorid.tables.fleet.fleet_store import FleetStore, trials_of

pytest.importorskip("pyarrow", reason="without the extra rotorid[fleet]")
FLEET = sample_data() / "fleet"
MIL, OUNCE = 25.4e-6, 0.028349523125


@pytest.fixture(scope="module")
def fans(tmp_path_factory):
    """The sample, as a store."""
    folder = tmp_path_factory.mktemp("fleet") / "fans"
    added = fleet_add(folder, [FLEET])
    assert (added.result.jobs, added.result.known, added.result.damaged) == (9, 0, {})
    return FleetStore(folder)


def of(store, name, machine):
    """Rows of one machine."""
    jobs = store.table("jobs")
    return store.table(name, jobs=jobs["job"][jobs["machine"] == machine])


def cell(table, column, **where):
    """The only cell of a row."""
    for name, value in where.items():
        table = table[table[name] == value]
    assert len(table) == 1
    return table[column].iloc[0]


def lines(machine, name):
    """A table of the sample as pandas reads it."""
    frame = pd.read_csv(FLEET / "fan-132" / machine / name)
    assert len(frame)
    return frame


@each_of(
    "machine, si, lead, with_rotation, kg",
    [
        ("132-01", 0.5e-6, -1, 1, 1e-3),  # µm pp, lag, with rotation, g
        ("132-03", 1e-6, 1, -1, 1e-3),  # µm, lead, against rotation
        ("132-04", MIL / 2, -1, 1, OUNCE),
        ("132-07", 0.5e-6, 1, 1, 1e-3),  # as the job says, wrongly
        ("132-08", 0.5e-6, -1, -1, 1e-3),
    ],
)
def test_readings_weights_and_coefficients_are_those_of_the_files(fans, machine, si, lead, with_rotation, kg):
    written, stored = lines(machine, "runs.csv"), of(fans, "readings", machine)
    stored = stored[stored["kind"] == "trial"]
    assert stored["run"].tolist() == written["run"].tolist()
    assert stored["sensor"].tolist() == written["sensor"].tolist()
    assert stored["speed_rad_s"].to_numpy() == pytest.approx(written["speed_rpm"] * np.pi / 30)
    size = written.filter(like="amplitude").iloc[:, 0]
    assert stored["amplitude"].to_numpy() == pytest.approx(size * si, rel=1e-12)
    assert stored["phase_deg"].to_numpy() == pytest.approx(lead * written["phase_deg"] % 360, abs=1e-9)
    assert stored["repeat"].tolist() == [1] * len(written)
    mounted = of(fans, "weights", machine)
    trial = lines(machine, "weights.csv").filter(like="mass").iloc[0, 0] * kg
    assert cell(mounted, "weight", kind="trial", run="trial DE", plane="DE") == pytest.approx(trial)
    assert cell(mounted, "weight", kind="trial", run="trial DE", plane="NDE") == 0
    if (FLEET / "fan-132" / machine / "check_weights.csv").exists():
        checked = lines(machine, "check_weights.csv").iloc[0]
        angle = checked["angle_deg"] * with_rotation % 360
        for table in (mounted[mounted["kind"] == "check"], of(fans, "corrections", machine)):
            assert cell(table, "angle_deg", plane="DE") == pytest.approx(angle)
            assert cell(table, "weight", plane="DE") == pytest.approx(
                checked.filter(like="mass").iloc[0] * kg
            )
    # with three runs the coefficients follow from two readings: (trial − as found) / trial weight
    z = stored["amplitude"] * np.exp(1j * np.radians(stored["phase_deg"]))
    as_found, trial_de, _ = z.to_numpy().reshape(3, 2, 2)
    found = of(fans, "coefficients", machine)
    W = (found["re"] + 1j * found["im"]).to_numpy().reshape(2, 2, 2)
    assert W[..., 0] == pytest.approx((trial_de - as_found) / trial, rel=1e-9)
    assert set(found["source"]) == {"measured"}
    outcomes = of(fans, "outcomes", machine)
    if len(outcomes):
        assert outcomes["before"].to_numpy() == pytest.approx(np.abs(as_found).ravel(), rel=1e-9)
        after = lines(machine, "check.csv").filter(like="amplitude").iloc[:, 0] * si
        assert outcomes["after"].to_numpy() == pytest.approx(after, rel=1e-9)
        assert outcomes["limit"].isna().all()


def test_the_variance_is_that_of_the_coefficients(fans):
    influence = estimate_influence(read_job(FLEET / "fan-132" / "132-05" / "job.toml").trials)
    found = of(fans, "coefficients", "132-05")
    row = found[(found["sensor"] == "B") & (found["plane"] == "NDE")].iloc[1]
    own = influence.channels()[1, 1, 4:, 4:]
    assert row[["var_re", "cov_re_im", "var_im"]].tolist() == pytest.approx([own[0, 0], own[0, 1], own[1, 1]])


def test_proposed_corrections_are_those_of_balance(fans, cli):
    said = cli("balance", FLEET / "fan-132" / "132-02" / "job.toml", "--json").json["corrections"]
    rows = of(fans, "corrections", "132-02")
    assert not rows["mounted"].any()
    assert of(fans, "corrections", "132-01")["mounted"].all()
    assert "check" not in set(of(fans, "weights", "132-02")["kind"])
    for row in said:
        assert cell(rows, "weight", plane=row["plane"]) == pytest.approx(row["mass"] * 1e-3)
        assert cell(rows, "angle_deg", plane=row["plane"]) == pytest.approx(row["angle_deg"])


def test_jobs_say_what_they_are(fans):
    job = fans.table("jobs").set_index("machine").loc["132-04"]
    assert job["path"] == "fan-132/132-04/job.toml"
    assert (job["machine_type"], job["date"]) == ("fan-132", datetime.date(2026, 2, 19))
    assert (job["quantity"], job["weight_kind"]) == ("displacement", "mass")
    assert (job["vibration_unit"], job["weight_unit"]) == ("mil_pp", "oz")
    assert (job["trial_runs"], job["check_runs"], job["vectors"]) == (3, 1, 16)
    assert (len(job["files"]), job["files"][1], job["undetermined"]) == (5, job["runs_file"], "")


def same(a, b):
    for name in ("runs", "sensors", "planes"):
        assert getattr(a, name) == getattr(b, name)
    for name in ("speeds", "readings", "weights", "covariance"):
        own, other = getattr(a, name), getattr(b, name)
        assert (own is None) == (other is None), name
        if own is not None:
            assert own == pytest.approx(other, rel=1e-12, abs=1e-18, nan_ok=True), name


def test_trials_come_back_as_they_were_read(tmp_path):
    """Of jobs with repeats (also unequal ones), with standard deviations, and of unbalances."""
    uneven = tmp_path / "tree" / "uneven"
    shutil.copytree(sample_data() / "rk4", uneven)
    rows = (uneven / "runs.csv").read_text("utf-8").splitlines()
    (uneven / "runs.csv").write_text("\n".join(rows[:-1]) + "\n", "utf-8")
    names = ("rk4", "waveforms", "turbo_job", "left_in")
    added = fleet_add(tmp_path / "F", [tmp_path / "tree", *(sample_data() / name for name in names)])
    assert added.result.damaged == {}
    store = FleetStore(tmp_path / "F")
    jobs = store.table("jobs")
    places = {"uneven": uneven, **{name: sample_data() / name for name in names}}
    kinds = set()
    for _, row in jobs.iterrows():
        job = read_job(places[row["machine"]] / row["path"].rpartition("/")[2])
        trials = trials_of(store, row["job"])
        same(trials, job.trials)
        kinds |= {row["weight_kind"], len(trials.readings) > 1, trials.covariance is None}
    assert kinds == {"mass", "unbalance", True, False}
    repeats = trials_of(store, jobs["job"][jobs["path"] == "uneven/job.toml"].iloc[0]).repeats
    assert repeats.min() < repeats.max()
    with pytest.raises(ValueError, match="there is no job 'none'"):
        trials_of(store, "none")


def test_stored_coefficients_and_runs_that_determine_none(tmp_path, cli):
    job = FLEET / "fan-132" / "132-01"
    assert cli("balance", job / "job.toml", "--save-influence", tmp_path / "w.csv").code == 0
    for name in ("stored", "none"):
        shutil.copytree(job, tmp_path / "tree" / name)
    text = (job / "job.toml").read_text("utf-8")
    shutil.copy(tmp_path / "w.csv", tmp_path / "tree" / "stored")
    (tmp_path / "tree" / "stored" / "job.toml").write_text('influence = "w.csv"\n' + text, "utf-8")
    weights = tmp_path / "tree" / "none" / "weights.csv"
    weights.write_text(weights.read_text("utf-8").replace("trial NDE", "trial DE"), "utf-8")
    (tmp_path / "tree" / "none" / "check_weights.csv").write_text("run,plane,mass_g,angle_deg\n", "utf-8")
    fleet_add(tmp_path / "F", [tmp_path / "tree"])
    store = FleetStore(tmp_path / "F")
    jobs = store.table("jobs").set_index("machine")
    assert "separates plane 'DE' from plane 'NDE'" in jobs.loc["none", "undetermined"]
    assert of(store, "coefficients", "none").empty
    assert of(store, "outcomes", "none")["before"].isna().all()
    assert set(of(store, "coefficients", "stored")["source"]) == {"stored"}
    # the bare rotor, whatever run it is taken from
    found = lines("132-01", "runs.csv").iloc[:4]["amplitude_um_pp"] * 0.5e-6
    assert of(store, "outcomes", "stored")["before"].to_numpy() == pytest.approx(found, rel=0.02)


def test_the_bare_rotor_is_that_of_the_job_also_where_no_corrections_are_found(tmp_path, cli):
    """Coefficients of another machine, and limits that cannot be met."""
    other, own = FLEET / "fan-132" / "132-01", tmp_path / "tree" / "own"
    shutil.copytree(FLEET / "fan-132" / "132-02", own)
    assert cli("balance", other / "job.toml", "--save-influence", own / "w.csv").code == 0
    text = 'influence = "w.csv"\n' + (own / "job.toml").read_text("utf-8")
    text += "".join(f"\n[planes.{plane}]\nmax_mass_g = 0.01\n" for plane in ("DE", "NDE"))
    text += "".join(f"[sensors.{sensor}]\nlimit = 0.001\n" for sensor in ("A", "B"))
    (own / "job.toml").write_text(text, "utf-8")
    fleet_add(tmp_path / "F", [tmp_path / "tree"])
    store = FleetStore(tmp_path / "F")
    assert "no corrections are proposed: the limits" in store.table("jobs")["warnings"][0][0]
    assert store.table("corrections").empty
    found = lines("132-02", "runs.csv").iloc[:4]["amplitude_um_pp"] * 0.5e-6
    assert store.table("outcomes")["before"].to_numpy() == pytest.approx(found, rel=0.06)


def test_workbooks_are_jobs_with_machine_and_date_in_their_cells(tmp_path):
    book = tmp_path / "tree" / "own" / "job.xlsx"
    book.parent.mkdir(parents=True)
    source = sample_data() / "turbo_job"
    as_workbook(source / "checked.toml", book)
    made = openpyxl.load_workbook(book)
    for key, value in (("machine", 4711), ("date", datetime.date(2026, 3, 17)), ("machine_type", "pump")):
        made["settings"].append([key, value])
    made.save(book)
    added = fleet_add(tmp_path / "F", [tmp_path / "tree", source / "checked.toml"])
    assert (added.result.jobs, added.result.damaged) == (2, {})
    store = FleetStore(tmp_path / "F")
    jobs = store.table("jobs")
    assert jobs["machine"].tolist() == ["4711", "turbo_job"]
    assert (jobs["date"][0], jobs["machine_type"][0]) == (datetime.date(2026, 3, 17), "pump")
    assert jobs["runs_file"][0] == jobs["files"][0][0]
    for name in ("readings", "weights", "coefficients", "corrections", "outcomes"):
        one, other = (store.table(name, jobs=[job]).drop(columns="job") for job in jobs["job"])
        pd.testing.assert_frame_equal(one, other, rtol=1e-9)


@each_of(
    "folders, said, option, expected",
    [
        ("pump/7", "", "", ("7", "pump", None)),
        ("pump/7/2026-03-17", "", "", ("7", "pump", datetime.date(2026, 3, 17))),
        ("pump/2026-03-17 7", 'machine = 7\nmachine_type = "p"', "x", ("7", "p", datetime.date(2026, 3, 17))),
        ("7", "date = 2026-03-18T10:00:00", "", ("7", "", datetime.date(2026, 3, 18))),
        ("2026-13-17", 'machine = "7"', "x", ("7", "x", None)),
    ],
)
def test_machine_type_and_date(tmp_path, folders, said, option, expected):
    folder = tmp_path / "tree" / folders
    shutil.copytree(FLEET / "fan-132" / "132-08", folder)
    text = (folder / "job.toml").read_text("utf-8").partition("\n")[2]
    (folder / "job.toml").write_text(f"{said}\n{text}", "utf-8")
    added = fleet_add(tmp_path / "F", [tmp_path / "tree"], FleetAddOptions(machine_type=option or None))
    (job,) = FleetStore(tmp_path / "F").table("jobs").to_dict("records")
    assert (job["machine"], job["machine_type"], job["date"]) == expected
    assert added.result.untyped == (not expected[1])
