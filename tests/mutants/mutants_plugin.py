"""Plugin of pytest for `mutants.py`: which tests run which functions, or a chosen list of tests in order.

`MUTANTS_TRACE` is a folder: every worker writes there the functions that each test ran, with its time and
outcome. `MUTANTS_RUN` is a file with the tests to run, one a line; the first that fails is written to
`MUTANTS_KILLER`.
"""

import json
import os
import resource
import sys
import threading
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path.cwd()
PACKAGES = ("fem", "balancing", "rotorid")
MEMORY = 6 * 2**30


class Trace:
    """Functions of the product that ran, by what asked for them: a test, a fixture or a test file."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.codes = {}
        self.ran = defaultdict(set)
        self.current = self.ran[""].add
        self.tests = {}
        sys.settrace(self.call)
        threading.settrace(self.call)

    def call(self, frame, event, arg):
        code = frame.f_code
        self.codes.setdefault(id(code), code)
        self.current(id(code))

    def within(self, context):
        before, self.current = self.current, self.ran[context].add
        sys.settrace(self.call)
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
        sys.settrace(None)
        names, number = {}, {}
        for key, code in self.codes.items():
            path = Path(code.co_filename)
            if path.is_relative_to(ROOT) and path.relative_to(ROOT).parts[0] in PACKAGES:
                name = f"{path.relative_to(ROOT).as_posix()}::{code.co_qualname}"
                number[key] = names.setdefault(name, len(names))
        ran = {
            context: sorted({number[key] for key in keys if key in number})
            for context, keys in self.ran.items()
        }
        worker = os.environ.get("PYTEST_XDIST_WORKER", "main")
        document = {"functions": list(names), "ran": ran, "tests": self.tests}
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
    import fem

    assert Path(fem.__file__).is_relative_to(ROOT), f"tests of another tree: {fem.__file__}"
    controller = config.pluginmanager.hasplugin("dsession")
    if os.environ.get("MUTANTS_TRACE") and not controller:
        config.pluginmanager.register(Trace(os.environ["MUTANTS_TRACE"]), "mutants-trace")
    if os.environ.get("MUTANTS_RUN"):
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        chosen = Chosen(os.environ["MUTANTS_RUN"], os.environ["MUTANTS_KILLER"])
        config.pluginmanager.register(chosen, "mutants-chosen")
