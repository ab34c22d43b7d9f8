# Everything sets itself up: a machine with Python 3.11, gcc and make needs nothing else.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
RUN := $(VENV)/.installed
DEV := $(VENV)/.installed-dev
# Tests start the program hundreds of times: without bytecode on disk, each start compiles all of it.
export PYTHONDONTWRITEBYTECODE :=
# A microphone on a sound card, and a sound card to test it with; all else works without.
SOUND := pipewire wireplumber pipewire-alsa libportaudio2

# Objects of ours and what each is made of.
OBJECTS := mug:ceramic bowl:ceramic plate:ceramic pitcher:polycarbonate tray:wood wrench:steel

.PHONY: help install demo demo-shape objectfiles test slow hunt lint types contracts docs data reference results bench tables sound clean

help: ## what can be asked for
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "Touchstone needs Python 3.11 or later; $(PYTHON) is $$($(PYTHON) --version). Say: make PYTHON=python3.11"; exit 2; }
	@$(PYTHON) -m venv $(VENV) \
	  || { echo "python3-venv is missing; on Debian: apt-get install python3-venv"; exit 2; }

$(RUN): $(VENV)/bin/python pyproject.toml constraints.txt
	@echo "installing into $(VENV) (once; a few minutes)"
	@$(PIP) install --constraint constraints.txt --editable .
	@touch $@

$(DEV): $(VENV)/bin/python pyproject.toml constraints.txt
	@echo "installing into $(VENV) (once; a few minutes)"
	@$(PIP) install --no-compile --constraint constraints.txt --editable '.[dev]'
	@$(BIN)/python -m compileall -qq -j 0 $(VENV)/lib || true # pip compiles on one core
	@touch $(RUN) $@

install: $(RUN) ## the programs, without the developers' tools

sound: ## Debian's packages for a microphone on a sound card, if this may install them
	@dpkg -s $(SOUND) >/dev/null 2>&1 && exit 0; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  { apt-get update -qq && apt-get install -y -qq --no-install-recommends $(SOUND); } >/dev/null 2>&1 && exit 0; \
	fi; \
	echo "no sound card can be mocked here, so its tests are skipped; on Debian: sudo apt-get install $(SOUND)"

demo: $(RUN) ## localize a contact on the mocked bench, and write the report
	@$(BIN)/touchstone demo

demo-shape: $(RUN) ## a picture, four presses where they say most, and the shape of an object never drawn
	@$(BIN)/touchstone demo shape-reconstruction

objectfiles: $(RUN) ## harness/shipped/objects anew: networks of the sound, touch and look of our six objects (half an hour)
	@rm -rf build/objects && mkdir -p build/objects
	@for each in $(OBJECTS); do for part in audio touch vision; do \
	  $(BIN)/touchstone object build builtin:$${each%:*} --material $${each#*:} --only $$part \
	    --profile shipped --threads 1 --licence Apache-2.0 --out build/objects/$${each%:*} || exit; \
	done; done
	@rm -rf harness/shipped/objects && mv build/objects harness/shipped/objects

# Each core has a worker; threads of linear algebra would only wait for each other.
test slow hunt: export OPENBLAS_NUM_THREADS := 1

test: ## everything CI checks
	@$(MAKE) --no-print-directory --jobs $(DEV) sound
	@$(MAKE) --no-print-directory --jobs lint types contracts docs
	@$(BIN)/python -m pytest -m "not benchmark and not slow" -n auto --dist loadscope

slow: $(DEV) ## what takes minutes and rarely breaks
	@$(BIN)/python -m pytest -m slow

hunt: $(DEV) ## the property tests on cases drawn anew
	@$(BIN)/python -m pytest -m "not benchmark and not slow" --hypothesis-profile=hunt -k "$(or $(K),test)"

lint: $(DEV)
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/python -m tests.docs.language

types: $(DEV)
	@$(BIN)/mypy --num-workers auto

contracts: $(DEV)
	@$(BIN)/lint-imports

# Any warning fails. Pages that did not change are kept from a build that passed: others would not warn again.
docs: $(DEV) ## the documentation as a site with search, in build/site
	@test -e build/doctrees/passed || rm -rf build/site build/doctrees
	@rm -f build/doctrees/passed
	@$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet -c docs/site -d build/doctrees . build/site
	@touch build/doctrees/passed

data: $(DEV) ## the public data of the tests (75 MB, once), to TOUCHSTONE_DATA or the user's cache
	@$(BIN)/python -m tests.support.fetch_data

reference: $(DEV) ## docs/reference and the calls of all effects, from the models and the tables
	@$(BIN)/python -m tests.docs.reference
	@$(BIN)/python -m tests.harness.effects.wiring
	@$(BIN)/ruff format -q tests/harness/effects/wired.py

results: $(DEV) ## docs/results, from the JSON in docs/results/data
	@$(BIN)/python -m tests.docs.results

bench: $(DEV) ## timings with their spread, beside the peers
	@$(BIN)/python -m pytest -m benchmark -s

tables: $(RUN) ## the localization table (long; resumes where it was stopped)
	@$(BIN)/touchstone tables contact-localization

clean: ## runs, caches and the virtual environment
	rm -rf $(VENV) runs build *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
