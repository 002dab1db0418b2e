# Each target sets up what it needs. The first call takes minutes, later ones seconds.

PYTHON ?= python3
JOBS ?= 2
# without bytecode on disk every process compiles its libraries anew, most of its start
unexport PYTHONDONTWRITEBYTECODE

BIN := .venv/bin
# what pyrender and libsumo load at run time
LIBRARIES := libegl1 libgl1 libgl1-mesa-dri libx11-6 libxext6 libxrender1 libatomic1
TORCH := 2.13.0
DEMO := results/runs/demo
DEMO_TRACKERS := condensation,directional-90,directional-45,directional-22,dsp,still

.PHONY: demo test test-all test-compat test-train attack oracle statistics filters bench \
    bench-before particles separation sim-to-real lint format house clean

demo: .venv/installed
	@$(BIN)/simbench doctor
	@$(BIN)/simbench run poles bridge free-flow --frames 220 \
	    --trackers $(DEMO_TRACKERS) --seeds 0:3 --jobs $(JOBS) --out $(DEMO)
	@echo "open $(CURDIR)/$(DEMO)/report.html"

test: lint .venv/chromium
	$(BIN)/pytest -n $(JOBS)
	$(BIN)/simbench check --baseline results/baselines/ci.json --jobs $(JOBS)

test-all: lint .venv/chromium
	$(BIN)/pytest -n $(JOBS) --cov --cov-report=term -m "not bench"
	$(BIN)/simbench check --baseline results/baselines/ci.json --jobs $(JOBS)

# the toolkits of others, unmodified, read and score what 'simbench generate' writes
test-compat: .venv-compat/installed
	.venv-compat/bin/pytest tests/compat

# trainings with tiny recipes, in an environment that has PyTorch
test-train: .venv-train/installed
	.venv-train/bin/python -m pytest -n $(JOBS) -m train tests/learning

# kills, bad trackers, hostile files, bad places; the table is in results/attack.md
attack: .venv/developer
	$(BIN)/python -m tests.attack

# coverage, power and false alarms by simulation; the tables are in results/statistics.md
statistics: .venv/developer
	$(BIN)/python -m tests.statistics

# an independent ray caster sees the library; the table is in results/oracle.md
oracle: .venv/developer
	$(BIN)/python -m tests.verification.library_oracle $(JOBS)

# particle filters of an earlier commit, of this one, and by the papers, on films and on
# real clips: make filters BASE=COMMIT FILTERS_OPTIONS="--clips FOLDER"; resumes
filters: .venv/developer
	$(BIN)/python -m tests.filters $(BASE) $(FILTERS_OPTIONS)

# how well the encoder tells targets from their surroundings, into docs/encoder.md:
# make separation SEPARATION_OPTIONS="--clips FOLDER"
separation: .venv/developer
	$(BIN)/python -m tests.separation $(SEPARATION_OPTIONS)

# networks trained on films alone, on real clips, into results/papers/sim-to-real.md:
# make sim-to-real SIM_TO_REAL_OPTIONS="--clips FOLDER"; hours, resumes
sim-to-real: .venv-train/installed
	.venv-train/bin/python -m tests.sim_to_real $(SIM_TO_REAL_OPTIONS)

# docs/particles.svg: time of a frame against the number of particles
particles: .venv/developer
	$(BIN)/python -m tests.filters.particles

# OpenCV's KCF is in the contrib build only, which cannot stand beside the plain one
bench: .venv-bench/installed
	.venv-bench/bin/pytest -m bench -p no:xdist --benchmark-disable-gc

# rendering against an earlier commit: make bench-before BASE=COMMIT, 10 minutes
bench-before: .venv/developer
	$(BIN)/python -m tests.bench.compare_with_base $(BASE) $(BENCH_OPTIONS)

lint: .venv/developer
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.dependabot .github/dependabot.yml
	$(BIN)/mypy

# the rooms of the package and the imports between them
house: .venv/python
	$(BIN)/python docs/draw_house.py . docs/house.svg

format: .venv/developer
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf .venv .venv-bench .venv-compat .venv-train build dist *.egg-info .coverage* results/runs
	rm -rf .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.venv/python:
	@.ci/python-environment $(PYTHON) .venv
	@touch $@

.venv/installed: .venv/python pyproject.toml
	@.ci/system-packages $(LIBRARIES)
	@$(BIN)/pip install --quiet --disable-pip-version-check -e .
	@touch $@

.venv/developer: .venv/installed
	@$(BIN)/pip install --quiet --disable-pip-version-check -e '.[dev]'
	@$(BIN)/simbench doctor
	@touch $@

# the report's test drives a real browser
.venv/chromium: .venv/developer
	@command -v chromium >/dev/null || command -v google-chrome >/dev/null \
	    || .ci/system-packages chromium
	@touch $@

.venv-bench/installed: pyproject.toml
	@.ci/python-environment $(PYTHON) .venv-bench
	@.ci/system-packages $(LIBRARIES)
	@.venv-bench/bin/pip install --quiet --disable-pip-version-check -e '.[dev]'
	@.venv-bench/bin/pip uninstall --quiet -y opencv-python-headless
	@.venv-bench/bin/pip install --quiet --disable-pip-version-check \
	    opencv-contrib-python-headless
	@touch $@

# The packages of .venv, and PyTorch beside them, which takes a third of the time of an
# environment with all. It is the CPU build: what pip takes by default brings gigabytes for
# GPUs. Where that index cannot be reached, the configured ones serve.
.venv-train/installed: .venv/developer
	@$(PYTHON) -m venv .venv-train
	@for python in $(BIN) .venv-train/bin; do \
	    $$python/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))'; \
	done | { read -r ours; read -r folder; \
	    echo "import site; site.addsitedir('$$ours')" > "$$folder/developer.pth"; }
	@.venv-train/bin/pip install --quiet --disable-pip-version-check --retries 0 \
	    --extra-index-url https://download.pytorch.org/whl/cpu torch==$(TORCH)
	@touch $@

# The toolkits agree with what simbench asks for, so one environment holds both. But
# vot-toolkit brings a second build of OpenCV, which lies over ours: one is taken out.
.venv-compat/installed: pyproject.toml tests/compat/requirements.txt
	@.ci/python-environment $(PYTHON) .venv-compat
	@.ci/system-packages $(LIBRARIES)
	@.venv-compat/bin/pip install --quiet --disable-pip-version-check \
	    -e . -r tests/compat/requirements.txt
	@.venv-compat/bin/pip uninstall --quiet -y opencv-python opencv-python-headless
	@.venv-compat/bin/pip install --quiet --disable-pip-version-check \
	    opencv-python-headless
	@touch $@
