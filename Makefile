# `make book` and `make test` each work as the first command after a clone: Linux or macOS, Python 3.11 or
# newer, GNU make 4 and access to the Python package index are enough. `make help` lists the targets.

ifeq ($(filter oneshell,$(.FEATURES)),)
$(error GNU make 4 or newer is needed; this is make $(MAKE_VERSION))
endif

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.SUFFIXES:
.DEFAULT_GOAL := help

PYTHON = $(shell command -v python3.11 || command -v python3)
JOBS = 2
SEEDS = 1 2 3 4 5
WHICH = not book
VENV = .venv
LOCKS = environment.txt
BIN = $(VENV)/bin
ENV = $(VENV)/.tmalib

# The same bytes on every machine: one BLAS thread, fixed dates, hashes, time zone and locale, and no
# setting of the user's Python, pip, Jupyter or Matplotlib. MPLBACKEND would remove every inline figure,
# PYTHONOPTIMIZE every assertion; the others would lead to another interpreter, library or folder.
export OPENBLAS_NUM_THREADS = 1
export OMP_NUM_THREADS = 1
export MKL_NUM_THREADS = 1
export SOURCE_DATE_EPOCH = 1767225600
export FORCE_SOURCE_DATE = 1
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
export TMALIB_RUNS = $(CURDIR)/build/runs
unexport MPLBACKEND MATPLOTLIBRC PYTHONPATH PYTHONHOME PYTHONSTARTUP PYTHONWARNINGS PYTHONOPTIMIZE \
  PYTHONSAFEPATH PYTHONPLATLIBDIR PYTEST_ADDOPTS PYTEST_PLUGINS JUPYTER_PATH JUPYTER_CONFIG_PATH \
  PIP_USER PIP_TARGET PIP_PREFIX PIP_ROOT PIP_PYTHON VIRTUAL_ENV

.PHONY: help env lock lint notebooks claims book pdf tex test unit site-test figures peers bench million conformance \
  problems times starts mutants peers-lock reseed study study-lock lab serve clean FORCE

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*##  *\(.*\)/\1\t\2/p' Makefile | expand -t 14

env: $(ENV)  ## create .venv from environment.txt (about 2 minutes)

# A changed lock starts from an empty environment, so nothing stale stays behind; so does a checkout that was
# copied or moved, for an environment knows its own place and that of the library. The stamp holds the place
# and the lock that was installed: its content decides, not its date.
ifneq ($(shell { pwd -P; cat $(LOCKS); } | cmp -s - $(VENV)/.requirements && echo same), same)
$(VENV)/.requirements: FORCE
endif
$(VENV)/.requirements:
	@echo "==> Python environment: $(VENV) from $(LOCKS)"
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed")'
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --require-hashes --only-binary :all: $(addprefix -r ,$(LOCKS))
	@{ pwd -P; cat $(LOCKS); } > $@

$(ENV): $(VENV)/.requirements pyproject.toml
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	@touch $@

