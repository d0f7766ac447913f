# One word each; CI calls the same commands.
.PHONY: check format lint types test bench build docs

check: lint types test

build:            ## compile the C core in place, for work on the sources
	pip install -e ".[dev]"

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
