"""Pieces taken as mounted in a check run, and what is left to do after it, on a drawn linear machine."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rotorid.commands.balance import balance

HEAD = "run,speed_rpm,sensor,amplitude_mm_s_rms,phase_deg\n"
WEIGHTS = "run,plane,mass_g,angle_deg\n"
PLANES = "".join(f"[planes.{p}]\nholes = 8\navailable_g = [4, 8]\nstock = [2, 2]\n" for p in ("P1", "P2"))
KEYS = 'runs = "runs.csv"\nweights = "weights.csv"\nphase = "lead"\nangles = "with rotation"\n'


class Machine:
    """Two planes, two sensors, weights in g; readings with errors of 1 % and 0.57°."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.folder, self.rng = folder, np.random.default_rng(seed)
        coupling = self.rng.normal(size=(2, 2)) + 1j * self.rng.normal(size=(2, 2))
        self.W = 0.02 * coupling + np.diag([0.2, 0.2])
        self.D = self.rng.uniform(6, 14, 2) * np.exp(2j * np.pi * self.rng.random(2))
        mounted = {"0": (0, 0), "1": (10, 0), "2": (0, 10), "3": (0, 0)}
        rows = [self.row(run, np.array(weights)) for run, weights in mounted.items()]
        (folder / "runs.csv").write_text(HEAD + "".join(rows))
        (folder / "weights.csv").write_text(f"{WEIGHTS}1,P1,10,0\n2,P2,10,0\n")

    def row(self, run: str, weights: np.ndarray) -> str:
        """Readings with these weights (g) mounted."""
        exact = self.W @ (weights - self.D)
        read = exact * (1 + 0.01 * (self.rng.normal(size=2) + 1j * self.rng.normal(size=2)))
        angles = np.degrees(np.angle(read)) % 360
        rows = zip("AB", np.abs(read), angles, strict=True)
        return "".join(f"{run},1480,{s},{size:.5g},{angle:.2f}\n" for s, size, angle in rows)

    def job(self, more: str = "") -> Path:
        """A job file with further keys."""
        path = self.folder / "job.toml"
        path.write_text(f"{KEYS}{more}[errors]\namplitude_percent = 1\nphase_deg = 0.573\n{PLANES}")
        return path

    def checked(self, weights: np.ndarray, more: str = "") -> Path:
        """The job after a check run with these weights, g."""
        (self.folder / "check.csv").write_text(HEAD + self.row("check", weights))
        return self.job(f'check = "check.csv"\n{more}')


def test_the_job_says_otherwise(tmp_path: Path) -> None:
    machine = Machine(tmp_path, 5)
    weights = balance(machine.job()).result.weights
    rows = zip(("P1", "P2"), 1e3 * np.abs(weights), np.degrees(np.angle(weights)) % 360, strict=True)
    (tmp_path / "exact.csv").write_text(WEIGHTS + "".join(f"check,{p},{m},{a}\n" for p, m, a in rows))
    found = balance(machine.checked(1e3 * weights, 'check_weights = "exact.csv"\n'))
    assert found.check is not None
    np.testing.assert_allclose(found.check.weights, [weights], rtol=1e-12)
    assert found.check.explained
    (tmp_path / "mounted.csv").write_text(f"{WEIGHTS}check,P1,6,30\n")
    table = balance(
        machine.checked(np.array([6 * np.exp(1j * np.pi / 6), 0]), 'check_weights = "mounted.csv"\n')
    )
    assert table.check is not None
    assert table.check.explained
    assert not table.check.as_proposed
    assert table.left is not None
    assert table.left.word == "trim"
    total = 1e3 * (table.left.there + table.left.trim)
    np.testing.assert_allclose(total, machine.D, atol=0.6)


def test_worse_than_the_bare_rotor_is_taken_off(tmp_path: Path) -> None:
    machine = Machine(tmp_path, 7)
    found = balance(machine.checked(-1.5 * machine.D))
    assert found.left is not None
    assert found.left.word == "take off what is mounted"
    assert not found.left.trim.any()
    assert "Take off what is mounted" in found.answer.judgement.splitlines()[0]
