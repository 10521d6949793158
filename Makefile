# Every target sets up what it needs: a fresh machine needs only make, Python >= 3.11 and its venv module.
PYTHON ?= python3
VENV   ?= .venv
BIN     = $(VENV)/bin
PIP     = $(BIN)/python -m pip install --disable-pip-version-check --quiet --no-compile
PYTEST ?= $(BIN)/python -m pytest
JOBS   ?= 2
MAKER   = $(BIN)/python -m ftqp.kernel.building
# The classes of processors that a wheel is built for; elsewhere there is one for each architecture.
COMMA  := ,
LEVELS ?= $(if $(filter x86_64,$(shell uname -m)),x86-64-v4$(COMMA)x86-64-v3)
PYTHONS ?= python3.11 python3.12 python3.13
# Two cases of each test of these that takes less than a third of a second or tells much. The rest (long runs, papers,
# random episodes, commands, pictures, every compiled part) is for make test.
QUICK  ?= -m "not slow and not long" --few 2 tests/core tests/faults tests/model tests/control tests/sim tests/robustness tests/qp tests/vendors tests/laws \
          $(addprefix tests/app/,scenario schema replay) $(addprefix tests/kernel/,layout rows arm judge maths) \
          tests/test_package.py tests/test_texts.py

# Bytecode is made when it is first needed and then kept, whatever the environment says: tests start hundreds of processes, and each would compile ftqp anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo kernel papers pictures test test-all quick test-pythons test-lowest licences docs campaign bench bench-first-use wheel wheels clean

help:
	@echo "make demo       an arm in physics loses a joint, finds out and finishes, beside a rival; writes pictures"
	@echo "make test       ruff, mypy, import layers, and every test but those of test-all"
	@echo "make test-all   make test, and what takes long: scripts of studies from end to end, long runs"
	@echo "make quick      what to run before a commit: lint, layers, and the tests that are quick"
	@echo "make docs       the documentation site, into site/, without a network once its tools are there"
	@echo "make test-pythons   make test with each of $(PYTHONS) that is on this machine"
	@echo "make test-lowest    the quick tests with the oldest version of each dependency that pyproject.toml allows"
	@echo "make licences       what is installed and under which licence, into dist/sbom.json (CycloneDX) and a table"
	@echo "make papers     every figure and table of the five papers that shows a result, into its page"
	@echo "make pictures   README's picture and animation, made by the live page in a browser (needs Chromium)"
	@echo "make campaign   ten minutes of random episodes, judged from outside: a sample of each bundled campaign"
	@echo "make bench      step, batches, memory, first use: measures them and rewrites docs/evidence/speed.md"
	@echo "make kernel     builds the kernel anew where it is older than its source"
	@echo "make bench-first-use   what building and a first planner cost"
	@echo "make wheel      a wheel with the kernel built for two classes of processors, into dist/; TARGET=aarch64-macos: for another machine"
	@echo "make wheels     that wheel and all that it needs, into dist/wheels: for machines without a network"
	@echo "make clean      removes the environment, caches and runs"

# What further parts need of the kernel is built while the first one is told, and the rest when all have been; other
# targets wait for it.
demo: $(VENV)/.has-viz,sim
	@$(MAKER) --part demo --jobs 1 > $(VENV)/kernel.txt 2>&1 & \
	$(BIN)/ftqp demo brake; told=$$?; wait; [ $$told -eq 0 ] || exit $$told; \
	$(BIN)/ftqp demo box goal
	@echo "the rest of the kernel is built in the background, a minute or two; make kernel waits for it"
	@nohup $(MAKER) > $(VENV)/kernel.txt 2>&1 &

# Compiles what an edit concerns, in a few seconds; nothing where the library is as new as the source.
kernel: $(VENV)/.has-viz
	@$(MAKER)

# The types are checked beside the tests, as that takes one core half a minute; what is wrong is told at the end.
test: $(VENV)/.has-dev
	@$(MAKER)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	@$(BIN)/mypy > $(VENV)/types.txt 2>&1 & types=$$!; \
	$(PYTEST) -n $(JOBS) --dist loadfile -m "not slow"; tests=$$?; \
	wait $$types; types=$$?; cat $(VENV)/types.txt; \
	[ $$tests -eq 0 ] && [ $$types -eq 0 ]

test-all: test
	$(PYTEST) -n $(JOBS) --dist loadfile -m slow

quick: $(VENV)/.has-dev
	@$(MAKER)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(PYTEST) -n $(JOBS) --dist loadfile $(QUICK)

