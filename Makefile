# `make run` and `make test` are all that a user needs; both make their own environment in .venv.
# `make proofs`, `lint`, `docs`, `bench`, `studio`, `c-library`, `wasm`, `wheels`: see each target.
PYTHON ?= python3
PYTHON312 ?= python3.12
VENV := .venv
BIN := $(VENV)/bin
SOURCES := $(shell find include bindings tests/core_module python machines examples firmware -type f \
             -not -name '*.so' -not -path '*/__pycache__/*' 2>/dev/null) CMakeLists.txt pyproject.toml

BUILD_REQUIRES = $(shell $(PYTHON) -c 'import tomllib; print(*map(repr, tomllib.load( \
                   open("pyproject.toml", "rb"))["build-system"]["requires"]))' 2>/dev/null)

PYTEST := $(BIN)/python -m pytest -n auto --dist worksteal
C_FOLDERS := include bindings tests examples firmware web bench
CHECKED := python tests studies bench machines docs examples

.PHONY: run test fast proofs drawn mutants fuzz published benchmark-faults lint bench docs wheels c-library wasm studio clean

run: $(VENV)/installed
	@mkdir -p out
	$(BIN)/reluctance run examples/paper_rated.toml --plot out/paper_rated.png
	$(BIN)/reluctance paper --out out/paper
	@echo 'next:'
	@echo '  . $(BIN)/activate'
	@echo '  reluctance run examples/edge_mpc_mcu.toml --plot out/edge_mpc_mcu.png'
	@echo '  reluctance limit examples/edge_mpc_mcu.toml'

# Side by side: the linters have one core only.
test: $(VENV)/installed-test
	@$(MAKE) --no-print-directory -j2 lint fast
fast: $(VENV)/installed-test
	$(PYTEST) -m "not long"

# What takes longer: random cases, a second compiler, emulated searches, browsers, mock-up units.
# SHARD=2/4 is the second quarter of them.
SHARD ?= 1/1
proofs: $(VENV)/installed-test
	$(PYTEST) -m long --shard $(SHARD)

# Machines, points and directions from a new seed, or SEED=N; every law.
drawn: $(VENV)/installed
	$(BIN)/python studies/drawn.py $(if $(SEED),--seed $(SEED))

# A hundred small faults of the code from a new seed, or SEED=N: those that no test sees. SHARD=2/4
# is the second of four parts of a seed.
mutants: $(VENV)/installed-test
	$(BIN)/python tests/support/mutants.py --shard $(SHARD) $(if $(SEED),--seed $(SEED))

# Files of every format, changed at random, and the borders of C under sanitizers: SECONDS for each,
# from a new seed, or SEED=N. FORMATS="pump steel" are these two.
SECONDS ?= 120
fuzz: $(VENV)/installed-test
	$(BIN)/python tests/support/fuzz_files.py $(FORMATS) --seconds $(SECONDS) \
	  $(if $(SEED),--seed $(SEED))

# Every published and measured case, into docs/published.csv, and our laws on one of the drives.
published: $(VENV)/installed
	$(BIN)/python studies/published/all.py
	$(BIN)/python studies/published/tanala_laws.py

# What the protection finds of every fault at every instant, into bench/faults.csv; the cases and
# their seeds are in bench/faults.toml. Then the same of published cases.
benchmark-faults: $(VENV)/installed
	$(BIN)/python bench/faults.py
	$(BIN)/python bench/faults.py bench/faults_published.toml --out bench/faults_published.csv

lint: $(VENV)/installed-test
	$(BIN)/ruff check $(CHECKED)
	$(BIN)/ruff format --check $(CHECKED)
	find $(C_FOLDERS) -name '*.[ch]' -o -name '*.[ch]pp' | xargs grep -L '@[a-zA-Z_]*@' | \
	  xargs $(BIN)/clang-format --dry-run -Werror  # templates with @marks@ are no C yet
	$(BIN)/mypy

bench: $(VENV)/installed
	$(BIN)/python bench/closed_loop.py

docs: $(VENV)/installed-docs
	$(BIN)/sphinx-build -j auto -W --keep-going -E -a -q -b html docs build/site
	$(BIN)/python docs/extensions/check_links.py build/site

# The C interface with everything in it (docs/c_interface.md). KINDS="-DSRM_PHASES=3" holds less.
KINDS ?=
CXX_SHARED := -std=c++20 -O2 -ffp-contract=off -fno-math-errno -fno-trapping-math -fPIC -shared \
  -fvisibility=hidden
c-library:
	@mkdir -p build
	$(CXX) $(CXX_SHARED) $(KINDS) -Iinclude web/reluctance.cpp -o build/libreluctance.so

# The same for browsers and Node: double precision, machines of three and four phases.
WASM_CXX ?= clang++-19
WASM_PACKAGES := clang-19 lld-19 libc++-19-dev-wasm32 libclang-rt-19-dev-wasm32 wasi-libc
WASM_FAST := -mllvm -inline-threshold=1000
WASM_KINDS ?= -DSRM_PHASES=3,4 -DSRM_PRECISIONS=double
CXX_WASM := --target=wasm32-wasi -std=c++20 -O2 -ffp-contract=off -fno-exceptions -fno-rtti \
  -fno-threadsafe-statics -fno-math-errno -fno-trapping-math -mbulk-memory -msign-ext \
  -mnontrapping-fptoint -mexec-model=reactor -Wl,--strip-all -Wl,--export-dynamic \
  -Wl,--export=malloc -Wl,--export=free
