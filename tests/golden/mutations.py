"""Eight wrong formulas, and whether the net sees them: `make golden-mutations`."""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from golden.cases import CASES
from golden.comparing import compare
from golden.parent import apart
from golden.running import HERE, run
from golden.storing import read, storable

PRODUCT = ("fem", "balancing", "rotorid", "sample_data")


@dataclass(frozen=True)
class Mutation:
    """A wrong formula: `new` instead of `old`, once in a file; and stored cases that reach it."""

    name: str
    cases: str
    file: str
    old: str
    new: str

    def apply(self, tree: Path) -> None:
        """Write it into a tree; ValueError where the file is not as it was when this was written."""
        path = tree / self.file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        if text.count(self.old) != 1:
            raise ValueError(
                f"{self.name}: {self.file} has {self.old!r} {text.count(self.old)} times, not once"
            )
        path.write_text(text.replace(self.old, self.new), encoding="utf-8")


MUTATIONS = (
    Mutation(
        "formula (50)'s weight",
        "reduce-given-relative",
        "rotorid/reduction/masses.py",
        'factors = omega**2 if rows == "relative"',
        'factors = omega if rows == "relative"',
    ),
    Mutation(
        "sign of phase lag",
        "turbo-lag vectors-run-up",
        "balancing/conventions.py",
        'return 1 if self.phase == "lead" else -1',
        'return 1 if self.phase == "lead" else 1',
    ),
    Mutation(
        "sign of seal damping",
        "campbell-compressor-coarse response-report",
        "fem/rotor.py",
        "        return k, c\n\n    def dynamic_stiffness",
        '        return k, -c if self.kind == "seal" else c\n\n    def dynamic_stiffness',
    ),
    Mutation(
        "stacking of speeds",
        "turbo combined",
        "balancing/correct.py",
        "        part.baseline.ravel(),\n        channels=",
        "        part.baseline[::-1].ravel(),\n        channels=",
    ),
    Mutation(
        "one entry of the gyroscopic matrix",
        "campbell-compressor-coarse critical-compressor-map",
        "fem/elements.py",
        "turning = 2 * model.gyroscopic * tilting",
        "turning = 2 * model.gyroscopic * tilting * (1 - 2 * np.diag(np.eye(len(tilting))[0]))[..., None]",
    ),
    Mutation(
        "the Student quantile",
        "identify-task_3_3 fit-run-down-plot modes-chain",
        "rotorid/regression/estimate.py",
        "stdtrit(dof, 0.975)",
        "stdtrit(dof, 0.95)",
    ),
    Mutation(
        "the unit mil",
        "calibrate-rk4 type",
        "rotorid/files/units.py",
        '"mil": (254.0, 1e7)',
        '"mil": (254.0, 1e6)',
    ),
    Mutation(
        "rounding of a hole's angle",
        "split-holes holes-report",
        "balancing/holes.py",
        "np.arange(int(n)) / int(n), 2 * np.pi)",
        "np.arange(int(n)) / int(n) + np.radians(0.5), 2 * np.pi)",
    ),
)


def mutations() -> int:
    """Run the cases of each mutation with it and without; 1 where the net is blind to one."""
    every = sorted({name for mutation in MUTATIONS for name in mutation.cases.split()})
    with ThreadPoolExecutor(2) as pool:
        right = pool.submit(run, every)
        wrong = [pool.submit(_outcomes, mutation) for mutation in MUTATIONS]
    blind = 0
    for mutation, job in zip(MUTATIONS, wrong, strict=True):
        outcomes = job.result()
        near = apart({name: right.result()[name] for name in outcomes}, outcomes)
        stored = [name for name in outcomes if compare(name, read(name), storable(name, outcomes[name]))]
        files = Counter(f"tests/golden/test_{CASES[name].group}.py" for name in stored)
        blind += not near or not stored
        print(f"{mutation.name}: golden-near {len(near)} cases ({', '.join(near)}); make test {dict(files)}")
    print(f"{len(MUTATIONS)} mutations, {blind} not seen")
    return 1 if blind else 0


def _outcomes(mutation: Mutation) -> Mapping[str, Any]:
    with tempfile.TemporaryDirectory(prefix="mutation") as folder:
        tree = Path(folder)
        for name in PRODUCT:
            shutil.copytree(HERE / name, tree / name, ignore=shutil.ignore_patterns("__pycache__"))
        mutation.apply(tree)
        return run(mutation.cases.split(), tree)
