# `make book` and `make test` each work as the first command after a clone: Python 3.11 or newer, make
# and access to the Python package index are enough. `make help` lists the targets.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.SUFFIXES:
.DEFAULT_GOAL := help

PYTHON = $(shell command -v python3.11 || command -v python3)
JOBS = 2
VENV = .venv
BIN = $(VENV)/bin
ENV = $(VENV)/.tmalib

# The same bytes on every machine: one BLAS thread, fixed dates, hashes, time zone and locale, and no
# setting of the user's Python, Jupyter or Matplotlib. MPLBACKEND would remove every inline figure.
export OPENBLAS_NUM_THREADS = 1
export OMP_NUM_THREADS = 1
export MKL_NUM_THREADS = 1
export SOURCE_DATE_EPOCH = 1767225600
export PYTHONHASHSEED = 0
export PYTHONNOUSERSITE = 1
export PYDEVD_DISABLE_FILE_VALIDATION = 1
export TZ = UTC
export LC_ALL = C
export PYTHONUTF8 = 1
export MPLCONFIGDIR = $(CURDIR)/build/config/matplotlib
export IPYTHONDIR = $(CURDIR)/build/config/ipython
export JUPYTER_CONFIG_DIR = $(CURDIR)/build/config/jupyter
export JUPYTER_DATA_DIR = $(CURDIR)/build/config/jupyter-data
unexport MPLBACKEND MATPLOTLIBRC PYTHONPATH PYTHONHOME PYTHONSTARTUP PYTHONWARNINGS PYTEST_ADDOPTS

.PHONY: help env lock lint notebooks claims book test site-test figures bench serve clean FORCE

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*##  *\(.*\)/\1\t\2/p' Makefile | expand -t 14

env: $(ENV)  ## create .venv from environment.txt (about 2 minutes)

# A changed lock starts from an empty environment, so nothing stale stays behind. The stamp is a copy of the
# lock that was installed: its content decides, not its date.
ifneq ($(shell cmp -s environment.txt $(VENV)/.requirements && echo same), same)
$(VENV)/.requirements: FORCE
endif
$(VENV)/.requirements:
	@echo "==> Python environment: .venv from environment.txt"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed")'
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --require-hashes --only-binary :all: -r environment.txt
	@cp environment.txt $@

$(ENV): $(VENV)/.requirements pyproject.toml
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	@touch $@

lock: $(ENV)  ## compile environment.in into environment.txt; UPGRADE=--upgrade moves every pin
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --only-binary :all: \
	  $(UPGRADE) --custom-compile-command "make lock" environment.in -o environment.txt

# Notebooks are executed here and nowhere else. What decides is the content of the files below, not
# their dates: the book's own cache would not notice a change in tmalib.
build/inputs: FORCE
	@mkdir -p build
	@find notebooks tmalib environment.txt -type f ! -path '*/__pycache__/*' ! -path '*/.ipynb_checkpoints/*' \
	  | sort | xargs cksum > $@.tmp
	@if cmp -s $@.tmp $@; then rm $@.tmp; else mv $@.tmp $@; fi

build/executed/.done: build/inputs | $(ENV)
	@echo "==> Executing the notebooks"
	@rm -rf build/executing && mkdir -p build/executing build/config/ipython
	@cp -R notebooks build/executing/ && find build/executing -name .ipynb_checkpoints -exec rm -rf {} +
	$(BIN)/python -m pytest --nbmake --overwrite --nbmake-timeout=900 -n $(JOBS) --dist worksteal \
	  --durations=0 -p no:cacheprovider -W default build/executing
	$(BIN)/python tools/cache_notebooks.py build/executing build/.jupyter_cache
	@rm -rf build/executed && mv build/executing build/executed && touch $@

notebooks: build/executed/.done  ## execute every notebook, once

build/claims.json: build/executed/.done tools/collect_claims.py
	@echo "==> Collecting the claims"
	$(BIN)/python tools/collect_claims.py build/executed $@

claims: build/claims.json  ## judge every printed number: build/claims.json

build/provenance.json: build/executed/.done tools/trace_notebooks.py
	@echo "==> Tracing figures and tables to the code that made them"
	$(BIN)/python tools/trace_notebooks.py build/executed $@

build/figures/index.csv: build/claims.json build/provenance.json tools/export_figures.py tools/draw_verdicts.py
	$(BIN)/python tools/export_figures.py build/executed build/claims.json build/provenance.json build/figures

book: build/figures/index.csv  ## the book, built and checked: build/html/book/intro.html
	@echo "==> Building the book"
	$(BIN)/python tools/check_prose.py book notebooks
	@rm -rf build/site
	$(BIN)/jupyter-book build . --config book/_config.yml --toc book/_toc.yml --path-output build/site \
	  -W -n --keep-going 2>&1 | tee build/book.log
	@test "$$(grep -c 'Using cached notebook' build/book.log)" = "$$(find notebooks -name '*.ipynb' \
	  ! -path '*/.ipynb_checkpoints/*' | wc -l)" || { echo "the book executed a notebook again, or left one out"; exit 1; }
	@rm build/site/_build/html/.buildinfo  # serves incremental builds, and differs between directories
	$(BIN)/python tools/check_site.py build/site/_build/html
	@rm -rf build/html && mv build/site/_build/html build/html
	@echo "==> The book: build/html/index.html"

test: build/executed/.done  ## execute the notebooks (once) and run the tests
	@echo "==> Tests"
	$(BIN)/python -m pytest tests tmalib --doctest-modules --ignore=tests/site --ignore=tests/benchmarks -n $(JOBS)

site-test: $(ENV)  ## check the built book in Chromium
	@echo "==> Browser checks of the book"
	$(BIN)/python -m pytest tests/site -n $(JOBS)

bench: $(ENV)  ## measure the speed of the estimators
	$(BIN)/python -m pytest tests/benchmarks -s

figures: build/figures/index.csv  ## write every figure and table to figures/
	rm -rf figures && cp -R build/figures figures

lint: $(ENV)  ## style, notebooks without outputs, import directions, citation file, workflow
	@echo "==> Lint"
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	find notebooks -name '*.ipynb' ! -path '*/.ipynb_checkpoints/*' -exec $(BIN)/nbstripout --verify {} +
	$(BIN)/lint-imports --no-cache
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/zizmor --offline --no-progress -qq .github/workflows

serve:  ## show the built book at http://localhost:8000
	$(PYTHON) -m http.server --directory build/html 8000

clean:  ## remove everything that was built, not the environment
	rm -rf build
