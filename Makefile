# make study | turning-study | reproduce | audit | test | test-slow | test-all | test-mujoco3 | test-mjx | test-warp | test-models | warm-up | fuzz | steering | bench | lint | data | models | wheel | readme | docs | gallery | verification     PYTHON=python3.13 picks the interpreter
PYTHON ?= python3
VENV   ?= .venv-$(notdir $(PYTHON))
BIN    := $(VENV)/bin
export MPLBACKEND = Agg
# Small matrices: threads inside BLAS only get into the way of those over simulations.
export OPENBLAS_NUM_THREADS = 1

.PHONY: setup study turning-study reproduce audit test test-slow test-all test-mujoco3 test-mjx test-warp test-models warm-up fuzz steering coverage bench lint data models wheel readme docs gallery verification clean

setup: $(VENV)/.ready

$(VENV)/.ready: pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit("clearance_mj needs Python >= 3.11, this is " + sys.version.split()[0]) if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test,dev]'
	touch $@

study: setup
	$(BIN)/clearance-mj study data/table1_rig --out results/study

# The same of a shaft that turns: FRFs along y and z, orbits and run-ups.
turning-study: setup
	$(BIN)/clearance-mj study data/turning_rig --out results/turning_study

# The article's figures and tables beside ours, all of them or ITEMS="table_1 figure_02".
reproduce: setup
	$(BIN)/python -m experiments.article $(ITEMS) --out results/reproduce

audit: setup
	$(BIN)/python -m experiments.article.audit

