# Everything happens in .venv; nothing needs root. `make demo` and `make test` set up what is missing first.

PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11; do \
	"$$p" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo "$$p" && break; done)
BIN := .venv/bin
STAMP := .venv/installed
# A file stays with one worker, so that what its tests share is made once.
PYTEST_ARGS ?= -n auto --maxprocesses 4 --dist loadfile -rfEs
SOURCES := toolpaths machines postproc
NUMERIC = $(shell grep -rl --include='test_*.py' 'mark\.numeric' tests)

.PHONY: docs packages demo test quick numeric hard damage changes slow mutants programs faults fuzz same lint lock clean

demo: $(STAMP)
	@mkdir -p out
	$(BIN)/postproc convert samples/pocket.cls -m mill-3axis -c linuxcnc --setup samples/tools.setup.toml \
		-o out/pocket.ngc

test: $(STAMP)
	$(BIN)/pytest $(PYTEST_ARGS)

# Every sample, and every file of the folder HARD, unmodified, on every machine and control; EDITS=all changes each block too.
EDITS ?= 1
hard: $(STAMP)
	$(BIN)/python tests/hard/run.py $(if $(HARD),"$(HARD)") --edits $(EDITS) $(HARD_ARGS)

# Every byte of every kind of record by all 256, hours of processor; DAMAGE=500 takes so many changes of each record.
DAMAGE ?= all
damage: $(STAMP)
	DAMAGE=$(DAMAGE) $(BIN)/pytest $(PYTEST_ARGS) tests/damage

# Every word, block and number of written programs changed, on every control: minutes each.
changes: $(STAMP)
	$(BIN)/pytest $(PYTEST_ARGS) -m slow tests/postproc/readback/test_program_mutation.py

# All that a smaller test of `make test` stands for: those changes, programs in the simulator whose times are kept.
slow: $(STAMP)
	$(BIN)/pytest $(PYTEST_ARGS) -m slow

# Faults planted in the project's functions and in written programs, and what catches each: half an hour of processor.
JOBS ?= 1
mutants: $(STAMP)
	$(BIN)/python -m tests.mutants --jobs $(JOBS) $(if $(ROOM),--room "$(ROOM)") $(if $(ONLY),--only "$(ONLY)") \
		$(if $(ROOM)$(ONLY),,--json tests/mutants/results.json --page tests/mutants/README.md) $(MUTANTS_ARGS)

# Changes of written programs alone, by control: caught, warned of, silent and harmful.
programs: $(STAMP)
	$(BIN)/python -m tests.mutants --programs "$(ONLY)"

# Every command that writes: killed at MOMENTS random moments, full disk, lost folder, two writers, closed pipe, clock, memory.
MOMENTS ?= 200
faults: $(STAMP)
	$(BIN)/python tests/faults/run.py --count $(MOMENTS)

# The same bytes over kinds of processor, threads, hash seeds, zones, languages; PYTHONS="PATH ..." other interpreters, too.
same: $(STAMP)
	$(BIN)/python -m tests.determinism.run $(foreach one,$(PYTHONS),--python "$(one)")

# Every reader under coverage-guided fuzzing, TIME seconds each; ONLY="cl fanuc" takes these. Findings are files in out/fuzz.
TIME ?= 1200
FUZZ = cl fanuc haas siemens klartext linuxcnc iso setup machine controller log stl off obj ply
fuzz: $(STAMP)
	@test -d .venv/fuzz/atheris || $(BIN)/pip install --quiet --disable-pip-version-check --target .venv/fuzz \
		-r tests/fuzz/requirements.txt
	@failed=0; for one in $(if $(ONLY),$(ONLY),$(FUZZ)); do echo "target: $$one"; \
		$(BIN)/python tests/fuzz/run.py $$one --seconds $(TIME) || failed=1; done; exit $$failed

# Under a minute on two processors once compiled code is kept (tests/tiers.py says what belongs to it).
quick: $(STAMP)
	$(BIN)/pytest $(PYTEST_ARGS) -m quick $(shell sed -n 's|^ *"\(tests/.*\.py\)",$$|\1|p' tests/tiers.py)

# The compiled loops against their numpy twins, for each kind of processor that runs here (tests/processors.py).
numeric: $(STAMP)
	@for kind in $$($(BIN)/python -m tests.processors); do echo "processor: $$kind"; \
		NUMBA_CPU_NAME=$$kind NUMBA_CPU_FEATURES= NUMBA_CACHE_DIR="$(CURDIR)/.pytest_cache/numba-$$kind" \
		$(BIN)/pytest -m numeric $(NUMERIC) || exit 1; done

# The documentation as a site that opens offline, out/docs/index.html, and out/postproc.1 for man. Warnings are errors.
docs: $(STAMP)
	@echo "the site: about five minutes" >&2
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs out/docs
	$(BIN)/python -m sphinx -q -b man docs out

# Wheel and sdist, installed and tested outside the tree: PYTHONS="python3.11 python3.12 python3.13", EXTRAS="[all]".
packages: $(STAMP)
	$(BIN)/python tests/packages.py $(foreach one,$(PYTHONS),--python $(one)) $(if $(EXTRAS),--extras "$(EXTRAS)")

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff check --select D100,D101,D103,D419,ANN001,ANN201 toolpaths machines postproc
	$(BIN)/mypy

# Pinned versions with hashes, and the project itself from this tree, so that edits count at once.
$(STAMP): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed; found: $$(python3 --version 2>&1)." \
		"Install one, or name it: make PYTHON=/path/to/python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@test -x $(BIN)/pip || "$(PYTHON)" -m venv --clear .venv || { rm -rf .venv; \
		echo "$(PYTHON) cannot make a virtual environment; on Debian and Ubuntu: apt-get install python3-venv" >&2; exit 1; }
	@echo "installing into .venv: a minute or two" >&2
	$(BIN)/pip install $$(test -t 1 || echo --quiet) --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

# Newest versions that pyproject.toml allows. Run it with Python 3.11: a lock made there also serves 3.12 and 3.13.
lock: $(STAMP)
	$(BIN)/pip install --quiet --disable-pip-version-check pip-tools
	echo "# Pinned with hashes for Python 3.11 to 3.13, from pyproject.toml; renew with: make lock" > requirements.new
	$(BIN)/pip-compile --quiet --upgrade --all-extras --all-build-deps --allow-unsafe --generate-hashes --strip-extras \
		--no-header --no-annotate --no-emit-index-url --no-emit-find-links --no-emit-trusted-host \
		--output-file - pyproject.toml | sed '/^#/d;/^$$/d' >> requirements.new
	mv requirements.new requirements.lock

clean:
	rm -rf .venv out build *.egg-info
