# Paradize. `make` prints this manual.
SHELL := /bin/bash
PYTHON ?= python3
export PYTHON

venv := build/venv
bin := $(venv)/bin
stamps := build/stamps
paradize := $(bin)/paradize
player := build/bin/paradize-player
scene := raw_assets/island.toml
island := build/assets/island
jobs ?= $(shell nproc)
# Ninja alone would run two more: on two cores that takes a tenth longer.
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(jobs)
# Under -j ninja would look for the job server of make, which a recipe does not hand on, and complain.
alone := MAKEFLAGS= MFLAGS=
# Tests start some thousand interpreters: each would compile the package anew where bytecode is switched off.
unexport PYTHONDONTWRITEBYTECODE
# Steps of setup run beside each other: packages are fetched while something is compiled.
MAKEFLAGS += -j3
step := setup/step.sh
pip := $(bin)/pip --disable-pip-version-check
# Python compiles what is imported, a tenth of what the packages hold.
wheels := $(pip) install --no-compile --require-hashes --only-binary :all:
export PATH := $(CURDIR)/$(bin):$(PATH)

python_files := $(shell find pipeline raw_assets/make tests player -name '*.py' 2>/dev/null)
cpp_files := $(shell find player pipeline tests -name '*.cpp' -o -name '*.hpp' 2>/dev/null)
kernel_files := $(shell find pipeline/paradize/kernels -name '*.cpp' -o -name '*.hpp' -o -name CMakeLists.txt -o -name digest.py 2>/dev/null)
package := $(shell find pipeline/paradize -name '*.py' 2>/dev/null | LC_ALL=C sort | cksum | tr ' ' -)
player_files := $(shell find player -name '*.cpp' -o -name '*.hpp' -o -name CMakeLists.txt 2>/dev/null)

# The C++ tests of a preset: configured here, because `make setup` configures before doctest is installed.
define compile_tests
	@$(bin)/cmake --preset $1 >build/$1-configure.log || { cat build/$1-configure.log; exit 1; }
	@$(alone) $(bin)/cmake --build --preset $1
endef

# Tests of one file run in one process, one after another: they share what the file prepares. One process more
# than cores, because some tests wait.
beside := -n $(shell echo $$(($(jobs) + 1))) --dist loadfile --no-loadscope-reorder --durations=10

.PHONY: help setup setup-test assets run moments wheel check test extremes bench sheets deep fix clean lint types island cpp-compiled \
    cpp-sanitized tests-compiled
.DEFAULT_GOAL := help

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' Makefile

setup: $(stamps)/kernels $(player) ## install what is missing: Debian packages, Python environment, kernels, player

assets: setup ## bake the island into build/assets/island; bakes only what changed
	@$(paradize) bake $(scene) -o $(island) -j $(jobs)

run: assets ## bake, then fly over the island: in a window, or into build/flight where there is no display
	@if [ -n "$${DISPLAY:-}$${WAYLAND_DISPLAY:-}" ]; then $(player) $(island); \
	else $(bin)/python player/record.py $(player) $(island) build/flight; fi

moments: assets ## build/moments: 24 moments of the flight on one sheet; strips="58 212" adds 60 frames from these seconds on
	@$(bin)/python player/contact_sheet.py $(player) $(island) build/moments $(strips)

