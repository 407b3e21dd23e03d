"""Other kernels of BLAS, as another machine has them, give the stored outputs too (`make test-full`)."""

import os
import platform
import subprocess
import sys

import pytest
from repetitions import FULL

from golden.checks import checks

KERNELS = {"OPENBLAS_CORETYPE": "Nehalem", "OPENBLAS_NUM_THREADS": "1"}

if FULL:
    test_as_stored = checks("balance", "models", "rotor", environment=tuple(KERNELS.items()))


def test_they_are_other_kernels():
    """OpenBLAS names the one it takes; another processor, or another BLAS, runs all cases with its own."""
    env = os.environ | KERNELS | {"OPENBLAS_VERBOSE": "2"}
    program = [sys.executable, "-c", "import numpy.linalg"]
    shown = subprocess.run(program, env=env, capture_output=True, text=True, check=True)
    if platform.machine() not in ("x86_64", "AMD64") or "Core:" not in shown.stdout + shown.stderr:
        pytest.skip("not OpenBLAS on an x86 processor")
    assert "Core: Nehalem" in shown.stdout + shown.stderr
