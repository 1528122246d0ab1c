# From a fresh clone with nothing but python3 and make:
#   make demo    the main job on the bundled example, into out/demo
#   make test    lint, types and the quick tests: every fact once, in minutes
#   make test-all   the same with the slow tests: more seeds, samples and dialects, whole diagnoses; takes longer
#   make docs    the documentation, into out/docs; warnings are errors, internal links are checked
#   make blind   campaigns with hidden effects, about an hour on two cores; continues a run that was stopped
#   make blind-laws   campaigns with hidden laws, about half an hour on two cores; continues a run that was stopped
#   make blind-layers causes on top of wrong patterns, three causes, next tests; about 1.5 hours on one core
#   make mutants 300 changes of the code at random, each tried against the quick tests; about two hours; continues too
#   make release the wheel and the source archive in dist/, tried outside of the checkout; see SECURITY.md
#   make hashes  the pins with hashes anew, after a change of constraints.txt; needs a connection
#   make audit   the pinned versions against published advisories; needs a connection
#   make torture faults, kills, damage and hostile input, tried until something is lost; hours; docs/results/torture.md
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt
# The same packages in a tenth of the time. It does not read the settings of pip: pip installs where these are needed.
UV     := $(BIN)/uv pip install --quiet --python $(BIN)/python -c constraints.txt
unexport PYTHONDONTWRITEBYTECODE  # without bytecode in .venv every process compiles all that it imports

.PHONY: demo test test-all lint types pytest docs links bench blind blind-laws blind-layers mutants release hashes audit torture clean

$(VENV)/.run: pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) uv
	$(UV) -e . || $(PIP) -e .
	touch $@

$(VENV)/.dev: $(VENV)/.run
	$(UV) -e '.[dev]' || $(PIP) -e '.[dev]'
	touch $@

demo: $(VENV)/.run
	$(BIN)/tribo demo -o out/demo

lint: $(VENV)/.dev
	$(BIN)/ruff check .

types: $(VENV)/.dev
	$(BIN)/mypy

pytest: $(VENV)/.dev
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder -m "not slow"

test: lint
	$(MAKE) -j 2 types pytest  # at once: mypy takes one process

test-all: lint types $(VENV)/.dev
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

$(VENV)/.docs: $(VENV)/.run
	$(UV) -e '.[docs]' || $(PIP) -e '.[docs]'
	touch $@

docs: $(VENV)/.docs
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs out/docs

links: $(VENV)/.docs
	$(BIN)/python -m sphinx -q -b linkcheck docs out/links  # external ones are listed in out/links/output.txt

bench: $(VENV)/.dev
	$(BIN)/tribo bench --large

blind: $(VENV)/.dev
	$(BIN)/python benchmarks/blind.py run out/blind.jsonl

blind-laws: $(VENV)/.dev
	$(BIN)/python benchmarks/blind_laws.py run out/blind-laws.jsonl

blind-layers: $(VENV)/.dev
	$(BIN)/python benchmarks/blind_layers.py run out/blind-layers.jsonl

$(VENV)/.mutants: $(VENV)/.dev
	$(PIP) -e '.[mutants]'
	touch $@

mutants: $(VENV)/.mutants
	$(BIN)/python benchmarks/mutants.py run out/mutants

$(VENV)/.release: $(VENV)/.run
	$(PIP) -e '.[release]'
	touch $@

release: $(VENV)/.release
	rm -rf dist $(VENV)/tried
	$(BIN)/python -m build --outdir dist
	$(PYTHON) -m venv $(VENV)/tried
	$(VENV)/tried/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --only-binary :all: \
	  -r constraints-hashed.txt
	$(VENV)/tried/bin/python -m pip install --quiet --disable-pip-version-check --no-deps dist/*.whl
	cd $(VENV)/tried && bin/tribo demo -o demo --quiet && bin/tribo verify demo

HASHED = --universal --python-version 3.11 --generate-hashes --no-header --no-annotate -c constraints.txt

hashes: $(VENV)/.release
	for file in constraints-hashed.txt constraints-hashed-pipelines.txt; do sed -n '/^#/p' $$file > $$file.part; done
	$(BIN)/uv pip compile --quiet pyproject.toml --extra cluster $(HASHED) >> constraints-hashed.txt.part
	$(BIN)/uv pip compile --quiet pyproject.toml --extra cluster --extra pipelines $(HASHED) \
	  >> constraints-hashed-pipelines.txt.part
	for file in constraints-hashed.txt constraints-hashed-pipelines.txt; do mv $$file.part $$file; done

audit: $(VENV)/.release
	$(BIN)/pip-audit --strict --disable-pip --require-hashes $(AUDIT) -r constraints-hashed-pipelines.txt

torture: $(VENV)/.dev
	$(BIN)/python benchmarks/torture.py --out out/torture

clean:
	rm -rf $(VENV) out build dist .pytest_cache .mypy_cache .ruff_cache
