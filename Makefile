# Everything a person types. Details live in CMakePresets.json and scripts/.
#
#   make demo     from a bare Debian 12 machine to an enhanced splat and a picture
#   make test     everything that is checked: all tests, and the rooms that handle input and memory by hand under sanitizers
#   make test-all the same with every room under sanitizers (half an hour more)
#   make build    the program (build/anchorsplat) and its tests; LAB=0 without data sets, training, evaluation, benchmarks
#   make install PREFIX=/usr/local   program, manual page, completions; make deb: build/anchorsplat_VERSION_ARCHITECTURE.deb
#   make wheel    build/wheels/anchorsplat-*.whl, the Python package with all that it needs; make python: one to import, for tests
#   make lint     clang-tidy and clang-format
#   make fuzz     mutated files against all readers, SECONDS=60 by default
#   make realdata DATA=DIR   checks on splats of your own
#   make viewer-test   the page of `anchorsplat view` in headless Chromium (installs a browser)
#   make lod-test   levels of detail (`anchorsplat convert --lod`) in the PlayCanvas engine in headless Chromium
#   make serve-test    the page and the API of `anchorsplat serve` in headless Chromium, under load and on Ray
#   make batch-test    `anchorsplat batch` with kills, an S3 and a cluster on this machine, four minutes
#   make web      the program in a browser: build/web/dist, a page; make npm: build/web/npm, the package (docs/web.md; half an hour)
#   make web-test the engine's unit tests as WebAssembly, the package beside the native program, the page in headless Chromium
#   make interop  files of ours read by other programs and theirs by us (scripts/interop.py says what it needs)
#   make lpips-check  LPIPS with its trained weights (fetched once, 64 MB) against the published values
#   make bench    measured ratios and figures
#   make gpu-test the GPU's kernels on Debian 13's driver, Dawn and headless Chromium, all in software (scripts/gpu-test.sh)
#   make gpu-bench   a GPU's times beside the CPU's and gsplat's, and how near its pictures are; GPU_BENCH="--device 1 --small"
#   make gpu-bench-pack   build/gpu-bench, the same for a machine that reaches no registry (docs/gpu.md)

JOBS ?= $(shell nproc)
SECONDS ?= 60

.PHONY: all build debug demo test viewer-test lint format fuzz realdata bench clean
all: build

# Only training needs LibTorch. It is a download of some hundred megabytes, so `build` and `demo` do without unless it is
# there already; `test` fetches it into .venv (scripts/install-torch.sh says from where). LEAN=1 leaves it out always.
ifdef LEAN
TORCH_FLAGS = -DANCHORSPLAT_TORCH=OFF
else
TORCH_FLAGS = -DANCHORSPLAT_TORCH=$(if $(wildcard .venv/anchorsplat-torch),ON,OFF)
endif
# LAB=0 builds the program without src/lab: no data sets from meshes, no training, no evaluation, no benchmarks.
LAB_FLAGS = -DANCHORSPLAT_LAB=$(if $(filter 0,$(LAB)),OFF,ON)
WITHOUT_LAB = $(if $(filter 0,$(LAB)),--without-lab)
# The Python package is built, and tested, where .venv has what that takes, which `make test` puts there.
PYTHON_FLAGS = $(if $(wildcard .venv/anchorsplat-python),-DANCHORSPLAT_PYTHON=ON -DPython_EXECUTABLE=$(CURDIR)/.venv/bin/python)

.PHONY: dependencies test-dependencies torch
dependencies:
	@scripts/install-dependencies.sh $(WITHOUT_LAB)

# Without WebGPU everything can be built and run but what works on a GPU, whose tests say then what is missing.
test-dependencies:
	@scripts/install-dependencies.sh --with-tests $(WITHOUT_LAB)
	@scripts/fetch-webgpu.sh || true

torch:
ifndef LEAN
	@scripts/install-dependencies.sh --with-torch
	@scripts/install-torch.sh
endif

