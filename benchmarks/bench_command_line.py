"""The first contact, in wall time: the command's help and the demo."""

from __future__ import annotations

import subprocess
import sys

from interleaving import on_all_cores

import hydrodamp as hd


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
    ledger.within("hydrodamp demo: the 20 s allowed", demo.best, 20.0, target=1.0)


def test_an_hour(benchmark, ledger, tmp_path):
    """From a log of one hour at 10 Hz to a verdict: `probe`, then three models by the default."""
    campaign = hd.reenact(seed=5, duration=900.0)
    train, test = str(tmp_path / "train.csv"), str(tmp_path / "test.csv")
    hd.write_log(campaign.train, train)
    hd.write_log(campaign.test, test)
    parts = ("--train", train, "--test", test, "--models", "linear,fossen,prestero")

    def verdict() -> None:
        call("-m", "hydrodamp", "probe", train, "--vehicle", "vt690")
        call("-m", "hydrodamp", "compare", *parts, "--vehicle", "vt690")

    found, _ = on_all_cores(benchmark, verdict, lambda: call("-c", "pass"), rounds=1)
    ledger.within(
        "an hour at 10 Hz, probe and compare: the 60 s allowed", found.best, 60.0, target=1.0
    )
