# Copyright 2026 The rgbd_kcf_tracker authors
# SPDX-License-Identifier: Apache-2.0

# Needs Python 3.10 or later with venv, and make. All that is installed goes into .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Arguments for pytest, as in: make test PYTEST="-k replay"; in one process: PYTEST="-n 0"
PYTEST ?=
# Arguments for the injector, as in: make inject INJECT="--count 5000 --seed 7"
INJECT ?= --count 1000

# A shell in which another ROS 2 or virtual environment is active must not leak into this one.
unexport PYTHONPATH PYTHONHOME LD_LIBRARY_PATH AMENT_PREFIX_PATH COLCON_PREFIX_PATH
unexport RMW_IMPLEMENTATION _ROS_WHEELS_BOOTSTRAP_COMPLETE VIRTUAL_ENV

.DELETE_ON_ERROR:
.PHONY: help demo test inject lint docs types format matrix clean distclean

help: ## say what can be made
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

demo: $(VENV)/.installed ## simulate a recording, run both nodes over it, show the result in demo/
	$(BIN)/python -m rgbd_kcf_tracker.bench.demo demo --overwrite

test: $(VENV)/.installed-test ## run the whole suite
	$(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 --dist loadfile $(PYTEST)

inject: $(VENV)/.installed ## try faults of files, disks and signals on every command
	$(BIN)/python -m rgbd_kcf_tracker.bench.inject $(INJECT)

lint: $(VENV)/.installed-lint ## check style
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

docs: $(VENV)/.installed-docs ## make the site of the documentation in site/, strictly
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs site
	@echo "open site/index.html"

types: $(VENV)/.installed-lint ## check types
	$(BIN)/mypy

format: $(VENV)/.installed-lint ## put the style right
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

matrix: $(VENV)/.installed-lint ## run the suite on every Python, NumPy and OpenCV there is
	$(BIN)/nox

clean: ## remove what was made, but not .venv
	rm -rf build install log dist demo site *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .nox
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +

distclean: clean ## remove .venv too
	rm -rf $(VENV)

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { \
	    echo "$(PYTHON) is older than Python 3.10: name another one, as in make demo PYTHON=python3.12"; \
	    exit 1; }
	@$(PYTHON) -m venv $(VENV) || { \
	    echo "$(PYTHON) has no venv: on Debian and Ubuntu install python3-venv"; rm -rf $(VENV); \
	    exit 1; }

# Each stamp is an installation of the checkout itself (editable) with the extras that it names.
INSTALL = $(BIN)/python -m pip install --disable-pip-version-check --constraint constraints.txt
$(VENV)/.installed: setup.py setup.cfg pyproject.toml constraints.txt | $(BIN)/python
	@echo "Installing into $(VENV) ..."
	$(INSTALL) --editable '.[ros,tools,view]'
	@touch $@

$(VENV)/.installed-test: $(VENV)/.installed
	$(INSTALL) --quiet --editable '.[ros,test]'
	@touch $@

$(VENV)/.installed-docs: $(VENV)/.installed
	$(INSTALL) --quiet --editable '.[ros,docs]'
	@touch $@

$(VENV)/.installed-lint: $(VENV)/.installed
	$(INSTALL) --quiet --editable '.[ros,test,lint]' nox
	@touch $(VENV)/.installed-test $@
