# Needs make and Python 3.11 or newer, nothing else: every target sets up .venv by itself.
# Another interpreter: make PYTHON=python3.13 ...

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help setup report report-all docs test test-all test-lowest test-newest test-peers bench mutants paper lint format lock clean distclean FORCE

# What the caller's shell says about other Pythons must not leak into ours.
unexport PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE VIRTUAL_ENV

PYTHON ?=
VENV := .venv
BIN := $(VENV)/bin
LOCK := requirements-lock.txt
DOCS := requirements-docs.txt
READY := $(VENV)/.ready
LOWEST := .venv-lowest
NEWEST := .venv-newest
PIP := -m pip --disable-pip-version-check --no-input
# JOBS=1: one process in place of one for each core.
JOBS ?= auto
SUITE := -m pytest -q -n $(JOBS) --dist worksteal --benchmark-disable
CACHES := .pytest_cache .mypy_cache .ruff_cache .benchmarks build dist

# A shell word list: the interpreters to try, in order.
TRY := $(if $(PYTHON),"$(PYTHON)",python3 python3.14 python3.13 python3.12 python3.11 python)
FIT := import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))
FIND = python=; for p in $(TRY); do \
	if "$$p" -c '$(FIT)' >/dev/null 2>&1; then python=$$p; break; fi; done; \
	if [ -z "$$python" ]; then \
		echo 'discmech needs Python 3.11 or newer with its venv module (on Debian: python3-venv), and $(if $(PYTHON),PYTHON=$(PYTHON) is not one,found none); name one with make PYTHON=/path/to/python.' >&2; \
		exit 2; fi

help:  ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-11s %s\n", $$1, $$2 }' Makefile

setup: $(READY)  ## only the environment, .venv
	@:

# The stamp holds what .venv was made for (checkout, PYTHON as asked). A checkout that was moved,
# another PYTHON or a dead interpreter make it anew; a changed lock or pyproject.toml update it.
FITS := $(shell { read -r top && read -r asked; } 2>/dev/null < $(READY) && \
	[ "$$top" = "$(CURDIR)" ] && { [ -z "$(PYTHON)" ] || [ "$$asked" = "$(PYTHON)" ]; } && \
	[ -x $(BIN)/python ] && echo yes)

# Bytecode is written for what is loaded: of all that pip installs it takes half the set-up.
$(READY): pyproject.toml $(LOCK) $(if $(FITS),,FORCE)
	@if [ "$(FITS)" = yes ]; then echo 'bringing $(VENV) up to date'; else \
		$(FIND); \
		echo "setting up $(VENV) with $$("$$python" -V) (once, about a minute)"; \
		rm -rf $(VENV) && "$$python" -m venv $(VENV); fi
	@$(BIN)/python $(PIP) install -q --no-deps --no-compile --require-hashes -r $(LOCK)
	@$(BIN)/python $(PIP) install -q --no-deps --no-build-isolation -e .
	@$(BIN)/python -c 'import sympy, scipy.integrate, matplotlib.figure, llvmlite.binding, rich'
	@mkdir -p $(VENV)/checkout && ln -sfn ../.. $(VENV)/checkout/discmech  # mypy_path
	@$(BIN)/python $(PIP) check >/dev/null || { $(BIN)/python $(PIP) check; \
		echo '$(LOCK) does not fit pyproject.toml: say make lock.' >&2; exit 2; }
	@printf '%s\n' "$(CURDIR)" "$(PYTHON)" > $@
	@echo '$(VENV) is ready'

# make itself answers every failure with 2; the command's own exit codes are put in words here.
report: $(READY)  ## all studies, to reports/build/index.html
	@$(BIN)/discmech report $(REPORT) || { code=$$?; case $$code in \
		1) echo 'report: a verdict failed (1)' ;; \
		2) echo 'report: bad input (2)' ;; \
		3) echo 'report: inconclusive (3)' ;; \
		4) echo 'report: could not run (4)' ;; \
		*) echo "report: stopped ($$code)" ;; esac >&2; exit $$code; }

report-all: REPORT = --bench
report-all: report  ## the same with more digits on every scene, and what tests the bench itself

docs: $(VENV)/.docs  ## the documentation as a site, to docs/_build/index.html
	@$(BIN)/python -m sphinx -q -E -W --keep-going -c docs . docs/_build
	@echo 'docs: docs/_build/index.html'

$(VENV)/.docs: $(READY) $(DOCS)
	@$(BIN)/python $(PIP) install -q --no-deps --require-hashes -r $(DOCS)
	@touch $@

test: $(READY)  ## all tests but the slow ones
	@$(BIN)/python $(SUITE) -m 'not slow'

test-all: $(READY)  ## every test
	@$(BIN)/python $(SUITE)

