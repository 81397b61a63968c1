# `make report` and `make test` do all set-up on a fresh Debian 12; nothing needs to be installed by hand.

VENV := .venv
PYTHON ?= python3
BIN := $(VENV)/bin
READY := $(VENV)/.ready
CYCLES := $(VENV)/.cycles
HAS_VENV := $(PYTHON) -c 'import ensurepip; import venv'
HAS_ATOMIC := $(PYTHON) -c 'import ctypes; ctypes.CDLL("libatomic.so.1")'
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.DEFAULT_GOAL := help
.PHONY: help report test lint bench prove soundness docs pictures lock renderers cycles compiler browser clean

help:  ## Say what can be made
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

report: $(READY) renderers  ## Draw the four examples in every renderer there is and write out/report.html
	@$(BIN)/crossray check --terms --out out || test $$? -eq 1  # 1: the report is written and something disagrees

test: $(READY) renderers cycles browser lint  ## Check style and types, run the tests
	$(BIN)/python -m pytest

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: $(READY) renderers compiler  ## Time the tracer beside its peers and write docs/benchmarks.md (15 minutes)
	$(BIN)/python tests/benchmarks/bench.py

prove: $(READY)  ## Prove that wrong pictures are told from right ones and write docs/power.md (half an hour)
	$(BIN)/python tests/benchmarks/prove.py

soundness: $(READY)  ## Prove certified pixels a second time, every one, with Arb (minutes)
	$(BIN)/python tests/benchmarks/soundness.py

pictures: report browser  ## Draw the pictures of the README
	$(BIN)/python docs/pictures.py
	$(BIN)/python docs/grade_pictures.py

docs: $(READY) renderers  ## Write the generated pages of docs/ (minutes)
	$(BIN)/python docs/scenes.py
	$(BIN)/python docs/mistakes.py
	$(BIN)/python docs/renderers.py

lock: $(READY)  ## Pin the newest versions of all dependencies, with hashes
	$(BIN)/pip-compile --quiet --upgrade --generate-hashes --allow-unsafe --strip-extras --extra dev --no-header \
		--no-emit-index-url --no-emit-find-links --no-emit-trusted-host --no-emit-options \
		--output-file requirements.txt pyproject.toml

$(READY): requirements.txt pyproject.toml
	@$(HAS_ATOMIC) 2>/dev/null || $(call debian,libatomic1,$(HAS_ATOMIC),required)
	@$(HAS_VENV) 2>/dev/null || $(call debian,python3-venv python3-pip,$(HAS_VENV),required)
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --require-hashes --only-binary :all: -r requirements.txt
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

renderers:
	@command -v povray >/dev/null || $(call debian,povray,povray)
	@command -v tachyon >/dev/null || $(call debian,tachyon-bin-nox,tachyon)

cycles: $(READY)  ## Install Blender Cycles too (374 MB, Python 3.11 only), or say why not and go on
	@test -f $(CYCLES) && test $(CYCLES) -nt requirements-cycles.txt || { echo "installing Blender Cycles"; \
		$(BIN)/python -m pip install --quiet --no-deps --require-hashes --only-binary :all: -r requirements-cycles.txt \
		&& touch $(CYCLES); } || echo "missing: Blender Cycles, without which the rest works" >&2

compiler:
	@command -v g++ >/dev/null || $(call debian,g++,g++)

browser:
	@command -v chromium >/dev/null || $(call debian,chromium,chromium)

# Install Debian packages $(1) that provide the program $(2) where that is allowed, else say the line to type and go on;
# in continuous integration, and where $(3) is given, a missing one is a failure.
define debian
{ if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	echo "installing $(1)"; \
	{ apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends $(1); } >/dev/null; \
  fi; \
  $(if $(3),$(2),command -v $(2)) >/dev/null 2>&1 || { \
	echo "missing: $(1). To install: sudo apt-get install $(1)" >&2; \
	$(if $(3),false,[ "$$CI" != true ]); }; }
endef

clean:  ## Remove what was made
	rm -rf $(VENV) out export dist build
