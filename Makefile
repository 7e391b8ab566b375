# Pondwatch. `make run` shows a pond assembling itself; `make test` proves that it works; `make help` lists the rest.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1
unexport PYTHONDONTWRITEBYTECODE  # else every process that a test starts would compile the program anew

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV ?= .venv
PORT ?= 8000
DATA ?=
BUNDLES ?= $(wildcard ../shared/samples)
METHOD ?=
JOBS ?= 2
BIN := $(VENV)/bin
LOCKED := $(BIN)/pip install -qq --requirement
NPM_STAMP := $(if $(wildcard frontend/package-lock.json),frontend/node_modules/.package-lock.json)
BENCHES := accuracy speed live
LONG_BENCHES := grid factors baselines pairs findings moonshot

.PHONY: help run setup setup-test test test-long test-paper test-postgres check lint bench $(BENCHES) $(LONG_BENCHES) wheel pictures reference lock clean

help:  ## list what can be made
	@grep -E '^[a-z-]+:.*##' Makefile | sed -E 's/:.*## /\t/' | expand -t 14

run: setup  ## start the server with a demo inspection: make run PORT=8000 DATA=folder
	$(BIN)/pondwatch demo --port $(PORT) $(if $(DATA),--data "$(DATA)")

setup: $(VENV)/.runtime $(NPM_STAMP)  ## install what running needs, from the lock files

setup-test: setup $(VENV)/.test

test: lint chromium  ## everything but the long tests (some 10 minutes on 2 cores, once set up), JOBS=2 at a time
	cd frontend && npm test --silent
	$(BIN)/python -m pytest -m "not long" -n $(JOBS) --dist loadfile --no-loadscope-reorder

test-long: setup-test $(VENV)/.train chromium  ## the long tests: 200 kills, a fresh environment, training
	$(BIN)/python -m pytest -m long --timeout 3600

test-paper: setup-test $(VENV)/.train  ## the paper's networks, trained on a tiny set (installs torch)
	$(BIN)/mypy models
	$(BIN)/python -m pytest tests/models tests/simulator/test_sfp10.py

test-postgres: setup-test $(VENV)/.postgres  ## store, jobs and API on a server: make test-postgres POSTGRES=postgresql+psycopg://user@host
	$(BIN)/python -m pytest -m "not long" -p tests.fakes.postgres --postgres "$(POSTGRES)" tests/store tests/jobs tests/api

check: lint  ## style, types, import layers, budgets, and that the docs tell all
	$(BIN)/python -m pytest tests/test_house.py tests/test_docs.py

lint: setup-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python tools/budgets.py
	cd frontend && npm run --silent types

bench: setup-test  ## figures into docs/: make bench [accuracy|speed|live|grid|factors|baselines|pairs|moonshot] BUNDLES=folder
	$(BIN)/python -m tests.bench $(or $(filter $(BENCHES) $(LONG_BENCHES),$(MAKECMDGOALS)),$(BENCHES)) \
		$(if $(BUNDLES),--bundles "$(BUNDLES)") $(if $(METHOD),--method $(METHOD)) $(if $(QUICK),--quick) \
		$(if $(SNAPSHOTS),--snapshots $(SNAPSHOTS))

$(BENCHES) $(LONG_BENCHES): bench
	@:

wheel: setup-test  ## a complete wheel in dist/
	rm -rf dist
	$(BIN)/pip wheel --quiet --no-deps --wheel-dir dist .

pictures: setup-test chromium  ## the pictures of the README, from a running demo
	$(BIN)/python tools/pictures.py

reference: setup-test  ## docs/reference.md, from the program itself
	$(BIN)/python -m tools.reference

lock: $(VENV)/.lock  ## resolve the dependencies of pyproject.toml anew into the lock files
	VENV=$(VENV) tools/lock.sh

clean:  ## remove what was installed and built
	rm -rf $(VENV) frontend/node_modules dist build .mypy_cache .pytest_cache .ruff_cache .import_linter_cache

.PHONY: chromium
chromium: setup-test
	tools/chromium.sh

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed; set PYTHON=..." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.runtime: requirements.lock pyproject.toml | $(BIN)/python
	$(LOCKED) requirements.lock
	$(BIN)/pip install -qq --no-deps --editable .
	@touch $@

$(VENV)/.test: requirements-test.lock $(VENV)/.runtime
	$(LOCKED) requirements-test.lock
	@touch $@

$(VENV)/.train: requirements-train.lock $(VENV)/.runtime
	$(LOCKED) requirements-train.lock
	@touch $@

$(VENV)/.postgres: requirements-postgres.lock $(VENV)/.runtime
	$(LOCKED) requirements-postgres.lock
	@touch $@

$(VENV)/.lock: | $(BIN)/python
	$(PYTHON) -m venv $(VENV)/lock
	$(VENV)/lock/bin/pip install --quiet pip-tools
	@touch $@

frontend/node_modules/.package-lock.json: frontend/package-lock.json frontend/package.json
	@command -v npm >/dev/null || { echo "Node and npm are needed (Debian: apt-get install nodejs npm)" >&2; exit 1; }
	cd frontend && npm ci --silent
	@touch $@
