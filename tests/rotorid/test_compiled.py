"""Compiled functions: the same numbers, kept for the next start only while they are true."""

import math
import os
import subprocess
import sys

import pytest

from rotorid.base.compiled import COMPILED, compiled

INNER = """
from rotorid.base.compiled import compiled_part

@compiled_part
def inner(x):
    return {} * x
"""
OUTER = """
import sys
from inner import inner
from rotorid.base.compiled import compiled

@compiled
def outer(x):
    return inner(x) + 0.5

print(inner(3.0), "numba" in sys.modules, outer(3.0), sum(outer.machine.stats.cache_hits.values()))
"""


@compiled
def hypotenuse(x, y):
    """Of a right-angled triangle."""
    return math.sqrt(x * x + y * y)


def test_a_function_is_what_it_was():
    assert hypotenuse(3.0, 4.0) == 5.0
    assert hypotenuse.__doc__ == "Of a right-angled triangle."
    assert getattr(hypotenuse, "py_func", hypotenuse)(3.0, 4.0) == 5.0


@pytest.mark.full
@pytest.mark.skipif(not COMPILED, reason="without the extra rotorid[fast]")
def test_machine_code_is_kept_until_what_it_calls_changes(tmp_path):
    """In another file, of the same size and date: numba by itself would go on with the old one."""
    (tmp_path / "outer.py").write_text(OUTER, encoding="utf-8")
    search = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])
    runs = []
    for factor in ("2.0", "2.0", "4.0"):
        inner = tmp_path / "inner.py"
        inner.write_text(INNER.format(factor), encoding="utf-8")
        os.utime(inner, (1e9, 1e9))
        made = subprocess.run(
            [sys.executable, "-B", "-c", "import outer"],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": search},
            capture_output=True,
            check=True,
            text=True,
        )
        runs.append(made.stdout.split())
    assert runs == [
        ["6.0", "False", "6.5", "0"],
        ["6.0", "False", "6.5", "1"],
        ["12.0", "False", "12.5", "0"],
    ]