.PHONY: python-dependencies python wheel
python-dependencies:
	@scripts/install-dependencies.sh --with-python
	@scripts/install-python.sh

python: python-dependencies
	@$(MAKE) --no-print-directory build

wheel: dependencies
	@scripts/install-dependencies.sh --with-python --with-packaging
	@scripts/fetch-webgpu.sh
	@JOBS=$(JOBS) scripts/build-wheel.sh

build: test-dependencies
	@cmake --preset release -DANCHORSPLAT_TESTS=ON $(TORCH_FLAGS) $(LAB_FLAGS) $(PYTHON_FLAGS) $(CMAKE_FLAGS) >build-configure.log 2>&1 || { cat build-configure.log; rm -f build-configure.log; exit 1; }
	@rm -f build-configure.log
	@cmake --build --preset release -j $(JOBS)

# Only the program: what `make demo` needs. A build folder that has the tests keeps them.
program: dependencies
	@scripts/fetch-webgpu.sh --optional
	@cmake --preset release $(if $(wildcard build/release/CMakeCache.txt),,-DANCHORSPLAT_TESTS=OFF) $(TORCH_FLAGS) $(LAB_FLAGS) $(CMAKE_FLAGS) >build-configure.log 2>&1 || { cat build-configure.log; rm -f build-configure.log; exit 1; }
	@rm -f build-configure.log
	@cmake --build --preset release -j $(JOBS) --target anchorsplat
.PHONY: program

debug: test-dependencies
	@cmake --preset debug $(CMAKE_FLAGS) >build-configure.log 2>&1 || { cat build-configure.log; rm -f build-configure.log; exit 1; }
	@rm -f build-configure.log
	@cmake --build --preset debug -j $(JOBS)

demo: program
	@scripts/demo.sh

debug-all: test-dependencies
	@cmake --preset debug-all $(CMAKE_FLAGS) >build-configure.log 2>&1 || { cat build-configure.log; rm -f build-configure.log; exit 1; }
	@rm -f build-configure.log
	@cmake --build --preset debug-all -j $(JOBS)

# A second make, because .venv decides the flags of the first when it starts.
test: torch python-dependencies
	@$(MAKE) --no-print-directory build debug
	@ctest --preset release -j $(JOBS)
	@ctest --preset debug -j $(JOBS)

test-all: torch python-dependencies
	@$(MAKE) --no-print-directory build debug-all
	@ctest --preset release -j $(JOBS)
	@ctest --preset debug-all -j $(JOBS)
.PHONY: debug-all test-all

viewer-test: build
	@scripts/viewer_test.sh build/anchorsplat

lod-test: build
	@scripts/lod_test.sh build/anchorsplat
.PHONY: lod-test

# The page in a browser, 1,000 malformed uploads, 200 requests, Ray: the service's tests that take minutes. PYTHON has the
# packages (pip install ".[serve,batch]" pytest httpx playwright), build/lean the package.
PYTHON ?= python3
serve-test: test-dependencies
	@cmake --preset lean -DANCHORSPLAT_PYTHON=ON -DPython_EXECUTABLE="$(shell command -v $(PYTHON))" $(CMAKE_FLAGS) >build-configure.log 2>&1 || { cat build-configure.log; rm -f build-configure.log; exit 1; }
	@rm -f build-configure.log
	@cmake --build --preset lean -j $(JOBS) --target anchorsplat_python_package
	@scripts/serve_test.sh $(PYTHON) build/lean/python
.PHONY: serve-test

# Compiled to WebAssembly in a Debian 13 of its own, which is kept in build/web/root.
web:
	@JOBS=$(JOBS) scripts/web/build.sh

