"""Every promise of pyproject.toml: tested versions in constraints.txt, the lowest for `make test-lowest`."""

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
GROUPS = PROJECT["dependency-groups"]
PYTHONS = [
    name.split()[-1] for name in PROJECT["project"]["classifiers"] if re.search(r"Python :: 3\.\d+$", name)
]


def promised(groups, extras=()):
    """What the project, its build, these groups and these extras ask for."""
    texts = [*PROJECT["project"]["dependencies"], *PROJECT["build-system"]["requires"]]
    texts += [text for extra in extras for text in PROJECT["project"]["optional-dependencies"][extra]]
    texts += [text for group in groups for text in GROUPS[group] if isinstance(text, str)]
    return [Requirement(text) for text in texts]


def pins(python):
    """Version by name, from constraints.txt as this Python reads it on Linux."""
    here = {
        "python_version": python,
        "python_full_version": f"{python}.1",
        "implementation_name": "cpython",
        "platform_python_implementation": "CPython",
        "sys_platform": "linux",
        "os_name": "posix",
    }
    found = {}
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        one = Requirement(line)
        (pin,) = one.specifier
        assert (pin.operator, one.url) == ("==", None), line
        if one.marker is None or one.marker.evaluate(here):
            assert canonicalize_name(one.name) not in found, f"{one.name} has two versions on Python {python}"
            found[canonicalize_name(one.name)] = pin.version
    return found


@pytest.mark.parametrize("python", PYTHONS)
def test_everything_that_is_asked_for_has_a_tested_version_that_keeps_the_promise(python):
    found = pins(python)
    for wanted in promised(GROUPS, PROJECT["project"]["optional-dependencies"]):
        version = found.get(canonicalize_name(wanted.name))
        assert version is not None, f"{wanted.name} is not in constraints.txt: run `make constraints`"
        assert wanted.specifier.contains(version), f"{wanted} against {version}: run `make constraints`"


def test_the_lowest_versions_are_those_of_the_promises():
    program = [sys.executable, str(ROOT / ".ci" / "lowest.py")]
    printed = subprocess.run(program, capture_output=True, text=True, check=True).stdout.splitlines()
    lowest = [f"{one.name}=={next(iter(one.specifier)).version}" for one in promised(["test", "docs"])]
    assert set(lowest) == {line for line in printed if "==" in line.split(";")[0]}
    names = {canonicalize_name(Requirement(line).name) for line in printed}
    assert names >= set(pins("3.11"))
