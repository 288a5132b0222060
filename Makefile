# Needs python3 (3.11 or newer), make and a package index; everything else is installed, pinned, into .venv.
# Test modules are compiled once, also where the environment says otherwise.
unexport PYTHONDONTWRITEBYTECODE

PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
DEMO ?= ferryid-out

.PHONY: quick test docs evidence size demo picture bench attack faults real campaign rivals plans thesis proof proof-sea proof-real \
  wavy fixtures wheel-check lint clean uplot

# By files, so that the fixtures of a file are made once, in the order of tests/conftest.py. WORKERS=4 for as many cores, each
# takes up to 1.2 GB.
WORKERS ?= 2
SPREAD = -n $(WORKERS) --dist loadfile --no-loadscope-reorder

# What most changes break, within a minute.
quick: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/pytest $(SPREAD) -q -m "not slow"

# Everything. The types are checked beside the first tests. DURATIONS=0 lists the time of every test, not of the slowest alone.
test: DURATIONS ?= 25
test: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy & $(BIN)/pytest $(SPREAD) --durations=$(DURATIONS); code=$$?; wait $$! && exit $$code

# The documents as a site, in build/site, with the pages that are made from the code; a broken link is an error.
docs: $(VENV)/installed
	$(BIN)/python -m tests.docs.drawing
	$(BIN)/python -m tests.docs.thresholds
	$(BIN)/mkdocs build --strict

# Which pages in reports/ are older than the sources that they were made from.
evidence: $(VENV)/installed
	$(BIN)/python -m tests.evidence

# Lines, files and the modules that a diagnosis loads; the figures in CHANGELOG.md. CHECKOUT=PATH counts another version's.
size: $(VENV)/installed
	$(BIN)/python -m tests.size $(CHECKOUT)

demo: $(VENV)/installed
	$(BIN)/ferryid simulate twelve-corner --out $(DEMO) --overwrite
	$(BIN)/ferryid fit $(DEMO)/twelve-corner.mcap --vessel milliampere --delta 0.4 --sigma 0.4 --out $(DEMO)

# The picture in the README.
picture: demo
	mkdir -p reports/demo
	cp $(DEMO)/reports/milliampere-v1/forces-twelve-corner.svg reports/demo/forces.svg
	$(BIN)/python -m tests.evidence reports/demo/forces.svg

# Writes reports/benchmarks.md; QUICK=1 prints the page of a run on short logs instead, to see that everything runs. A run that
# was ended goes on with the tables that are missing, as long as no source has changed.
bench: $(VENV)/installed $(VENV)/bench-installed
	$(BIN)/python -m tests.bench $(if $(QUICK),--quick)

# Damaged and hostile logs of every format: writes reports/attack.md. CASES=N takes more of them, SEED=N repeats a run; several
# seeds (SEED="1 2") are several runs on one page.
CASES ?= 2000
attack: SEED = $(shell date +%s)
attack: $(VENV)/installed
	$(BIN)/python -m tests.attack --cases $(CASES) $(foreach seed,$(SEED),--seed $(seed))

# Fits and diagnoses of the real recordings, where they lie in ../shared/data; writes reports/real.md and reports/real.
real: $(VENV)/installed
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.real

# Campaigns of the same recordings, with the wind withheld and in still air, groups of logs, other instruments: writes
# reports/campaign.md.
campaign: $(VENV)/installed
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.real campaign

# ferryid's estimators beside output error, sparse and stepwise regression: writes reports/rivals.md. TRIALS=N simulates that many
# trials of each kind, SECOND=N takes so many cases of the proof; the recordings are left out where they are absent. A run that was
# ended goes on from build/rivals/lines.jsonl.
TRIALS ?= 13
SECOND ?= 30
rivals: $(VENV)/installed
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.rivals --trials $(TRIALS) --second $(SECOND)

# Planned trials against the usual one on VESSELS simulated vessels: writes reports/plan.md.
VESSELS ?= 20
plans: $(VENV)/installed
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.plans --vessels $(VESSELS)

# The thesis's trials, flown again: writes reports/thesis.md and its figures.
thesis: $(VENV)/installed
	$(BIN)/ferryid reproduce thesis --out reports --json reports/thesis.json
	$(BIN)/python -m tests.evidence reports/thesis.md

