# Every target makes or reuses its own environment: two commands on a fresh machine, `make demo` and `make test`.
PYTHON ?= python3
VENV ?= .venv
BENCH_VENV ?= .venv-bench
HSBALANCE_VENV ?= .venv-hsbalance
HOUSE_VENV ?= .venv-house
LATEST_VENV ?= .venv-latest
LOWEST_VENV ?= .venv-lowest
LOWEST_PYTHON ?= python3.11
UV_VENV ?= .venv-uv
BIN := $(VENV)/bin
# What an environment for work on rotorid holds, of pyproject.toml.
GROUPS ?= dev
# The tested versions of everything, for what is installed and for what builds it; empty: the newest there are.
CONSTRAINTS ?= constraints.txt
export PIP_CONSTRAINT = $(CONSTRAINTS)
export PIP_BUILD_CONSTRAINT = $(CONSTRAINTS)
export PIP_DISABLE_PIP_VERSION_CHECK = 1
# Small matrices gain nothing from threads, and lose a hundredfold where cores are busy.
export OPENBLAS_NUM_THREADS ?= 1
# Compiled modules are kept: every test that starts the program needs them.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test test-full test-wheel test-latest test-lowest mutants fuzz golden golden-near golden-exact book lint house sure docs pages format bench bench-all memory build constraints clean
.DELETE_ON_ERROR:

# $(call environment,FOLDER): made there, or brought up to date
define environment
$(PYTHON) -c 'import sys; sys.exit("rotorid needs Python 3.11 or newer; set PYTHON=") if sys.version_info < (3, 11) else None'
$(PYTHON) -m venv $(1)
$(1)/bin/python -m pip -q install --upgrade 'pip>=25.3' uv
endef
# $(call install,FOLDER) WHAT: into it, with the tested versions; uv does in seconds what takes pip one and a half minutes.
# Modules are compiled when they are first imported: that is a quarter of them.
install = $(1)/bin/uv pip install -q --python $(1)/bin/python $(foreach file,$(CONSTRAINTS),-c $(file) -b $(file))

demo: $(VENV)/.user
	$(BIN)/rotorid demo demo
	@echo 'The same job as a page to type into: $(BIN)/rotorid worksheet demo/turbo_job/job.toml'

ON_TWO_CORES = -n 2 --dist loadfile --no-loadscope-reorder
test: $(VENV)/.dev
	$(BIN)/python -m pytest -q $(ON_TWO_CORES) -m 'not full'

# Everything, with all repetitions of simulations: also every page, whether intervals and regions hold what they say,
# every browser and workbook,
# and the stored answers with other kernels of BLAS.
test-full: $(VENV)/.dev docs
	ROTORID_FULL_TEST=1 $(BIN)/python -m pytest -q $(ON_TWO_CORES) --ignore tests/docs
	$(MAKE) sure

# The tables of docs/sure.md, from drawn readings whose truth is known.
sure: $(VENV)/.dev
	$(BIN)/python tests/coverage/sure.py

# One-line defects drawn by SEED, N of them; does a test find each? MINUTES in all, on JOBS cores.
SEED ?= 1
N ?= 60
MINUTES ?= 15
JOBS ?= 2
mutants: $(VENV)/.dev
	$(BIN)/python tests/mutants/mutants.py --seed $(SEED) --number $(N) --minutes $(MINUTES) --jobs $(JOBS)

# MUTANTS of the samples through the commands that read them, drawn by SEED: no traceback, none over 10 s or 1 GB, no
# other answer than the same content written plainly gives; legitimate changes are listed.
MUTANTS ?= 5000
fuzz: $(VENV)/.dev
	PYTHONPATH=tests:. $(BIN)/python -m fuzz --seed $(SEED) --mutants $(MUTANTS) --jobs $(JOBS)

# Stored answers (tests/golden): after a change that is meant to change them.
golden: $(VENV)/.dev
	PYTHONPATH=tests $(BIN)/python -m golden store

# Exit status, keys and numbers beside those of another commit in an environment of its own, within tolerances; prints
# what differs, stores nothing: make golden-near PARENT=main CASES=all (stored: the stored ones only)
PARENT ?= HEAD~1
CASES ?= stored
golden-near: $(VENV)/.dev
	PYTHONPATH=tests $(BIN)/python -m golden near $(PARENT) $(CASES)

# All that every command prints and writes, byte for byte with another commit: make golden-exact PARENT=main
golden-exact: $(VENV)/.dev
	PYTHONPATH=tests $(BIN)/python -m golden exact $(PARENT)

# Printed numbers of the books beside what is computed now: build/book/numbers.md.
book: $(VENV)/.dev
	PYTHONPATH=tests:tests/helpers:. $(BIN)/python -m book

# The newest versions of today: an environment from scratch, without constraints.txt.
test-latest:
	rm -rf $(LATEST_VENV)
	$(MAKE) test VENV=$(LATEST_VENV) CONSTRAINTS=

# The lowest versions that pyproject.toml promises, on the lowest Python; without studies, which need an extra, and three
# stored outputs: two have the words of the tested typer, and one has two modes at the same speed, which rounding puts
# in order.
test-lowest: $(LOWEST_VENV)/lowest.txt
	PYTEST_ADDOPTS="-k 'not (no-such-option or no-such-choice or campbell-model-job or study)'" $(MAKE) test VENV=$(LOWEST_VENV) PYTHON=$(LOWEST_PYTHON) CONSTRAINTS=$< GROUPS='test docs'

