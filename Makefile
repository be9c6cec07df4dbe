# make demo    set up, then the shipped example from records to report
# make test    the test suite, with ALL=1 what takes seconds a test, too, which make thorough runs by itself;
# make slow    statistics that take minutes
# make fuzz    3,000 spoiled inputs, none of which may bring a command down;  make kill  runs that are killed and resumed
# make goldens every command against what it printed and wrote before (about 10 minutes);  ONLY='fit-* errors' for some
# make bench   speed, beside other samplers, on one core;  make large  20 million samples, 40 rigs, 300 campaigns
# make reports the report of every example, into reports/;  make cards  what the priors of every model card say
# make dossier docs/measured.md and its pictures, from measured records in the folder DATA
# make lint    style, types, arrows between the rooms
# make kernels what the first command would compile, by what the filters gave before
# make docs    HTML in docs/_build/html
# make lock    new lock files (needs uv);  make clean  remove everything that was built
#
# Every target makes the environment that it needs. PYTHON=/path/to/python3.13 chooses the interpreter.

.PHONY: demo test thorough slow fuzz kill goldens large bench reports cards dossier lint kernels docs lock clean

# The arrays are small: threads of the linear algebra library would only get in each other's way.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1

ONE_CORE := $(shell command -v taskset >/dev/null 2>&1 && echo taskset -c 0)

demo: .venv/ready
	.venv/bin/scruton report examples/rectangle-4to1 --bridge examples/rectangle-4to1/bridge.toml -o out/rectangle-4to1 --force

test: .venv/ready
	.venv/bin/python -m pytest -n auto --dist loadfile $(if $(ALL),-m 'not slow')

thorough: .venv/ready
	.venv/bin/python -m pytest -n auto --dist loadfile -m 'thorough and not slow'

slow: .venv/ready
	.venv/bin/python -m pytest -n auto -m slow

fuzz: .venv/ready
	.venv/bin/python -m tests.fuzz --cases 3000 --seed 1 --jobs 2

kill: .venv/ready
	.venv/bin/python -m tests.fuzz.kill --moments 40 --seed 1

goldens: .venv/ready
	.venv/bin/python -m tests.goldens compare --jobs 2 $(if $(ONLY),--only $(ONLY))

large: .venv/ready
	.venv/bin/python -m benchmarks.large

bench: .venv-bench/ready
	$(ONE_CORE) .venv-bench/bin/python -m benchmarks

reports: .venv/ready
	.venv/bin/python tools/reports.py

cards: .venv/ready
	.venv/bin/python tools/prior_pictures.py

DATA ?= ../shared/data

dossier: .venv/ready
	.venv/bin/python -m tools.dossier $(DATA)

lint: .venv/ready
	.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy
	.venv/bin/lint-imports

kernels: .venv/ready
	.venv/bin/python -m tests.goldens compare --only filters

docs: .venv/ready
	.venv/bin/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

lock:
	tools/lock.sh

clean:
	rm -rf .venv .venv-bench docs/_build build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
	find src tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +

.venv/ready: requirements.lock pyproject.toml tools/setup.sh
	tools/setup.sh .venv requirements.lock
	@touch $@

.venv-bench/ready: requirements-bench.lock pyproject.toml tools/setup.sh
	tools/setup.sh .venv-bench requirements-bench.lock
	@touch $@