# As `npm pack` makes it, which need not be here.
npm: web
	@name=build/web/anchorsplat-$$(sed -n 's/^project(anchorsplat VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt).tgz && \
	  tar -C build/web --transform 's,^npm,package,' --sort=name --owner=0 --group=0 --numeric-owner --mtime=@0 -czf $$name npm && ls $$name

web-test: build
	@JOBS=$(JOBS) scripts/web/test.sh build/release
.PHONY: web npm web-test

bench: program
	@build/anchorsplat bench render
	@build/anchorsplat bench io
	@build/anchorsplat bench convert
	@build/anchorsplat bench fit
	@build/anchorsplat bench network

gpu-test: build
	@JOBS=$(JOBS) scripts/gpu-test.sh build/release

gpu-bench: program
	@scripts/gpu-bench.sh $(GPU_BENCH)

gpu-bench-pack: program
	@scripts/install-missing.sh gpu-bench-pack strip=binutils cc=gcc /usr/lib/$(shell uname -m)-linux-gnu/libvulkan.so.1=libvulkan1
	@rm -rf build/gpu-bench
	@scripts/gpu-bench.sh --pack build/gpu-bench
.PHONY: gpu-test gpu-bench gpu-bench-pack

lint:
	@scripts/lint.sh

format:
	@git ls-files 'src/*.h' 'src/*.cc' 'python/*.h' 'python/*.cc' 'include/*.h' 'examples/*.cc' | xargs clang-format -i

fuzz: debug
	@scripts/fuzz.sh $(SECONDS)

realdata: program
	@scripts/realdata.sh "$(DATA)"

batch-test: python
	@.venv/bin/python -m pip --disable-pip-version-check install --quiet 's3fs>=2023.12' 'moto[server]>=5'
	@PYTHONPATH=build/release/python .venv/bin/python -m pytest -q python/tests/batch/long_machines.py python/tests/batch/long_folders.py
.PHONY: batch-test

interop: build
	@scripts/interop.py build/anchorsplat examples/biplane/input.ply
.PHONY: interop

lpips-check: torch
	@$(MAKE) --no-print-directory build
	@scripts/fetch-lpips.sh
	@scripts/lpips_check.sh build/anchorsplat
.PHONY: lpips-check

# Installed is the build without LibTorch; with TORCH_DIR=<libtorch>/share/cmake/Torch, of a LibTorch that stays where it is,
# LPIPS and training too. docs/install.md
PREFIX ?= /usr/local
ifdef TORCH_DIR
INSTALL_BUILD = build/with-torch
INSTALL_CONFIGURE = --preset lean -B $(INSTALL_BUILD) -DANCHORSPLAT_TORCH=ON -DTorch_DIR="$(abspath $(TORCH_DIR))" \
  -DANCHORSPLAT_PROGRAM_DIR="$(CURDIR)/$(INSTALL_BUILD)"
else ifeq ($(TORCH_FLAGS),-DANCHORSPLAT_TORCH=ON)
INSTALL_BUILD = build/lean
INSTALL_CONFIGURE = --preset lean
else
INSTALL_BUILD = build/release
INSTALL_CONFIGURE = --preset release $(TORCH_FLAGS)
endif
.PHONY: installable install deb
installable: dependencies
	@scripts/fetch-webgpu.sh --optional
	@cmake $(INSTALL_CONFIGURE) $(if $(wildcard $(INSTALL_BUILD)/CMakeCache.txt),,-DANCHORSPLAT_TESTS=OFF) $(CMAKE_FLAGS) >build-configure.log 2>&1 || { cat build-configure.log; rm -f build-configure.log; exit 1; }
	@rm -f build-configure.log
	@cmake --build $(INSTALL_BUILD) -j $(JOBS) --target anchorsplat_installable

install: installable
	@cmake --install $(INSTALL_BUILD) --prefix "$(abspath $(PREFIX))" --strip

deb: installable
	@scripts/install-dependencies.sh --with-packaging
	@cpack --config $(INSTALL_BUILD)/CPackConfig.cmake -B build >build/package.log || { cat build/package.log; exit 1; }
	@rm -rf build/_CPack_Packages build/package.log
	@ls build/anchorsplat_*.deb

clean:
	@rm -rf build
