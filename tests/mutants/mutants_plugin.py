"""Plugin of pytest for `mutants.py`: which tests run which functions, or a chosen list of tests in order.

`MUTANTS_TRACE` is a folder: every worker writes there the functions that each test ran, with its time and
outcome. `MUTANTS_RUN` is a file with the tests to run, one a line; the first that fails is written to
`MUTANTS_KILLER`.
"""

import ast
import builtins
import json
import os
import resource
import sys
from collections import defaultdict
from importlib.machinery import PathFinder, SourceFileLoader
from pathlib import Path

import pytest

ROOT = Path.cwd()
PACKAGES = ("fem", "balancing", "rotorid")
MEMORY = 6 * 2**30


class _Marks(ast.NodeTransformer):
    """A call of `_ran_` at the beginning of every function, which tells its name; numba compiles none."""

    def __init__(self, path):
        self.path, self.where, self.depth = path, [], 0

    def visit_ClassDef(self, node):
        self.where.append(node.name)
        node.body = [self.visit(each) for each in node.body]
        self.where.pop()
        return node

    def visit_FunctionDef(self, node):
        if any(ast.unparse(each).startswith("compiled") for each in node.decorator_list):
            return node
        before = list(self.where)
        self.where += ["<locals>", node.name] if self.depth else [node.name]
        self.depth += 1
        body = [self.visit(each) for each in node.body]
        place = 1 if ast.get_docstring(node, clean=False) is not None else 0
        mark = ast.parse(f"_ran_({f'{self.path}::{chr(46).join(self.where)}'!r})").body[0]
        for each in ast.walk(mark):
            ast.copy_location(each, node.body[0])
        node.body = [*body[:place], mark, *body[place:]]
        self.depth -= 1
        self.where = before
        return node


class _Loader(SourceFileLoader):
    """Compiles a module with its marks, past the compiled files."""

    def get_code(self, fullname):
        path = Path(self.path)
        tree = ast.parse(path.read_bytes())
        marked = _Marks(path.relative_to(ROOT).as_posix()).visit(tree)
        return compile(marked, self.path, "exec", dont_inherit=True)


class _Finder:
    """The product's modules get that loader."""

    @staticmethod
    def find_spec(fullname, path=None, target=None):
        if fullname.partition(".")[0] not in PACKAGES:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(spec.loader.name, spec.loader.path)
        return spec


class Trace:
    """Functions of the product that ran, by what asked for them: a test, a fixture or a test file.

    The functions tell it themselves (`_Marks`): a trace of the interpreter sees every call of every library
    and takes several times as long.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self.ran = defaultdict(set)
        self.current = self.ran[""]
        self.tests = {}
        builtins._ran_ = self.mark

    def mark(self, name):
        self.current.add(name)

    def within(self, context):
        before, self.current = self.current, self.ran[context]
        return before

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector):
        before = self.within(f"file {collector.nodeid.partition('::')[0]}")
        try:
            return (yield)
        finally:
            self.current = before

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef, request):
        before = self.within(f"fixture {fixturedef.baseid}::{fixturedef.argname}")
        try:
            return (yield)
        finally:
            self.current = before

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item, nextitem):
        before = self.within(f"test {item.nodeid}")
        info = getattr(item, "_fixtureinfo", None)
        own = [] if info is None else [d for each in info.name2fixturedefs.values() for d in each]
        fixtures = sorted({f"fixture {d.baseid}::{d.argname}" for d in own})
        self.tests[item.nodeid] = {"fixtures": fixtures, "seconds": 0.0, "outcome": "passed"}
        try:
            return (yield)
        finally:
            self.current = before

    def pytest_runtest_logreport(self, report):
        if report.nodeid in self.tests:
            self.tests[report.nodeid]["seconds"] += report.duration
            if report.outcome != "passed":
                self.tests[report.nodeid]["outcome"] = report.outcome

    def pytest_sessionfinish(self, session):
        number = {name: n for n, name in enumerate(sorted(set().union(*self.ran.values())))}
        ran = {context: sorted(number[name] for name in names) for context, names in self.ran.items()}
        worker = os.environ.get("PYTEST_XDIST_WORKER", "main")
        document = {"functions": list(number), "ran": ran, "tests": self.tests}
        (self.folder / f"{worker}.json").write_text(json.dumps(document), encoding="utf-8")


class Chosen:
    """The tests of a list, in its order; the first that fails is written down."""

    def __init__(self, file, killer):
        tests = Path(file).read_text(encoding="utf-8").splitlines()
        self.order = {name: number for number, name in enumerate(tests)}
        self.killer = Path(killer)

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config, items):
        keep = [item for item in items if item.nodeid in self.order]
        keep.sort(key=lambda item: self.order[item.nodeid])
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid not in self.order])
        items[:] = keep

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.killer.write_text(report.nodeid, encoding="utf-8")

    def pytest_collectreport(self, report):
        if report.failed:
            self.killer.write_text(f"{report.nodeid} (import)", encoding="utf-8")


def pytest_configure(config):
    controller = config.pluginmanager.hasplugin("dsession")
    if os.environ.get("MUTANTS_TRACE") and not controller:
        config.pluginmanager.register(Trace(os.environ["MUTANTS_TRACE"]), "mutants-trace")
    if os.environ.get("MUTANTS_RUN"):
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        chosen = Chosen(os.environ["MUTANTS_RUN"], os.environ["MUTANTS_KILLER"])
        config.pluginmanager.register(chosen, "mutants-chosen")
    import fem

    assert Path(fem.__file__).is_relative_to(ROOT), f"tests of another tree: {fem.__file__}"


# a plugin is imported before the conftest that imports the product
if os.environ.get("MUTANTS_TRACE"):
    assert not any(name.partition(".")[0] in PACKAGES for name in sys.modules)
    builtins._ran_ = len  # whatever runs before the trace begins
    sys.meta_path.insert(0, _Finder)
