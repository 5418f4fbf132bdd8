# `make demo` and `make test` set everything up first. RTGI_PYTHON=/path/to/python3.11 forces an interpreter.
export RTGI_VENV ?= .venv
PYTHON := $(RTGI_VENV)/bin/python
# One process a core: much of a test is Blender starting or Python thinking. A file's tests stay together, for the fixtures they share.
PYTEST := $(PYTHON) -m pytest -n auto --dist loadfile

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-fast campaign lint extension bench charts

help:                ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { sub(/ .*/, "", $$1); printf "make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup:               ## make the virtual environment with Blender's module and everything else (instant once done)
	@sh tools/setup.sh

demo: setup          ## bake sample_blends/cornell_box.blend into demo/ and draw its probes
	@mkdir -p demo
	$(PYTHON) -m rtgi_addon sample_blends/cornell_box.blend bake --out demo/cornell_box --picture demo/cornell_box.png
	@echo "The bundle is in demo/cornell_box, the picture is demo/cornell_box.png"

test: setup          ## run every test
	$(PYTEST)

test-fast: setup     ## run the tests that take less than a few seconds each
	$(PYTEST) -m "not slow"

campaign: setup      ## try what must never be lost: kills, mutations, random command lines (an hour); CAMPAIGN="kills --count 99 --seed 7"
	$(PYTHON) tests/campaign/run.py $(CAMPAIGN)

lint: setup          ## check style
	$(PYTHON) -m ruff check .

extension: setup     ## build the extension's zips, one per platform, into dist/ (downloads their wheels from PyPI once)
	$(PYTHON) tools/build_extension.py

charts: setup        ## charts, sheets beside Cycles, plans and stability of every sample into benchmarks/results (hours)
	$(PYTHON) benchmarks/charts.py
	$(PYTHON) benchmarks/preview_vs_cycles.py --samples 24 --cycles-samples 32 --eevee-samples 8
	$(PYTHON) -m rtgi_addon stability --out benchmarks/results/stability
	$(PYTHON) benchmarks/plan.py --threads 1

bench: setup         ## measure again what benchmarks/measured says
	$(PYTHON) benchmarks/tables.py --minutes 600
	$(PYTHON) benchmarks/without_embree.py
	$(PYTHON) benchmarks/bake_vs_cycles.py
	$(PYTHON) benchmarks/farm.py atrium --probes 20000 --parts 16 --error 0.03 --workers 4
	$(PYTHON) benchmarks/farm.py --merge 1000000
	$(PYTHON) benchmarks/lookup.py
	$(PYTHON) benchmarks/fit.py
	$(PYTHON) benchmarks/plan.py
	$(PYTHON) benchmarks/vpl.py accuracy flicker
	$(PYTHON) benchmarks/rsm_capture.py
	$(PYTHON) benchmarks/gpu_kernels.py
	$(PYTHON) benchmarks/preview.py
	$(PYTHON) benchmarks/preview_vs_cycles.py