# The pages of the documentation that the article's items and its audit make.
gallery: reproduce
	cp results/reproduce/*.md results/reproduce/*.png docs/experiments/
	$(BIN)/python -m experiments.article.audit --out docs/audit.md

# Three suites: `make test` for every commit, `make test-slow` before a change is called done, `make test-all` before a release.
# All run on every core, tests that share something on one of them; DURATIONS=1 writes a table of where their seconds go.
PYTEST = $(BIN)/python -m pytest -n auto --dist loadgroup
QUICK  = not slow and not release
TIMED  = $(if $(DURATIONS),--timings=results/durations_$@.md)

test: test-mujoco3
	$(PYTEST) -m '$(QUICK)' $(TIMED)

# What the tests call is compiled on every core before their workers start, which only load it.
warm-up: setup
	$(BIN)/python -m tests.warm_up

# Contacts, friction and drives on the MuJoCo that many have: the distribution mujoco, in a folder that Python looks into first.
MUJOCO3 = $(VENV)/mujoco3
ON_MUJOCO3 = PYTHONPATH=$(CURDIR)/$(MUJOCO3) $(PYTEST)
test-mujoco3: $(MUJOCO3)/.ready warm-up
	$(ON_MUJOCO3) -m '$(QUICK)' tests/physical/test_[cdflrs]*.py tests/physical/test_implicit.py

$(MUJOCO3)/.ready: $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --upgrade --target $(MUJOCO3) -c constraints.txt mujoco
	touch $@

# Friction and drives in MJX, and rigs in JAX: JAX and MJX with that MuJoCo, in a folder of their own, too.
MJX = $(VENV)/mjx
test-mjx: $(MJX)/.ready
	PYTHONPATH=$(CURDIR)/$(MJX) $(BIN)/python -m pytest -m '' tests/physical/test_mjx.py tests/engines/test_mjx.py

$(MJX)/.ready: $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --upgrade --target $(MJX) -c constraints.txt \
		mujoco mujoco-mjx jax jaxlib ml_dtypes opt_einsum absl-py etils trimesh
	touch $@

# The same in MuJoCo Warp, which goes with the MuJoCo of the environment.
WARP = $(VENV)/warp
test-warp: $(WARP)/.ready
	PYTHONPATH=$(CURDIR)/$(WARP) $(BIN)/python -m pytest -m '' tests/physical/test_warp.py

$(WARP)/.ready: $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --upgrade --target $(WARP) -c constraints.txt \
		mujoco-warp warp-lang absl-py etils
	touch $@

test-slow: $(VENV)/.models $(VENV)/.browser warm-up
	$(PYTEST) -m 'slow and not release' $(TIMED)

# Everything, then again with sums in another order and for any processor: OpenBLAS' kernels and numba's code are others than
# the machine's own. Haswell's kernels need AVX2, Prescott's run anywhere.
OTHER_BLAS = $(if $(shell grep -m1 avx512f /proc/cpuinfo),Haswell,Prescott)
test-all: test test-slow
	$(PYTEST) -m release $(TIMED)
	$(ON_MUJOCO3) -m '' tests/physical
	$(BIN)/python -m experiments.benches.mapping --benches 200
	OPENBLAS_CORETYPE=$(OTHER_BLAS) NUMBA_CPU_NAME=generic $(PYTEST) -m 'not release'

# Of foreign models only the files are read; gymnasium itself runs an example. gymnasium-robotics and dm_control depend on
# the package mujoco 3, which would overwrite mujoco-core: hence none of what they depend on.
$(VENV)/.models: $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps -c constraints.txt gymnasium farama-notifications gymnasium-robotics dm_control playground
	touch $@

# Pages are tried in the machine's own Chromium; without one their tests are skipped.
$(VENV)/.browser: $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[browser]'
	touch $@

test-models: $(VENV)/.models
	$(BIN)/python -m pytest -m '' tests/physical/test_models.py tests/physical/test_robots.py

fuzz: setup
	$(BIN)/python -m tests.fuzz --out results/fuzz

# Every steering controller on six manoeuvres: page, figures and every run.
steering: setup
	$(BIN)/python -m experiments.steering.comparison --out results/steering

# Compiled functions do not show: tests of small ones run a second time, interpreted.
INTERPRETED = tests/clearance tests/experiments/testrig/test_physics.py tests/vehicle/test_path.py tests/verification/test_bouc_wen.py

coverage: setup
	mkdir -p results/coverage
	$(BIN)/coverage erase
	$(BIN)/coverage run -m pytest -m '$(QUICK)'
	NUMBA_DISABLE_JIT=1 $(BIN)/coverage run -m pytest $(INTERPRETED)
	$(BIN)/coverage combine -q
	$(BIN)/coverage report --skip-covered --sort=miss

$(VENV)/.bench: $(VENV)/.ready
	$(BIN)/pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[exudyn]'
	touch $@

# pyHarm, which periodic responses are compared with, needs pandas < 3: an environment of its own.
$(VENV)-pyharm/.ready:
	$(PYTHON) -m venv $(VENV)-pyharm
	$(VENV)-pyharm/bin/pip install --quiet --disable-pip-version-check pyharm-os==1.2.2 jax==0.5.3
	touch $@

# ROSS, which turning shafts are compared with, needs plotly < 6 and brings some 60 packages: an environment of its own.
$(VENV)-ross/.ready:
	$(PYTHON) -m venv $(VENV)-ross
	$(VENV)-ross/bin/pip install --quiet --disable-pip-version-check ross-rotordynamics==2.3.0 "plotly<6"
	touch $@

bench: export PYHARM_PYTHON = $(VENV)-pyharm/bin/python
bench: export ROSS_PYTHON = $(VENV)-ross/bin/python
bench: $(VENV)/.bench $(VENV)/.models $(VENV)-pyharm/.ready $(VENV)-ross/.ready
	$(BIN)/python -m benchmarks --out results/bench.json

lint: setup
	$(BIN)/ruff check . && $(BIN)/ruff format --check . && $(BIN)/mypy

data: setup
	$(BIN)/python -m experiments.testrig data/table1_rig
	$(BIN)/python -m experiments.benches.space.shipped data/turning_rig

models: setup
	$(BIN)/python -c "from clearance_mj import Rig, engines; open('models/table1_rig_links.xml', 'w').write(engines.build_links(Rig.load('models/table1_rig.toml')).to_xml())"

# The package for those who bring a MuJoCo model, as one file.
wheel: setup
	$(BIN)/pip wheel --quiet --disable-pip-version-check --no-deps --wheel-dir dist ./packaging/physical

readme: setup
	$(BIN)/python -m benchmarks.readme

docs: setup
	$(BIN)/python -m sphinx -q -W --keep-going -j auto -d docs/_build/doctrees docs docs/_build/html

verification: setup
	$(BIN)/python -m pytest tests/verification tests/rotors tests/engines/test_space.py tests/periodic/test_space_whirl.py \
		tests/clearance/test_short_bearing.py tests/experiments/testrig tests/identify tests/real tests/experiments/test_free_decays.py --verification docs/verification.md

clean:
	rm -rf $(VENV) $(VENV)-pyharm $(VENV)-ross results docs/_build docs/api/generated
