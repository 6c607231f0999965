# A machine with Python >= 3.11 (with venv) and make is enough. `make` alone lists the targets.
.DEFAULT_GOAL := help
.PHONY: help demo test test-long test-real-time test-all lint format check bench live attack figures figures-fast trust claims answers docs pictures lock clean

BIN := .venv/bin
OUT := runs/foam-hybrid
THESIS := packages/palpate-thesis
# The distributions beside palpate, which add commands to it.
BESIDE := $(wildcard packages/*)
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
PIP_INSTALL := $(PIP) install --only-binary :all: --no-warn-script-location
# Bytecode is kept whatever the environment says: tests start many processes, which would compile the sources each.
# One thread for algebra and tables: the tests take all cores already, and threads without a core of their own wait spinning.
TEST_PYTHON := PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 POLARS_MAX_THREADS=1 $(BIN)/python
PYTEST := $(TEST_PYTHON) -m pytest
# Kernels that many tests use are compiled before the tests start: else all processes wait for the one that compiles.
SHARED := $(TEST_PYTHON) tests/warm_up.py && $(PYTEST) --numprocesses auto --dist worksteal
# A process of its own, too: a test that hangs ends that one, and fails by its name.
ONE_AT_A_TIME := $(PYTEST) --numprocesses 1
# The Python to build .venv with; `make test PYTHON=python3.13` picks another.
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11 python3.14 python; do \
	if $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then echo $$p; break; fi; done)

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 18

demo: .venv/run.stamp ## set up, identify a small log, press on foam, and say where the report is
	@mkdir -p runs
	$(BIN)/palpate identify examples/data/press.csv --time time_s --position position_mm:mm --force force_N:N --figure runs/press.png
	$(BIN)/palpate run foam-hybrid --out $(OUT) --replace
	@echo "The report is $(CURDIR)/$(OUT)/report.html"
	@echo "The press of the thesis that this began with: $(BIN)/palpate thesis 6.12"

test: .venv/dev.stamp ## set up and run the tests, on all cores
	$(SHARED)

test-long: .venv/dev.stamp ## run the tests that take long: Monte-Carlo, whole figures of the thesis
	$(SHARED) -m "long and not real_time"

test-real-time: .venv/dev.stamp ## run what has to keep up with a clock: sockets, processes, signals; one test at a time
	$(ONE_AT_A_TIME) -m real_time

test-all: .venv/dev.stamp ## run all tests: those that may share the cores in one go, then those of real time
	$(SHARED) -m "not real_time"; parallel=$$?; $(ONE_AT_A_TIME) -m real_time && exit $$parallel

lint: .venv/dev.stamp ## lint, format, types, direction of imports
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	for package in $(BESIDE); do $(BIN)/lint-imports --config $$package/pyproject.toml || exit 1; done

format: .venv/dev.stamp ## wrap the code, sort the imports, mend what ruff can mend
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

check: lint test ## everything that has to pass before a commit

bench: .venv/dev.stamp ## measure what a tick and a cold start cost here
	$(BIN)/palpate speed
	$(BIN)/python benchmarks/c_yardstick/compare.py
	$(BIN)/python benchmarks/side_by_side.py
	$(BIN)/python benchmarks/cold_start.py
	$(BIN)/python benchmarks/arms/tick.py

live: .venv/dev.stamp ## measure the live page in headless Chromium: frames a second, and slider to picture
	$(BIN)/python benchmarks/live/measure.py

attack: .venv/dev.stamp ## 10,000 hostile inputs, faults of the disk, kills, an hour of each experiment, faults in mid-press; into docs/reliability.md, docs/rehearsal.md
	$(BIN)/python benchmarks/attack/run.py --write
	$(BIN)/python benchmarks/figures.py --only wires-faults

figures: .venv/dev.stamp ## make every figure of the documents whose sources have changed; hours, resumable
	$(BIN)/python benchmarks/figures.py

figures-fast: .venv/dev.stamp ## run the small run of every figure, and compare it with what it printed when the figure was made
	$(BIN)/python benchmarks/figures.py --smoke

trust: .venv/dev.stamp ## judge identify on a foreign simulator's logs and put the figures into docs/trust.md; a quarter of an hour
	$(BIN)/python benchmarks/figures.py --only trust plain-presses cases

claims: .venv/dev.stamp ## measure the whole thesis again, say which claims changed, and keep what they are now for the tests
	$(BIN)/palpate thesis --out runs/claims --replace
	$(BIN)/python $(THESIS)/tests/frozen.py runs/claims

answers: .venv/dev.stamp ## record what palpate answers, to compare before and after a restructuring; an hour, resumable
	$(BIN)/python benchmarks/answers.py build/answers

docs: .venv/dev.stamp ## build the documentation into site/
	$(BIN)/zensical build --clean --strict

pictures: .venv/dev.stamp ## make the film and the pictures of the README again; a Chromium takes them
	$(BIN)/palpate run foam-rls --seed 1 --figures png --out build/foam-rls --replace
	cp build/foam-rls/identification.png docs/foam-rls.png
	$(BIN)/python benchmarks/pictures.py

lock: .venv/python.stamp ## resolve the dependencies again and pin them with hashes
	$(BIN)/python -m venv --clear build/lock
	build/lock/bin/python -m pip --disable-pip-version-check --quiet install uv
	build/lock/bin/uv $(LOCK) pyproject.toml --group build --group beside -o requirements/run.txt
	build/lock/bin/uv $(LOCK) pyproject.toml --group dev -c requirements/run.txt -o requirements/dev.txt

LOCK := pip compile --quiet --upgrade --universal --python-version 3.11 --generate-hashes \
	--fork-strategy fewest \
	--no-header --no-annotate --no-emit-index-url --no-emit-find-links --only-binary :all:

clean: ## remove the environment and everything that is made
	rm -rf .venv build dist site $(BESIDE:=/build) $(BESIDE:=/dist) .mypy_cache .ruff_cache .hypothesis .import_linter_cache

.venv/python.stamp:
	@test -n "$(PYTHON)" || { echo "palpate needs Python 3.11 or newer on the PATH; or say which: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "$(PYTHON) is not Python 3.11 or newer; say which: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' || { echo "$(PYTHON) has no venv; install it (python3-venv on Debian and Ubuntu)" >&2; exit 1; }
	@echo "setting up .venv: a few minutes on the first run, while packages are downloaded"
	$(PYTHON) -m venv --clear .venv
	@touch $@

.venv/run.stamp: requirements/run.txt pyproject.toml $(BESIDE:=/pyproject.toml) .venv/python.stamp
	$(PIP_INSTALL) --require-hashes -r requirements/run.txt
	$(PIP) install --no-deps --no-build-isolation --editable . $(BESIDE:%=--editable %)
	@touch $@

.venv/dev.stamp: requirements/dev.txt .venv/run.stamp
	$(PIP_INSTALL) --require-hashes -r requirements/dev.txt
	@touch $@
