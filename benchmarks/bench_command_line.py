"""The first contact, in wall time: the command's help and the demo."""

from __future__ import annotations

import subprocess
import sys

from interleaving import on_all_cores


def call(*words: str) -> None:
    subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)


def test_help(benchmark, ledger):
    ours, bare = on_all_cores(
        benchmark,
        lambda: call("-m", "hydrodamp", "--help"),
        lambda: call("-c", "pass"),
    )
    ledger.within("hydrodamp --help: the 0.3 s allowed", ours.best, 0.3, target=1.0)
    ledger.within("hydrodamp --help: python -c pass", ours.best, bare.best)


def test_demo(benchmark, ledger):
    demo, _ = on_all_cores(
        benchmark,
        lambda: call("-m", "hydrodamp", "demo", "--json"),
        lambda: call("-c", "pass"),
        rounds=2,
    )
    ledger.within("hydrodamp demo: the 60 s allowed", demo.best, 60.0, target=1.0)
