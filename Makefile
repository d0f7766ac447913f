# One word each; CI calls the same commands.
.PHONY: check core format lint types test bench smoke build wheels cross docs

check: lint types test

build:            ## everything for work on the sources
	pip install -e ".[dev]"

core:             ## compile the C core in place, where a source is newer
	python hatch_build.py

wheels:           ## for all platforms, with zig, into dist/
	pip install --quiet hatchling ziglang
	python hatch_build.py wheels

format:
	ruff format .
	ruff check --fix .

lint:
	ruff format --check .
	ruff check .
	lint-imports

types:
	mypy

test:             ## all tests, slow ones too
	pytest -n auto -m "slow or not slow" --cov --cov-report=term-missing

bench:
	pytest benchmarks -o python_files="bench_*.py" --benchmark-only --benchmark-columns=min,median,max \
		--page docs/evidence/performance.md

smoke:            ## the headline ratios at reduced size, a minute at most
	python benchmarks/smoke.py

cross:            ## the core's bits on ARM (qemu-user) and Windows (wine), compiled with zig
	pip install --quiet ziglang
	HYDRODAMP_CROSS=1 pytest -n 0 tests/kernels/test_csrc.py

docs:             ## the pages, their notebooks run
	python -m sphinx -W -q -b html docs docs/_build/html
