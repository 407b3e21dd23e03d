"""Types of machines: `fleet fit`, and `balance --type` from the files to the answer."""

import shutil

import numpy as np
import pandas as pd
import pytest

from balancing import UndeterminedError
from rotorid.commands.balance import BalanceOptions, balance
from rotorid.files import read_job
from rotorid.fleet import fleet_fit
from rotorid.fleet.jobs import read_fleet
from rotorid.fleet.machine_type import type_coefficients

pytest.importorskip("pyarrow", reason="without the extra rotorid[fleet]")
SPEED, SENSORS, PLANES = 1490.0, ("S1", "S2"), ("L", "R")


def cn(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


class Machine:
    """A drawn fan, and its jobs as people write them: µm pp, lag, g, angles against the rotation."""

    MEAN = np.array([[3 + 2j, 0.6 + 0.9j], [-2 + 1j, 2.5 + 0.5j]])  # µm pp per g

    def __init__(self, rng, along=0.1, degrees=10.0):
        n = self.MEAN.shape
        turn = np.exp(1j * np.radians(degrees) * rng.standard_normal(n))
        self.W = self.MEAN * (1 + along * rng.standard_normal(n)) * turn
        self.rng, self.D = rng, 5 * cn(rng, 2)

    def job(self, folder, runs=3, check=False, within=0.0, more=""):
        rng = self.rng
        W = self.W * (1 + within * cn(rng, 2, 2))
        T = np.array([[0, 0], [8 * np.exp(0.5j), 0], [0, 8 * np.exp(2j)]])[:runs]
        folder.mkdir(parents=True)
        self._table(folder / "runs.csv", W, T)
        lines = f'runs = "runs.csv"\nphase = "lag"\nangles = "against rotation"\n{more}'
        if runs > 1:
            self._weights(folder / "weights.csv", T)
            lines = f'weights = "weights.csv"\n{lines}'
        else:
            lines = f'machine_type = "fan"\n{lines}'
        if check:
            mounted = 0.9 * self.D[None]
            self._table(folder / "check.csv", W, mounted, "check")
            self._weights(folder / "check_weights.csv", mounted, "check")
            lines = f'check = "check.csv"\ncheck_weights = "check_weights.csv"\n{lines}'
        (folder / "job.toml").write_text(f"{lines}[errors]\namplitude_percent = 1\nphase_deg = 0.6\n")
        return folder / "job.toml"

    def _table(self, path, W, T, name="run"):
        lines = ["run,speed_rpm,sensor,amplitude_um_pp,phase_deg"]
        for r, Y in enumerate((T - self.D) @ W.T):
            Y = Y * (1 + 0.01 * cn(self.rng, 2))
            phase = -np.degrees(np.angle(Y)) % 360
            lines += [f"{name} {r},{SPEED},{SENSORS[c]},{abs(Y[c]):.4f},{phase[c]:.3f}" for c in (0, 1)]
        path.write_text("\n".join(lines) + "\n")

    def _weights(self, path, T, name="run"):
        lines = ["run,plane,mass_g,angle_deg"]
        for r, p in np.argwhere(T):
            angle = -np.degrees(np.angle(T[r, p])) % 360
            lines.append(f"{name} {r},{PLANES[p]},{abs(T[r, p]):.6f},{angle:.6f}")
        path.write_text("\n".join(lines) + "\n")


def fit(tree, file):
    """The outcome of a fit, and the table of the fleet in a file."""
    outcome = fleet_fit(tree)
    file.write_bytes(outcome.written(file))
    return outcome


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """A table of 25 machines, five of them balanced three times."""
    folder, rng = tmp_path_factory.mktemp("types"), np.random.default_rng(11)
    machines = [Machine(rng) for _ in range(25)]
    for k, machine in enumerate(machines):
        for day in range(3 if k < 5 else 1):
            machine.job(folder / "tree" / "fan" / f"F{k}" / f"2026-01-0{day + 1}", within=0.03)
    assert fit(folder / "tree", folder / "fans.parquet").to_dict()["types"] == {"fan": 35}
    return folder, machines


def address(fleet):
    return f"{fleet[0] / 'fans.parquet'}:fan"


def coefficients_of(job, table):
    read = read_job(job)
    return type_coefficients(read, table, read.trials)


def test_a_fit_gives_back_what_was_drawn(fleet):
    outcome = fleet_fit(fleet[0] / "tree")
    table = outcome.to_frame()
    assert len(outcome.result.machines) == 25
    mean = Machine.MEAN.ravel()
    W = table["influence"] * np.exp(1j * np.radians(table["phase_deg"]))
    assert np.abs(W.to_numpy() / mean - 1).max() < 0.12  # 0.1/√25 and 10°/√25, four deviations
    assert np.sqrt((table["between_percent"] ** 2).mean()) == pytest.approx(10, rel=0.3)
    assert np.sqrt((table["between_deg"] ** 2).mean()) == pytest.approx(10, rel=0.3)
    assert np.sqrt((table["within_percent"] ** 2).mean()) == pytest.approx(3, rel=0.5)
    assert outcome.to_dict()["jobs"] == 35


def test_the_first_shot_needs_nothing_but_a_baseline(fleet, tmp_path):
    machine = Machine(np.random.default_rng(21))
    answer = balance(machine.job(tmp_path / "new", runs=1), BalanceOptions(machine_type=address(fleet)))
    left = machine.W @ (answer.result.weights * 1e3 - machine.D)
    assert np.linalg.norm(left) < 0.4 * np.linalg.norm(machine.W @ machine.D)
    assert (answer.result.planes, answer.result.labels.weight_unit) == (PLANES, "g")
    assert answer.to_dict()["of_type"]["machines"] == 25


def test_jobs_of_the_machine_count_but_never_the_same_runs(fleet, tmp_path):
    folder, machines = fleet

    def knowledge(job):
        return coefficients_of(job, address(fleet))

    own = folder / "tree" / "fan" / "F2" / "2026-01-01" / "job.toml"
    assert knowledge(own).earlier == 2
    assert knowledge(shutil.copytree(own.parent, tmp_path / "elsewhere") / "job.toml").earlier == 0
    assert len(knowledge(folder / "tree" / "fan" / "F7" / "2026-01-01" / "job.toml").kind.machines) == 24
    first = knowledge(machines[2].job(tmp_path / "F2" / "2026-05-05", runs=1))
    other = knowledge(machines[2].job(tmp_path / "X", runs=1))
    assert (first.earlier, other.earlier) == (3, 0)
    near, far = (
        np.trace(one.influence.channels()[..., 2:, 2:], axis1=2, axis2=3).sum() for one in (first, other)
    )
    assert near < 0.3 * far


def test_copies_count_once_and_one_job_a_machine_tells_nothing_within(tmp_path):
    rng = np.random.default_rng(29)
    for name in ("P1", "P2", "P3"):
        Machine(rng).job(tmp_path / "tree" / "a" / name / "2026-02-03")
    shutil.copytree(tmp_path / "tree" / "a" / "P2", tmp_path / "tree" / "a" / "copy of P2")
    outcome = fit(tmp_path / "tree", tmp_path / "f.parquet")
    assert len(outcome.result.machines) == 3
    assert outcome.to_dict()["left_out"] == 1
    assert outcome.to_dict()["rows"][0]["within_percent"] is None
    assert "± within a machine is not determined by one job a machine" in outcome.notes


def test_a_machine_of_another_kind_is_not_to_be_balanced_so(fleet, tmp_path):
    machine = Machine(np.random.default_rng(24))
    machine.W = machine.W * np.exp(1j * np.radians(100))
    answer = balance(machine.job(tmp_path / "turned"), BalanceOptions(machine_type=address(fleet)))
    assert answer.answer.judgement.startswith("Do not mount these weights: by its runs this machine is not")
    assert not answer.to_dict()["of_type"]["of_type"]


def test_limits_and_planes_of_a_job_hold(fleet, tmp_path):
    machine = Machine(np.random.default_rng(26))
    job = machine.job(tmp_path / "job", runs=1, more="[planes.L]\nmax_mass_g = 1\n[planes.R]\n")
    result = balance(job, BalanceOptions(machine_type=address(fleet))).result
    assert abs(result.weights[0]) == pytest.approx(1e-3, rel=1e-4)
    job = machine.job(tmp_path / "other", more="[planes.L]\nuse = false\n")
    assert balance(job, BalanceOptions(machine_type=address(fleet))).result.planes == ("R",)


def test_masses_at_another_radius_are_of_another_kind(tmp_path):
    rng = np.random.default_rng(31)
    at = "[planes.L]\nradius_mm = {0}\n[planes.R]\nradius_mm = {0}\n".format
    for k in range(5):
        Machine(rng).job(tmp_path / "tree" / "fan" / f"F{k}", more=at(150 if k == 3 else 100))
    outcome = fit(tmp_path / "tree", tmp_path / "f.parquet")
    assert outcome.to_dict()["machines"] == ["F0", "F1", "F2", "F4"]
    table = f"{tmp_path / 'f.parquet'}:fan"
    job = Machine(rng).job(tmp_path / "new", runs=1, more=at(100))
    assert len(coefficients_of(job, table).kind.machines) == 4
    job = Machine(rng).job(tmp_path / "other", runs=1, more=at(200))
    with pytest.raises(UndeterminedError, match="mounted mass at 100 mm and mass at 150 mm"):
        coefficients_of(job, table)


def test_what_is_wrong_is_refused(fleet, tmp_path):
    machine, store = Machine(np.random.default_rng(27)), fleet[0] / "fans.parquet"
    job = machine.job(tmp_path / "new", runs=1)

    def refused(text, error=ValueError, **options):
        with pytest.raises(error, match=text):
            balance(job, BalanceOptions(**options))

    refused("expected the table of a fleet and a type, FLEET.parquet:TYPE", machine_type="fan")
    refused("none: expected a file that exists", machine_type=f"{tmp_path / 'none'}:fan")
    refused("a table of a fleet .it is damaged", machine_type=f"{job}:fan")
    pd.read_parquet(store).drop(columns="std").to_parquet(tmp_path / "other.parquet")
    refused("expected the table that rotorid fleet fit", machine_type=f"{tmp_path / 'other.parquet'}:fan")
    refused("the type .fun. is not known .did you mean .fan.", machine_type=f"{store}:fun")
    refused("no check runs to refine with", machine_type=address(fleet), refine=True)
    refused("balance it from its type .rotorid balance --type FLEET:fan.", UndeterminedError)
    table = pd.read_csv(job.parent / "runs.csv")
    for changed, words in (
        (table.assign(sensor=["S1", "S9"]), "sensor S1 and S2, quantity displacement, plane L and R"),
        (table.rename(columns={"amplitude_um_pp": "amplitude_mm_s"}), "quantity displacement"),
    ):
        changed.to_csv(job.parent / "runs.csv", index=False)
        refused(words, UndeterminedError, machine_type=address(fleet))


def test_a_tree_holds_other_files_too(tmp_path):
    rng, fans = np.random.default_rng(41), tmp_path / "tree" / "fan"
    for k in range(4):
        Machine(rng).job(fans / f"F{k}")
    (fans / "F0" / "job.toml").write_text('machine = "7"\n' + (fans / "F0" / "job.toml").read_text())
    Machine(rng).job(fans / "F4", runs=1)
    (fans / "rotor.toml").write_text("shaft = 'shaft.csv'")
    (fans / "broken.toml").write_text("a = ")
    Machine(rng).job(fans / "F5").write_text('runs = "none.csv"\nweights = "weights.csv"\n')
    Machine(rng).job(fans / ".F6")
    document = fit(tmp_path / "tree", tmp_path / "f.parquet").to_dict()
    assert document["machines"] == ["7", "F1", "F2", "F3"]
    assert set(document["damaged"]) == {"fan/broken.toml", "fan/F5/job.toml"}
    assert "none.csv" in document["damaged"]["fan/F5/job.toml"]
    assert document["undetermined"] == ["fan/F4/job.toml"]
    jobs = {f"fan/F{k}/job.toml" for k in range(4)}
    assert set(read_fleet(tmp_path / "f.parquet")["job"]) == jobs


@pytest.mark.parametrize("stated", [True, False])
def test_assumed_errors_do_not_lower_the_scatter_between_machines(tmp_path, stated):
    rng = np.random.default_rng(43)
    for k in range(12):
        job = Machine(rng, 0.02, 1.0).job(tmp_path / "tree" / "fan" / f"F{k}")
        text = job.read_text()
        job.write_text(text if stated else text[: text.index("[errors]")])
    outcome = fit(tmp_path / "tree", tmp_path / "f.parquet")
    assert (read_fleet(tmp_path / "f.parquet")["std"] > 0).all() == stated
    assert any("12 jobs without errors" in note for note in outcome.notes) != stated
    between = np.sqrt((outcome.to_frame()["between_percent"] ** 2).mean())
    assert between > (0 if stated else 1.5)