wheel: $(stamps)/kernels ## build/wheel: what pip installs elsewhere, without a compiler (setup/README.md)
	@rm -rf build/wheel
	@$(alone) $(step) "building the wheel" $(pip) wheel --no-build-isolation --no-deps -w build/wheel .
	@$(alone) $(step) "building meshoptimizer's wheel" $(pip) wheel --no-build-isolation --no-deps --require-hashes \
	    -w build/wheel -r setup/python-source.txt
	@ls build/wheel/*.whl

check: lint types island ## lint, types, formatting, and the island's assets; changes nothing

test: setup-test check cpp-compiled tests-compiled ## every check and every test that fits in a few minutes
	@$(alone) $(bin)/python -m pytest -m "not deep" $(beside)

extremes: setup-test ## what every stage and metric does with zero, NaN, 1e30 ...: stage, extreme, error, verdict
	@$(bin)/python -m tests.extremes

bench: setup-test $(stamps)/python-bench ## speed and error as ratios beside peers, measured in one run; topics=maps,lods for some
	@$(bin)/python tests/bench/bench.py $(topics)

sheets: setup-test ## build/sheets: models as three.js and as the player show them, the worst first; models=FOLDER
	@$(bin)/python -m tests.e2e.sheets $(models)

deep: setup-test check cpp-compiled cpp-sanitized ## everything: sanitizers, whole flight, whole corpus; hours
	@$(alone) $(bin)/python -m pytest $(beside) --hypothesis-profile=new_cases

fix: setup-test ## put formatting, simple lint and the pages of scene fields and rules right
	@$(bin)/ruff check -q --fix pipeline raw_assets tests player
	@$(bin)/ruff format -q pipeline raw_assets tests player
	@$(bin)/clang-format -i $(cpp_files)
	@$(bin)/python -m paradize.scene.reference
	@$(bin)/python -m tests.pipeline.checks.test_forms

clean: ## delete everything that was built
	@rm -rf build

# --- parts of check and test: make runs three of them beside each other, and beside what setup-test still fetches ---

lint: $(stamps)/python-test
	@$(bin)/ruff check -q pipeline raw_assets tests player
	@$(bin)/ruff format -q --check pipeline raw_assets tests player
	@$(bin)/clang-format --dry-run -Werror $(cpp_files)

types: $(stamps)/python-test
	@$(bin)/mypy

# No report: nobody looks at its pictures here.
island: setup
	@PARADIZE_REPORT= $(paradize) bake $(scene) -o $(island) -j $(jobs) --json >/dev/null
	@$(paradize) check $(island)

# tests/kernels/test_suites.py runs them.
cpp-compiled: setup $(stamps)/debian-test
	$(call compile_tests,test)

# pytest compiles the tests' modules. Processes that begin at once would each do so.
tests-compiled: setup-test
	@$(bin)/pytest --collect-only -m "not deep" >build/collected.log || { cat build/collected.log; exit 1; }

cpp-sanitized: setup-test
	$(call compile_tests,threads)
	$(call compile_tests,sanitize)

# --- how setup does it ---------------------------------------------------------------------------

setup-test: setup $(stamps)/debian-test $(stamps)/python-test $(stamps)/node

$(stamps)/debian-%: setup/debian.txt setup/debian.sh
	@mkdir -p $(stamps)
	@setup/debian.sh $*
	@touch $@

# Neither apt nor pip runs twice at once, whatever -j says.
$(stamps)/debian-test: | $(stamps)/debian-run
$(stamps)/python-test: | $(stamps)/kernels

# What is compiled needs these only: the player is built while the other packages are fetched.
$(stamps)/python-build: setup/python-build.txt $(stamps)/debian-run
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Paradize needs Python 3.11 or newer; name one with make PYTHON=...")'
	@[ -x $(bin)/python ] || $(PYTHON) -m venv $(venv)
	@$(step) "installing the build tools" $(wheels) -r setup/python-build.txt
	@touch $@

# Its package asks for setuptools-scm as soon as it is looked at: of python-run.txt, where it is locked.
$(stamps)/openmesh: setup/openmesh.txt $(stamps)/python-run
	@rm -rf build/openmesh
	@$(alone) $(step) "fetching the sources of OpenMesh" $(pip) download --no-build-isolation --no-deps \
	    --no-binary :all: --require-hashes -r setup/openmesh.txt -d build/openmesh
	@tar -xzf build/openmesh/openmesh-*.tar.gz -C build/openmesh --strip-components=3 --wildcards '*/OpenMesh/src/OpenMesh'
	@touch $@

$(stamps)/python-run: setup/python-run.txt setup/python-source.txt $(stamps)/python-build
	@$(step) "installing the Python packages of setup/python-run.txt" $(wheels) -r setup/python-run.txt
	@$(alone) $(step) "building meshoptimizer" $(pip) install --no-build-isolation --no-deps --require-hashes \
	    -r setup/python-source.txt
	@touch $@

$(stamps)/python-test: setup/python-test.txt $(stamps)/python-run
	@$(step) "installing the Python packages of setup/python-test.txt" $(wheels) -r setup/python-test.txt
	@touch $@

$(stamps)/python-bench: setup/python-bench.txt $(stamps)/python-test
	@$(step) "installing the peers of setup/python-bench.txt" $(wheels) -r setup/python-bench.txt
	@touch $@

# The installation holds a list of the package's Python files. It is made again where one comes, goes or moves.
$(stamps)/package-$(package):
	@mkdir -p $(stamps); rm -f $(stamps)/package-*; touch $@

$(stamps)/kernels: $(kernel_files) pyproject.toml CMakeLists.txt $(stamps)/python-run $(stamps)/openmesh \
    $(stamps)/package-$(package)
	@$(alone) $(step) "building the kernels" $(pip) install -v --no-build-isolation --no-deps -e .
	@touch $@

$(player): $(player_files) CMakeLists.txt CMakePresets.json $(stamps)/python-build
	@$(bin)/cmake --preset release >build/player-configure.log || { cat build/player-configure.log; exit 1; }
	@$(alone) $(step) "building the player" $(bin)/cmake --build --preset release --target paradize-player
	@touch $@

$(stamps)/node: tests/e2e/package.json tests/e2e/package-lock.json $(stamps)/debian-test
	@mkdir -p build/node
	@cp tests/e2e/package.json tests/e2e/package-lock.json build/node/
	@cd build/node && npm ci --silent --no-fund --no-audit --ignore-scripts
	@touch $@
