"""The three packages as a user meets them: any import order, quick start, a complete list of names."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import balancing
import fem
import rotorid
from rotorid.samples import sample_data

HEAVY = ("pandas", "matplotlib", "sympy", "clarabel", "openpyxl", "scipy.optimize", "numba")
HEAVY += ("pyuff", "scipy.io")


def run_python(code):
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=True
    ).stdout


@pytest.mark.full
@pytest.mark.parametrize("first", ["fem", "balancing", "rotorid", "rotorid.files", "rotorid.cli"])
def test_any_package_can_be_imported_first(first):
    run_python(f"import {first}, fem, balancing, rotorid; [getattr(rotorid, n) for n in rotorid.__all__]")


@pytest.mark.parametrize("package", ["fem", "balancing", "rotorid", "rotorid.cli", "rotorid.base.tables"])
def test_an_import_does_not_load_what_only_some_commands_need(package):
    loaded = set(json.loads(run_python(f"import json, sys, {package}; print(json.dumps(list(sys.modules)))")))
    assert not loaded & set(HEAVY)


def test_the_command_line_and_its_help_start_without_numerics():
    shown = "import sys, rotorid.cli as c; c.application()([*typed], standalone_mode=False); "
    numerics = {"numpy", "fem", "balancing"}
    for typed in ([], ["--help"]):
        code = f"typed = {typed}; {shown}print({numerics} & {{*sys.modules}})"
        assert run_python(code).endswith("\nset()\n"), typed


def test_a_rotor_table_loads_no_compiler_and_no_keys_of_other_files():
    ran = f"typed = ['critical', r'{sample_data()}/rotor23.csv']; import sys, rotorid.cli as c; "
    ran += "c.application(typed)(typed, standalone_mode=False); print({'numba', 'pydantic'} & {*sys.modules})"
    assert run_python(ran).endswith("\nset()\n")


@pytest.mark.parametrize("package", [fem, balancing, rotorid])
def test_every_public_name_exists_and_is_documented(package):
    assert package.__all__
    for name in package.__all__:
        value = getattr(package, name)
        assert name.startswith("__") or (value.__doc__ or "").strip(), (
            f"{package.__name__}.{name} has no docstring"
        )
        assert name in dir(package)


def test_no_public_name_means_two_things():
    values = {}
    for package in (fem, balancing, rotorid):
        for name in package.__all__:
            assert name == "__version__" or name not in values, (
                f"{package.__name__} and {values[name]}: {name}"
            )
            values[name] = package.__name__


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = rotorid.nonsense


def test_sample_data_are_found_in_a_checkout():
    assert (sample_data() / "turbo_job" / "job.toml").is_file()


def test_sample_data_are_found_in_a_wheel_or_their_absence_is_said(tmp_path, monkeypatch):
    package = tmp_path / "site-packages" / "rotorid"
    package.mkdir(parents=True)
    monkeypatch.setattr("rotorid.samples._PACKAGE", package)
    with pytest.raises(FileNotFoundError, match="no sample data"):
        sample_data()
    (package / "sample_data").mkdir()
    (package / "sample_data" / "rotor23.csv").write_text("x", encoding="utf-8")
    assert sample_data() == package / "sample_data"


def test_every_sample_folder_says_where_it_comes_from():
    folders = [p for p in Path(sample_data()).iterdir() if p.is_dir() and p.name != "__pycache__"]
    assert folders
    for folder in folders:
        assert len((folder / "README.md").read_text(encoding="utf-8")) > 200, folder.name
