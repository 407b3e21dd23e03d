# Every target makes or reuses its own environment: two commands on a fresh machine, `make demo` and `make test`.
PYTHON ?= python3
VENV ?= .venv
BENCH_VENV ?= .venv-bench
HSBALANCE_VENV ?= .venv-hsbalance
BIN := $(VENV)/bin
export PIP_DISABLE_PIP_VERSION_CHECK = 1
# Small matrices gain nothing from threads, and lose a hundredfold where cores are busy.
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: demo test test-full mutants lint docs format bench build clean

demo: $(VENV)/.user
	$(BIN)/rotorid demo demo

test: $(VENV)/.dev
	$(BIN)/python -m pytest -q -n 2 --dist worksteal

# Simulations with all their repetitions instead of 300.
test-full: $(VENV)/.dev
	ROTORID_FULL_TEST=1 $(BIN)/python -m pytest -q -n 2 --dist worksteal

# One-line defects drawn by SEED, N of them; does a test find each? MINUTES in all, on JOBS cores.
SEED ?= 1
N ?= 60
MINUTES ?= 15
JOBS ?= 2
mutants: $(VENV)/.dev
	$(BIN)/python tests/mutants.py --seed $(SEED) --number $(N) --minutes $(MINUTES) --jobs $(JOBS)

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/codespell

docs: $(VENV)/.dev
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

format: $(VENV)/.dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(BENCH_VENV)/.bench $(HSBALANCE_VENV)/.peer
	ROTORID_HSBALANCE_PYTHON=$(HSBALANCE_VENV)/bin/python $(BENCH_VENV)/bin/python -m benchmarks --json docs/benchmarks.json

build: $(VENV)/.dev
	$(BIN)/python -m pip -q install build
	$(BIN)/python -m build

$(VENV)/.pip:
	$(PYTHON) -c 'import sys; sys.exit("rotorid needs Python 3.11 or newer; set PYTHON=") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip -q install --upgrade 'pip>=25.1'
	touch $@

$(VENV)/.user: $(VENV)/.pip pyproject.toml
	$(BIN)/python -m pip -q install -e .
	touch $@

$(VENV)/.dev: $(VENV)/.user
	$(BIN)/python -m pip -q install --group dev
	touch $@

$(BENCH_VENV)/.bench: pyproject.toml
	$(PYTHON) -m venv $(BENCH_VENV)
	$(BENCH_VENV)/bin/python -m pip -q install --upgrade 'pip>=25.1'
	$(BENCH_VENV)/bin/python -m pip -q install -e . --group bench
	touch $@

# hsbalance in its own environment, without XPRESS, whose free licence refuses all but small problems
$(HSBALANCE_VENV)/.peer:
	$(PYTHON) -m venv $(HSBALANCE_VENV)
	$(HSBALANCE_VENV)/bin/python -m pip -q install 'hsbalance==0.5.5' clarabel cvxopt
	$(HSBALANCE_VENV)/bin/python -m pip -q uninstall -y xpress
	touch $@

clean:
	rm -rf $(VENV) $(BENCH_VENV) $(HSBALANCE_VENV) build dist demo docs/_build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis .mutants