lock: $(ENV)  ## compile environment.in into environment.txt, and tools/lab's; UPGRADE=--upgrade moves every pin
	for lock in environment tools/lab/environment; do \
	  $(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --only-binary :all: \
	    $(UPGRADE) --custom-compile-command "make lock" $$lock.in -o $$lock.txt; \
	done

# Chapters are executed here and nowhere else, and only those whose code, imports, ledger or lock have changed:
# a change of prose needs no execution.
notebooks: $(ENV)  ## execute the chapters whose code has changed
	@echo "==> Executing chapters"
	@mkdir -p build/config/ipython
	$(BIN)/python tools/build.py stale
	@if [ -n "$$(find build/executing -name '*.ipynb' 2>/dev/null)" ]; then \
	  $(BIN)/python -m pytest --nbmake --overwrite --nbmake-timeout=900 -n $(JOBS) --dist worksteal \
	    --durations=0 -p no:cacheprovider -W default build/executing || failed=yes; \
	  $(BIN)/python tools/build.py keep && test -z "$${failed:-}"; \
	else $(BIN)/python tools/build.py keep; fi

claims: notebooks  ## judge every printed value: build/claims.json
	@echo "==> Collecting the claims"
	$(BIN)/python tools/build.py judge

book: claims  ## the book, built and checked: build/html/book/intro.html
	@echo "==> Building the book"
	$(BIN)/python tools/build.py check
	@rm -rf build/site
	$(BIN)/jupyter-book build . --config book/_config.yml --toc book/_toc.yml --path-output build/site \
	  -W -n --keep-going 2>&1 | tee build/book.log
	@from=$$($(BIN)/python -c 'from importlib.metadata import files; \
	  print(*(f.locate().parent for f in files("sphinx-mathjax-offline") if f.name == "tex-chtml-full.js"))'); \
	  to=build/site/_build/html/_static/mathjax; mkdir -p $$to/output/chtml/fonts; \
	  cp "$$from/tex-chtml-full.js" $$to; cp -R "$$from/output/chtml/fonts/woff-v2" $$to/output/chtml/fonts
	@rm build/site/_build/html/.buildinfo  # serves incremental builds, and differs between directories
	SITE=build/site/_build/html $(BIN)/python -m pytest -q tests/site/test_pages.py -n $(JOBS)
	@rm -rf build/html && mv build/site/_build/html build/html
	@echo "==> The book: build/html/index.html"

# TeX is not in the lock: latexmk and XeLaTeX come from the system, and `.ci/run` names Debian's packages.
tex:
	@for tool in latexmk xelatex; do command -v $$tool >/dev/null || { echo "make pdf: $$tool is missing; on" \
	  "Debian: apt-get install $$(sed -n 's/^tex="\(.*\)"$$/\1/p' .ci/run)"; exit 1; }; done

pdf: tex claims  ## the whole book as a PDF, added to the built book: build/html/angles-only.pdf (needs TeX)
	@test -d build/html || { echo "make pdf: there is no built book to add it to; first make book"; exit 1; }
	@echo "==> Building the PDF"
	@rm -rf build/pdf
	$(BIN)/jupyter-book build . --builder latex --config book/_config.yml --toc book/_toc.yml \
	  --path-output build/pdf -W -n --keep-going 2>&1 | tee build/pdf.log
	@cd build/pdf/_build/latex && latexmk -pdfxe -interaction=nonstopmode -halt-on-error -silent angles-only.tex
	PDF=build/pdf/_build/latex/angles-only.pdf $(BIN)/python -m pytest -q tests/site/test_pdf.py -n $(JOBS)
	$(BIN)/python tools/build.py offer
	@echo "==> The PDF: build/html/angles-only.pdf"

unit: $(ENV)  ## the tests that need no executed chapter (WHICH="not book and not slow" for fewer)
	@echo "==> Unit tests"
	$(BIN)/python -m pytest tests tmalib -m "$(WHICH)" --ignore=tests/site --ignore=tests/benchmarks -n $(JOBS)

test: claims  ## execute the chapters whose code has changed, and run all tests
	@echo "==> Tests"
	$(BIN)/python -m pytest tests tmalib --ignore=tests/site --ignore=tests/benchmarks -n $(JOBS)

mutants: $(ENV)  ## plant defects in a copy, one by one, and see that a test finds each (SAMPLE=12: so many of them)
	@echo "==> Mutants"
	$(BIN)/python tests/mutants/run.py $(SAMPLE)

site-test: $(ENV)  ## check the built book in Chromium
	@echo "==> Browser checks of the book"
	$(BIN)/python -m pytest tests/site -n $(JOBS)

# Other estimators, and what runs a cluster, in an environment of their own; numpy and scipy are the book's.
PEERS = .venv-peers
$(PEERS)/.requirements: tools/peers/environment.txt Makefile
	@echo "==> Python environment of the peers: $(PEERS)"
	$(PYTHON) -m venv --clear $(PEERS)
	$(PEERS)/bin/python -m pip install --quiet --require-hashes --only-binary :all: -r tools/peers/environment.txt
	@echo "$(CURDIR)" > "$$($(PEERS)/bin/python -c 'import site; print(site.getsitepackages()[0])')/tmalib.pth"
	@touch $@

peers: $(PEERS)/.requirements  ## scipy, Numba, JAX, C, filterpy and Stone Soup on the same data; a cluster on loopback
	@echo "==> Peers"
	PYTHONPATH=tests/benchmarks $(PEERS)/bin/python -m pytest -q -p no:cacheprovider tests/peers

bench: $(PEERS)/.requirements  ## the speed of all of these in one run, with goals: tmalib/speed (three minutes, quiet machine)
	XLA_FLAGS=--xla_cpu_multi_thread_eigen=false $(PEERS)/bin/python tests/benchmarks/run.py tmalib/speed

million: $(PEERS)/.requirements  ## a million runs of a table on a cluster on loopback: tmalib/speed (five minutes)
	$(PEERS)/bin/python tests/benchmarks/million.py build/million
	cp build/million/million.json tmalib/speed

conformance: $(PEERS)/.requirements  ## what other estimators make of the forty problems: tmalib/conformance
	$(PEERS)/bin/python tests/benchmarks/conformance.py tmalib/conformance/results.json

problems: $(ENV)  ## make the forty problems anew, and search for their answers
	PYTHONPATH=tests $(BIN)/python tests/conformance/make_problems.py tmalib/conformance

times: $(ENV)  ## execute all chapters anew, and say how long each takes: tmalib/speed (ten minutes, quiet machine)
	rm -rf build/executed build/runs && mkdir -p build/config/ipython
	$(BIN)/python tools/build.py stale
	$(BIN)/python tools/times.py $(JOBS)
	$(BIN)/python tools/build.py keep

starts: $(ENV)  ## how many fits without a start are lost, over random scenarios (STARTS=830 for 5 000)
	$(BIN)/python -m pytest tests/benchmarks/test_starts.py -s

peers-lock: $(ENV)  ## compile tools/peers/environment.in into its environment.txt
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --only-binary :all: \
	  -c environment.txt --custom-compile-command "make peers-lock" tools/peers/environment.in \
	  -o tools/peers/environment.txt

# From the package index, by version and hash: recorded tracks, and Stone Soup with what it needs, in an environment
# of its own. What is counted goes into tmalib/study, the book reads it there; continuous integration does not run it.
STUDY = build/study
study: $(ENV)  ## bearings between recorded ships and aircraft, and Stone Soup's answers, anew: tmalib/study (10 minutes)
	rm -rf $(STUDY) && mkdir -p $(STUDY)
	$(BIN)/python -m venv $(STUDY)/venv
	$(STUDY)/venv/bin/python -m pip install --quiet --require-hashes --only-binary :all: -r tools/study/environment.txt
	$(STUDY)/venv/bin/python -m pip download --quiet --no-deps --no-build-isolation --require-hashes \
	  -r tools/study/archives.txt --dest $(STUDY)/archives
	$(BIN)/python tools/study.py $(STUDY)/archives
	$(STUDY)/venv/bin/python tools/study/stone_soup.py tmalib/samples/ownship.csv tmalib/samples/bearings.csv \
	  > $(STUDY)/stone_soup.csv
	mv $(STUDY)/stone_soup.csv tmalib/study

study-lock: $(ENV)  ## compile tools/study/environment.in into its environment.txt
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --only-binary :all: \
	  --custom-compile-command "make study-lock" tools/study/environment.in -o tools/study/environment.txt

# JupyterLab over the chapters, in an environment of its own that also has all of the book's: nothing is executed
# for the book there. OPTIONS go to JupyterLab, as in OPTIONS="--no-browser --port=9000".
lab:  ## run chapters by hand in JupyterLab (the first time about 2 minutes, to create .venv-lab)
	$(MAKE) env VENV=.venv-lab LOCKS="environment.txt tools/lab/environment.txt"
	.venv-lab/bin/jupyter lab $(OPTIONS) notebooks

figures: claims  ## write every figure and table to figures/
	rm -rf figures && cp -R build/figures figures

lint: $(ENV)  ## style, notebooks without outputs, import directions, types, citation file, workflow
	@echo "==> Lint"
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	find notebooks -name '*.ipynb' ! -path '*/.ipynb_checkpoints/*' -exec $(BIN)/nbstripout --verify {} +
	$(BIN)/lint-imports --no-cache
	$(BIN)/mypy --cache-dir build/mypy
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/zizmor --offline --no-progress -qq .github/workflows

reseed: claims  ## judge with other seeds, and list the verdicts that change (SEEDS="1 2")
	$(BIN)/python tools/reseed.py $(SEEDS) $(CHAPTERS)

serve:  ## show the built book at http://localhost:8000
	$(PYTHON) -m http.server --directory build/html 8000

clean:  ## remove everything that was built, not the environment
	rm -rf build
