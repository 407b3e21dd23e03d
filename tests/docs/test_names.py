"""Public docstrings: every parameter, what is returned, what is held; all their examples run."""

import dataclasses
import doctest
import inspect
import pkgutil
import re
from importlib import import_module
from pathlib import Path

import pytest
from cases import each_of

PACKAGES = ("fem", "balancing", "rotorid")
ROOMS = ("identify", "reduction", "calibration", "files")
LISTS = (*PACKAGES, *(f"rotorid.{room}" for room in ROOMS))


def modules():
    for package in PACKAGES:
        for found in pkgutil.walk_packages(import_module(package).__path__, f"{package}."):
            if found.name != "rotorid.__main__":
                yield import_module(found.name)


MODULES = list(modules())
CLASSES_OF_OURS = {
    name: value
    for module in MODULES
    for name, value in vars(module).items()
    if inspect.isclass(value) and value.__module__.partition(".")[0] in PACKAGES
}
"""All classes, by name."""
ROOT = Path(__file__).parents[2]


def test_files_of_the_repository_that_are_named_exist():
    """In what is handed out and in the benchmarks, which no test runs; CHANGELOG.md tells of former times."""
    named = re.compile(r"(?<![\w./])(?:tests|fem|rotorid|balancing|benchmarks|examples|docs)/[\w/]+\.py\b")
    texts = [
        path
        for folder in (*PACKAGES, "benchmarks", "examples", "docs", "sample_data")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in (".py", ".md", ".toml") and "_build" not in path.parts
    ]
    gone = {
        (path.name, name)
        for path in (*texts, *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "Makefile")))
        for name in named.findall(path.read_text(encoding="utf-8"))
        if not (ROOT / name).is_file()
    }
    assert gone == set()


def public(kind):
    found = {}
    for package in LISTS:
        module = import_module(package)
        for name in module.__all__:
            value = getattr(module, name)
            if kind(value):
                found.setdefault(f"{value.__module__}.{value.__qualname__}", value)
    return found


FUNCTIONS = public(inspect.isfunction)
CLASSES = public(inspect.isclass)


def section(doc, *titles):
    """The text of the first of these sections, empty without it."""
    found = re.search(
        rf"^(?:{'|'.join(titles)})\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", doc, re.MULTILINE | re.DOTALL
    )
    return found[1] if found else ""


def described(text):
    """The names that a section describes."""
    heads = re.findall(r"^(\w[\w, *]*?)(?: :.*)?$", text, re.MULTILINE)
    return {name.strip(" *") for head in heads for name in head.split(",")}


@each_of("name", FUNCTIONS)
def test_a_function_describes_its_parameters_and_what_it_returns(name):
    function = FUNCTIONS[name]
    doc = inspect.getdoc(function) or ""
    assert doc.split("\n")[0].rstrip().endswith((".", ":")), "one sentence first"
    signature = inspect.signature(function)
    assert described(section(doc, "Parameters")) >= set(signature.parameters)
    returned = str(signature.return_annotation).replace(" | None", "").strip("'\"").rpartition(".")[2]
    if returned == "None" or returned in CLASSES_OF_OURS:
        return  # a class of ours describes itself
    assert section(doc, "Returns") or re.search(r"shape \(", doc.split("\n\n")[0])


@each_of("name", CLASSES)
def test_a_class_describes_what_it_holds_or_takes_and_its_methods(name):
    value = CLASSES[name]
    doc = inspect.getdoc(value) or ""
    assert doc.split("\n")[0].rstrip().endswith((".", ":"))
    text = section(doc, "Attributes") + section(doc, "Parameters")
    if dataclasses.is_dataclass(value):
        fields = {field.name for field in dataclasses.fields(value) if not field.name.startswith("_")}
    else:
        fields = set(getattr(value, "_fields", ()))
    assert described(text) >= fields
    for method, member in vars(value).items():
        if not method.startswith("_") and (inspect.isfunction(member) or isinstance(member, property)):
            assert inspect.getdoc(member), method


@pytest.mark.full
def test_all_examples_of_all_docstrings_run():
    done = [doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE) for module in MODULES]
    assert sum(result.attempted for result in done) > 80
    assert [m.__name__ for m, result in zip(MODULES, done, strict=True) if result.failed] == []
