"""Other kernels of BLAS, as another machine has them, give the stored outputs within the stated tolerance.

`.ci/run` compares all cases so; here stands a sample of each kind of computation.
"""

import os
import platform
import subprocess
import sys
from functools import cache

import pytest

from golden.cases import CASES
from golden.comparing import compare
from golden.running import run
from golden.storing import parts, read

KERNELS = {"OPENBLAS_CORETYPE": "Nehalem", "OPENBLAS_NUM_THREADS": "1"}
SAMPLE = (
    "critical-compressor",
    "response-coarse",
    "influence-coarse",
    "turbo-weighted",
    "turbo-minmax",
    "holes-unsplit",
    "reduce-given",
    "identify-stated",
    "modes-chain",
    "fit-three-masses-auto",
)


@cache
def outcomes():
    """Of the sample, computed by the other kernels."""
    return run(SAMPLE, environment=KERNELS)


@pytest.mark.parametrize("name", SAMPLE)
def test_as_stored(name):
    found = compare(name, read(name), parts(outcomes()[name]))
    assert not found, "\n".join([f"rotorid {CASES[name].command}", *found])


def test_they_are_other_kernels():
    """OpenBLAS says which it takes; another processor, or another BLAS, runs all cases with its own."""
    env = os.environ | KERNELS | {"OPENBLAS_VERBOSE": "2"}
    program = [sys.executable, "-c", "import numpy.linalg"]
    said = subprocess.run(program, env=env, capture_output=True, text=True, check=True)
    if platform.machine() not in ("x86_64", "AMD64") or "Core:" not in said.stdout + said.stderr:
        pytest.skip("not OpenBLAS on an x86 processor")
    assert "Core: Nehalem" in said.stdout + said.stderr