wasm:
	@mkdir -p build
	$(WASM_CXX) $(CXX_WASM) $(WASM_FAST) $(WASM_KINDS) -Iinclude web/reluctance.cpp -o build/reluctance.wasm

# The page of `reluctance studio`: the core for its machines, and the drives with their limits. All
# laws and machine models with three phases; with four, what the page has.
# Less is written out in place, and no loop is: slower than `make wasm`, for a page that loads at
# once.
STUDIO_KINDS := -fno-vectorize -fno-slp-vectorize -fno-unroll-loops -mllvm -inline-threshold=60 \
  -DSRM_PHASES=3,4 -DSRM_PRECISIONS=double '-DSRM_TOGETHER(law,machine,phases)=( \
  !law.ends_with("OfPairs") && (phases == 3 || \
  (machine == "LeHuy" && (law == "TorqueSharing" || law == "Ditc"))))' \
  '-DSRM_AROUND(around,machine,phases)=(around == "frame" || (machine == "LeHuy" && phases == 3))'
studio: $(VENV)/installed
	@echo '#include <array>' | $(WASM_CXX) --target=wasm32-wasi -fsyntax-only -x c++ - 2>/dev/null || \
	  { echo 'error: $(WASM_CXX) does not compile for WebAssembly;' \
	    'on Debian: apt install $(WASM_PACKAGES)'; exit 2; }
	$(WASM_CXX) $(CXX_WASM) $(STUDIO_KINDS) -Iinclude web/reluctance.cpp -o web/reluctance.wasm
	$(BIN)/reluctance studio --data web/data
	@to="$$($(BIN)/python -c 'from reluctance.base.resources import resources; print(resources("web"))')" && \
	  { [ "$$to" -ef web ] || cp -r web/reluctance.wasm web/data "$$to"; }

# One wheel for this Python, and one for 3.12 and later; each is tried in an empty environment.
wheels:
	$(PYTHON) -m pip wheel --quiet --no-deps --wheel-dir dist .
	.ci/installed "$$(ls -t dist/*.whl | head -1)" $(PYTHON)
	$(PYTHON312) -m pip wheel --quiet --no-deps --wheel-dir dist \
	  --config-settings=wheel.py-api=cp312 .
	.ci/installed "$$(ls -t dist/*abi3*.whl | head -1)" $(PYTHON312)

# Without build isolation the tools of the build stay where they are, so that only what changed is
# compiled again. Modules of Python are compiled when they are first imported: all of them took 18 s
# of processor time. Of what pip has to say, packages and compiled files are shown, and all of it
# where it fails.
PIP := $(BIN)/pip install --no-compile --no-build-isolation
LOG := $(VENV)/install.log
DEFINE := --config-settings=cmake.define.RELUCTANCE_
install = @{ $(PIP) -v $(DEFINE)OTHER_FORMS=$(1) $(DEFINE)TEST_MODULE=$(1) $(2) 2>&1 || \
  echo 'error: pip install failed'; } | tee $(LOG) | grep --line-buffered -oE $(SHOWN); \
  ! grep -q '^error: pip install failed' $(LOG) || { cat $(LOG); exit 2; }
SHOWN := '^Collecting [^ ]+|^Installing collected|\[[0-9]+/[0-9]+\] [A-Z].*'

$(VENV)/installed: $(SOURCES) | $(VENV)/made
	$(call install,OFF,.)
	@touch $@

$(VENV)/installed-test: $(SOURCES) | $(VENV)/made
	$(call install,ON,'.[test]')
	@touch $@ $(VENV)/installed

$(VENV)/installed-docs: $(VENV)/installed-test
	$(call install,ON,'.[docs]')
	@touch $@ $(VENV)/installed

# What an environment and a build need, each with its package: asked before anything is made.
# CMake takes the compiler of the environment variable CXX, or c++.
CMAKE_CXX = $(if $(filter default,$(origin CXX)),c++,$(CXX))
CXX20 := \#include <concepts>
NEEDS_IF = || { echo "error: $(1); on Debian: apt install $(2)"; exit 2; }

# pip reads `false` as the option itself. With it `pip install '.[html]'` compiles nothing again.
PIP_CONF := [install]\nno-build-isolation = false\n

$(VENV)/made:
	@command -v $(PYTHON) >/dev/null $(call NEEDS_IF,$(PYTHON) is missing,python3)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "error: $(PYTHON) is too old, need Python >= 3.11; try make PYTHON=python3.11"; exit 2; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	  $(call NEEDS_IF,the module ensurepip of $(PYTHON) is missing,python3-venv)
	@$(PYTHON) -c 'import os, sys, sysconfig; \
	  sys.exit(not os.path.isfile(sysconfig.get_path("include") + "/Python.h"))' \
	  $(call NEEDS_IF,Python.h is missing,python3-dev)
	@echo '$(CXX20)' | $(CMAKE_CXX) -std=c++20 -fsyntax-only -x c++ - 2>/dev/null \
	  $(call NEEDS_IF,no C++20 compiler ($(CMAKE_CXX)),g++)
	$(PYTHON) -m venv $(VENV)
	@printf '$(PIP_CONF)' > $(VENV)/pip.conf
	$(BIN)/pip install --quiet --no-compile cmake ninja $(BUILD_REQUIRES)
	@touch $@

clean:
	rm -rf $(VENV) build out