# Injects effects into trials of an independent plant and diagnoses them blind: writes reports/proof.json and figures, and with
# the stored results of proof-real the page reports/proof.md. SEED=N draws other cases, RUNS=N more of them. It goes on where it
# was interrupted. The draw by default is one for twenty minutes on two cores, of two sizes of each effect; RUNS=1 has all five,
# RUNS=10 takes a night.
SINGLE_LOGS = clean,single,span,vessel,pair,triple,weather,crossings,short,wrong base,outside
proof: SEED ?= 20271250
proof: RUNS ?= 0.5
proof: $(VENV)/installed
	$(BIN)/ferryid prove --only '$(SINGLE_LOGS)' --seed $(SEED) --runs $(RUNS) --out $(DEMO) --json $(DEMO)/proof.json
	mkdir -p reports/proof && cp $(DEMO)/proof/proof/*.svg $(DEMO)/proof/answers.json $(DEMO)/proof/seal.json \
	  $(DEMO)/proof/lines/diagnosed.jsonl reports/proof/
	cp $(DEMO)/proof.json reports/proof.json
	$(BIN)/python -m tests.evidence reports/proof.json
	$(BIN)/python -m tests.proof

# The same of campaigns that look like those at sea: writes reports/proof-sea.json, and with the other results reports/proof.md.
proof-sea: SEED ?= 20271252
proof-sea: RUNS ?= 0.5
proof-sea: $(VENV)/installed
	$(BIN)/ferryid prove --only sea --seed $(SEED) --runs $(RUNS) --out $(DEMO)/sea --json $(DEMO)/proof-sea.json
	mkdir -p reports/proof-sea && cp $(DEMO)/proof-sea.json reports/
	cp $(DEMO)/sea/proof/answers.json $(DEMO)/sea/proof/seal.json $(DEMO)/sea/proof/lines/diagnosed.jsonl reports/proof-sea/
	$(BIN)/python -m tests.evidence reports/proof-sea.json
	$(BIN)/python -m tests.proof

# Conceals effects in real recordings, where they are present, and diagnoses them blind: writes reports/proof-real.json and
# figures, and with the stored results of proof the page reports/proof.md. SEED=N and RUNS=N as for the proof; about twenty
# minutes on two cores.
proof-real: SEED ?= 20271251
proof-real: RUNS ?= 2
proof-real: $(VENV)/installed
	$(BIN)/ferryid prove --real tests/real/recordings.toml --seed $(SEED) --runs $(RUNS) --out $(DEMO) \
	  --json $(DEMO)/proof-real.json
	mkdir -p reports/proof-real && cp $(DEMO)/proof-real.json reports/
	cp $(DEMO)/proof-real/proof-real/*.svg $(DEMO)/proof-real/answers.json $(DEMO)/proof-real/seal.json \
	  $(DEMO)/proof-real/lines/diagnosed.jsonl reports/proof-real/
	$(BIN)/python -m tests.evidence reports/proof-real.json
	$(BIN)/python -m tests.proof

# Learns a hull in waves that nobody measured, and uses it in calm water: writes reports/waves.md.
wavy: $(VENV)/installed
	$(BIN)/python -m tests.wavy

# A full disk, an I/O error, a kill and a loss of power at every operation of the commands that write: prints a table.
# SAMPLE=N takes that many of the cases.
faults: $(VENV)/installed
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.faults $(if $(SAMPLE),--sample $(SAMPLE))

fixtures: $(VENV)/installed
	$(BIN)/python -m fixtures

# Builds the wheel and uses it in an environment that holds nothing else.
wheel-check: $(VENV)/installed
	rm -rf build dist $(VENV)/wheel
	$(BIN)/pip wheel --quiet --no-deps --wheel-dir dist .
	$(PYTHON) -m venv $(VENV)/wheel
	$(VENV)/wheel/bin/pip install --quiet --constraint constraints.txt pipx uv
	PIPX_HOME=$(abspath $(VENV)/wheel/pipx) PIPX_BIN_DIR=$(abspath $(VENV)/wheel/apps) \
	  PIP_CONSTRAINT=$(abspath constraints.txt) PIP_NO_COMPILE=1 $(VENV)/wheel/bin/pipx install --quiet dist/*.whl
	UV_CONSTRAINT=$(abspath constraints.txt) $(VENV)/wheel/bin/uvx --quiet --from dist/*.whl ferryid --version
	cd $(VENV)/wheel && apps/ferryid doctor && apps/ferryid simulate four-corner --log four.bag --overwrite \
	  && apps/ferryid fit four.bag --vessel milliampere --out out && apps/ferryid models --out out

# uv is quicker than pip, which does it where uv cannot be had or is not set up for the index that pip knows.
PIP = $(BIN)/pip install --quiet --disable-pip-version-check --constraint constraints.txt
install = $(PIP) uv && $(BIN)/uv pip install --quiet --compile-bytecode --python $(BIN)/python --constraint constraints.txt \
	  --editable '$(1)' || $(PIP) --editable '$(1)'

$(VENV)/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(call install,.[test])
	-$(MAKE) --no-print-directory $(STATIC)/uplot.js
	touch $@

STATIC = ferryid/report/static
# The library that draws interactive figures, by npm; where it cannot be had, pages keep their static figures.
uplot: $(STATIC)/uplot.js

UPLOT = 1.6.32
UPLOT_SHA256 = 4b8a8191e425658e3ea8c8c1314b0fc679c861ee3a1af2b20c7b16ba50b5133d
$(STATIC)/uplot.js:
	mkdir -p build
	npm pack --silent uplot@$(UPLOT) --pack-destination build
	echo "$(UPLOT_SHA256)  build/uplot-$(UPLOT).tgz" | sha256sum --check --quiet
	tar -xzOf build/uplot-$(UPLOT).tgz package/LICENSE > $(STATIC)/uplot-LICENSE.txt
	tar -xzOf build/uplot-$(UPLOT).tgz package/dist/uPlot.min.css > $(STATIC)/uplot.css
	tar -xzOf build/uplot-$(UPLOT).tgz package/dist/uPlot.iife.min.js > build/uplot.js && mv build/uplot.js $@

$(VENV)/bench-installed: $(VENV)/installed
	$(call install,.[bench])
	touch $@

clean:
	rm -rf $(VENV) build dist ferryid-out
