# One word each; CI calls the same commands.
.PHONY: check core format lint types test bench build wheels docs

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

test:
	pytest -n auto --cov --cov-report=term-missing

bench:
	pytest benchmarks -o python_files="bench_*.py" --benchmark-only --benchmark-columns=min,median,max

docs:             ## the pages, their notebooks run
	python -m sphinx -W -q -b html docs docs/_build/html