$(LOWEST_VENV)/lowest.txt: pyproject.toml constraints.txt .ci/lowest.py
	mkdir -p $(@D)
	$(LOWEST_PYTHON) .ci/lowest.py > $@

# What there is to read, against the ceilings of tests/helpers/house.py.
house:
	$(PYTHON) tests/helpers/house.py

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/codespell

# The pages, and every command, block of code and number that they show.
docs: $(VENV)/.dev
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	ROTORID_FULL_TEST=1 ROTORID_BUILT_DOCS=docs/_build/html $(BIN)/python -m pytest -q $(ON_TWO_CORES) tests/docs
	@echo "docs/_build/html/index.html"

# Literal outputs on the pages, after a change that is meant to change them; then look at `git diff docs`.
pages: $(VENV)/.dev
	ROTORID_RENEW_PAGES=1 $(BIN)/python -m pytest -q tests/docs/test_pages.py -k every_block_of_a_page

format: $(VENV)/.dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

# Five tasks beside ROSS, hsbalance and lmfit; bench-all: every row, CasADi, too.
bench: $(BENCH_VENV)/.bench $(HSBALANCE_VENV)/.peer
	ROTORID_HSBALANCE_PYTHON=$(HSBALANCE_VENV)/bin/python $(BENCH_VENV)/bin/python -m benchmarks

bench-all: $(BENCH_VENV)/.bench-all $(HSBALANCE_VENV)/.peer
	ROTORID_HSBALANCE_PYTHON=$(HSBALANCE_VENV)/bin/python \
	  $(BENCH_VENV)/bin/python -m benchmarks --all --page docs/benchmarks.md

# Peak memory of the commands beside the size of their data, the table of docs/stability.md; with COMMANDS only those.
COMMANDS ?=
memory: $(VENV)/.dev
	$(BIN)/python .ci/memory.py $(COMMANDS)

# Wheel and sdist, the wheel made from the sdist.
DIST ?= dist
build: $(HOUSE_VENV)/.house
	rm -rf $(DIST)
	$(HOUSE_VENV)/bin/python -m build --outdir $(DIST) > /dev/null
	$(HOUSE_VENV)/bin/twine check --strict $(DIST)/*

# Every test against the installed wheel: a folder with all of the source but the packages, and an environment in it.
# Left out are the tests of how the source is written.
WHEEL ?= .wheel
OF_SOURCE = tests/test_house.py tests/docs/test_names.py
test-wheel: build
	rm -rf $(WHEEL)
	mkdir $(WHEEL)
	git ls-files -z | grep -zvE '^(fem|balancing|rotorid)/' | tar --null -T - -c | tar -x -C $(WHEEL)
	$(call environment,$(WHEEL)/.venv)
	$(WHEEL)/.venv/bin/python -m pip -q install $(DIST)/*.whl $(GROUPS:%=--group %)
	cd $(WHEEL) && .venv/bin/python -m pytest -q $(ON_TWO_CORES) -m 'not full' $(OF_SOURCE:%=--ignore %)

# Makes constraints.txt anew, one file for every Python and system, with the newest versions that fit together.
constraints: CONSTRAINTS =
constraints:
	$(call environment,$(UV_VENV))
	$(UV_VENV)/bin/python -m pip -q install uv
	$(UV_VENV)/bin/uv pip compile --quiet --universal --python-version 3.11 --upgrade --no-config --no-annotate \
	  --custom-compile-command 'make constraints' --output-file constraints.txt pyproject.toml \
	  --extra fast --extra instruments --extra worksheet --extra fleet --extra cluster --group dev --group bench --group bench-all --group peer --group house > /dev/null

$(VENV)/.pip: $(CONSTRAINTS)
	$(call environment,$(VENV))
	touch $@

$(VENV)/.user: $(VENV)/.pip pyproject.toml
	$(call install,$(VENV)) -e '.[worksheet]'
	touch $@

$(VENV)/.dev: $(VENV)/.user
	$(call install,$(VENV)) $(GROUPS:%=--group %)
	touch $@

$(BENCH_VENV)/.bench: pyproject.toml $(CONSTRAINTS)
	$(call environment,$(BENCH_VENV))
	$(BENCH_VENV)/bin/python -m pip -q install -e . --group bench
	touch $@

$(BENCH_VENV)/.bench-all: $(BENCH_VENV)/.bench
	$(BENCH_VENV)/bin/python -m pip -q install --group bench-all
	touch $@

$(HOUSE_VENV)/.house: pyproject.toml $(CONSTRAINTS)
	$(call environment,$(HOUSE_VENV))
	$(call install,$(HOUSE_VENV)) --group house
	touch $@

# hsbalance in its own environment, without XPRESS, whose free licence refuses all but small problems
$(HSBALANCE_VENV)/.peer: pyproject.toml $(CONSTRAINTS)
	$(call environment,$(HSBALANCE_VENV))
	$(HSBALANCE_VENV)/bin/python -m pip -q install --group peer
	$(HSBALANCE_VENV)/bin/python -m pip -q uninstall -y xpress
	touch $@

clean:
	rm -rf $(VENV) $(BENCH_VENV) $(HSBALANCE_VENV) $(LATEST_VENV) $(LOWEST_VENV) $(UV_VENV) $(HOUSE_VENV) $(WHEEL) build dist demo docs/_build
	rm -rf .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis .mutants