docs: $(VENV)/.has-docs
	rm -rf build/playground
	NO_MKDOCS_2_WARNING=1 FTQP_PLAYGROUND=1 $(BIN)/python -m mkdocs build --quiet
	@echo "open site/index.html"

# An environment each; a Python that is not there is named and left out.
test-pythons:
	@for python in $(PYTHONS); do \
	    if $$python -c 'import sys, venv' 2>/dev/null; then $(MAKE) test PYTHON=$$python VENV=.venv-$$python || exit 1; \
	    else echo "$$python is not on this machine: left out"; fi; done

test-lowest: VENV = .venv-lowest
test-lowest:
	$(PYTHON) -m venv $(VENV)
	$(PYTHON) tests/lowest_versions.py pyproject.toml > $(VENV)/lowest.txt
	$(PIP) --constraint $(VENV)/lowest.txt --editable ".[viz,sim,solvers,ros]" pytest pytest-xdist hypothesis import-linter
	$(PYTEST) -n $(JOBS) --dist loadfile -W default $(QUICK)

licences: $(VENV)/.has-viz
	$(PIP) "cyclonedx-bom>=5" "pip-licenses>=5"
	mkdir -p dist
	$(BIN)/cyclonedx-py environment $(BIN)/python --output-file dist/sbom.json
	$(BIN)/pip-licenses --order=license
papers: $(VENV)/.has-viz
	@$(MAKER)
	$(BIN)/python studies/paper_figures.py

pictures: $(VENV)/.has-dev
	$(BIN)/python docs/making/live_pictures.py

# Ten minutes on two cores; all are run, and what any of them found ends it with an error.
campaign: $(VENV)/.has-dev
	@worst=0; for one in "safety 8000" "backends 1400" "out-of-reach 3000" "wide 1500" "physics 200" "detection 200" "wrong-model 100" "strangers 40"; do \
	    set -- $$one; $(BIN)/ftqp campaign $$1 --episodes $$2 --jobs $(JOBS) || worst=1; done; \
	FTQP_EPISODES=1000 $(PYTEST) tests/laws -k episode || worst=1; exit $$worst

bench: $(VENV)/.has-dev
	$(BIN)/python benchmarks/bench_step.py --peers --update-docs
	$(BIN)/python benchmarks/bench_batch.py --million --update-docs
	$(BIN)/python benchmarks/bench_memory.py --update-docs
	$(BIN)/python benchmarks/bench_first_use.py --update-docs

bench-first-use: $(VENV)/.has-viz
	$(BIN)/python benchmarks/bench_first_use.py

# TARGET=aarch64-linux or aarch64-macos makes the wheel of another machine, for its usual class of processors.
wheel: $(VENV)/.has-viz
	FTQP_TARGET=$(TARGET) FTQP_LEVELS=$(if $(TARGET),,$(LEVELS)) $(BIN)/python -m pip wheel --disable-pip-version-check --quiet --no-deps --wheel-dir dist .

# What is in the folder installs without a network: pip install --no-index --find-links dist/wheels "ftqp[viz,sim]"
wheels: $(VENV)/.has-viz
	FTQP_LEVELS=$(LEVELS) $(BIN)/python -m pip wheel --disable-pip-version-check --quiet --wheel-dir dist/wheels ".[viz,sim]"

clean:
	rm -rf $(VENV) build dist src/ftqp/_kernel runs site .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# One stamp an extra: set up once, and again when pyproject.toml changes. What the demo's first picture needs of the
# kernel is compiled beside the rest of the installation, as that needs numpy and numba only; it is linked at the end of
# its input, when pip has brought a linker, too. ftqp is built beside what builds it, not in a second environment with all
# of that; its extras come afterwards, as what they need may have to be built, too.
$(VENV)/.has-%: pyproject.toml | $(BIN)/python
	$(PIP) "numpy>=2.2" "numba>=0.61.2" "hatchling>=1.24" editables
	{ FTQP_LEVELS=none $(PIP) --no-build-isolation --no-deps --editable . >&2 && \
	$(PIP) "ziglang>=0.13" "ftqp[$*]" >&2 && touch $@.new; } | \
	PYTHONPATH=src $(MAKER) --part first --after-stdin || true
	@mv $@.new $@

$(BIN)/python:
	@$(PYTHON) -c 'import sys; v = sys.version_info; v >= (3, 11) or sys.exit("ftqp needs Python 3.11 or newer, $(PYTHON) is %d.%d; call make with PYTHON=/path/to/a/newer/python3" % v[:2])'
	$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); echo "cannot make $(VENV); install Python's venv module (Debian, Ubuntu: apt install python3-venv)" >&2; exit 1; }