# In an environment of its own, so that `make test` stays what everybody has. Siconos comes with
# Debian (python3-siconos) for the system's interpreter; its test says so where it is not there.
test-peers:  ## other people's libraries in .venv-peers, and the tests that skip without them
	@$(MAKE) --no-print-directory VENV=.venv-peers .venv-peers/.peers
	@.venv-peers/bin/python -m pytest -q -rs --benchmark-disable $(PEERS)

PEERS := tests/studies/work_precision/test_peers.py \
	tests/integrators/extensions/contact/test_siconos.py tests/studies/test_gallery.py \
	tests/integrators/extensions/foreign/test_recordings.py

$(VENV)/.peers: $(READY)
	@$(BIN)/python $(PIP) install -q --no-build-isolation -e '.[gallery]' pyarrow
	@touch $@

# The oldest packages that pyproject.toml allows, in an environment of their own.
test-lowest: $(LOWEST)/.ready  ## all tests but the slow ones, with the oldest packages allowed
	@$(LOWEST)/bin/python $(SUITE) -m 'not slow'

$(LOWEST)/.ready: pyproject.toml .ci/lowest.py
	@$(FIND); rm -rf $(LOWEST) && "$$python" -m venv $(LOWEST)
	@$(LOWEST)/bin/python .ci/lowest.py > $(LOWEST)/constraints.txt
	@$(LOWEST)/bin/python $(PIP) install -q -c $(LOWEST)/constraints.txt hatchling editables
	@$(LOWEST)/bin/python $(PIP) install -q -c $(LOWEST)/constraints.txt --no-build-isolation -e '.[test]'
	@touch $@

# What `pip install .` brings today: an environment of its own, brought up to date each time.
test-newest:  ## all tests but the slow ones, with the newest packages there are
	@$(FIND); has=$$($(NEWEST)/bin/python -V 2>/dev/null) && \
		{ [ -z "$(PYTHON)" ] || [ "$$has" = "$$("$$python" -V)" ]; } || \
		{ rm -rf $(NEWEST) && "$$python" -m venv $(NEWEST); }
	@$(NEWEST)/bin/python $(PIP) install -q --upgrade hatchling editables
	@$(NEWEST)/bin/python $(PIP) install -q --upgrade --upgrade-strategy eager --no-build-isolation -e '.[test]'
	@$(NEWEST)/bin/python $(SUITE) -m 'not slow'

bench: $(READY)  ## timings beside C and scipy, in one run (needs gcc)
	@command -v gcc >/dev/null || { \
		echo 'make bench compares with C and found no gcc; install one (on Debian: gcc).' >&2; exit 2; }
	@$(BIN)/python -m pytest tests/benchmarks -s -o python_files='bench_*.py' \
		-o python_functions='bench_* test_*'

# Hours for all of them: SAMPLE=400 takes so many at random.
mutants: $(VENV)/.mutants  ## mutate our own judges and references: do the tests notice?
	@for what in judges reference; do echo "$$what:"; \
		$(BIN)/python -m tests.mutants $$what $(if $(SAMPLE),--sample $(SAMPLE)) || failed=1; done; \
		exit $${failed:-0}

$(VENV)/.mutants: $(READY)
	@$(BIN)/python $(PIP) install -q 'cosmic-ray>=8.4'
	@touch $@

paper: $(READY)  ## PAPER.md, from the table that tests/paper checks
	@$(BIN)/python -m tests.paper

lint: $(READY)  ## ruff and mypy
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

format: $(READY)  ## let ruff mend what it can
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

# uv finds the versions that fit every Python and system we support, and the hashes of all their
# files; the index has no address in what it writes. The docs' pins are those that LOCK lacks.
lock:  ## pin the newest versions anew, with their hashes
	@$(FIND); set -e; fresh=$$(mktemp -d); trap 'rm -rf "$$fresh"' EXIT; \
	"$$python" -m venv "$$fresh"; "$$fresh/bin/python" $(PIP) install -q uv; \
	pins() { file=$$1; shift; printf 'hatchling>=1.27\neditables\n' | "$$fresh/bin/uv" pip compile -q \
	        --universal --python-version 3.11 --fork-strategy fewest --generate-hashes --no-header \
	        --no-annotate "$$@" pyproject.toml - -o "$$fresh/$$file" >/dev/null; \
	    { sed '/^[^#]/,$$d' $$file; sed '/^#/d' "$$fresh/$$file"; } > $$file.new; mv $$file.new $$file; }; \
	pins $(LOCK) --extra dev; \
	pins $(DOCS) --extra docs -c $(LOCK) \
	    $$(sed -n 's/^\([^# ]*\)==.*/--no-emit-package \1/p' $(LOCK)); \
	grep -c '==' $(LOCK) $(DOCS) | sed 's/:/: /; s/$$/ pins/'

clean:  ## remove what was generated, keep .venv
	@rm -rf reports/build docs/_build $(CACHES) *.egg-info
	@find . -path ./$(VENV) -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean  ## remove .venv as well
	@rm -rf $(VENV) $(LOWEST) $(NEWEST)

FORCE:
