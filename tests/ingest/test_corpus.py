"""Logs of strangers, from thirty writers, through the draft alone; against the truth in them."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import stranger_kinds  # noqa: F401  # adds its cases
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording
from hydrodamp.data.units import unit_factor
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.inspection.draft import MIN_CONFIDENCE, SURE_CONFIDENCE, select_channels
from hydrodamp.ingest.inspection.probe import MIN_DRAFT_CONFIDENCE, probe
from hydrodamp.ingest.inspection.roles import Roles
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.read import read_recording
from strangers import CASES, EPOCH, Case, Truth

TRUTH = Truth()
SPEEDS = dict(zip("uvwpqr", np.hstack((TRUTH.body, TRUTH.rates)).T, strict=True))


def wrong(log: Log, case: Case) -> Iterator[str]:
    """Yield what a log lacks of the truth, or has otherwise, beside what a case lets it have."""
    holds = case.holds.split()
    at = log.time - EPOCH if log.time[0] > 1e9 else log.elapsed

    def differs(values: np.ndarray, true: np.ndarray, tolerance: float = case.tolerance) -> bool:
        known = np.interp(at, TRUTH.time, true)
        inner = slice(5, -5)  # what is derived is less sure at the ends
        apart = np.sqrt(np.mean((values - known)[inner] ** 2))
        return bool(apart > tolerance * np.std(true[5:-5]) + 1e-9)

    if log.n < 0.95 * len(TRUTH.time):
        yield f"only {log.n} samples"
    planar = not {"p", "q"} & set(holds)
    turning = {"r": np.gradient(TRUTH.angles[:, 2], TRUTH.time)} if planar else {}
    yield from (f"an invented {name}" for name in case.lacks.split() if name in log.velocity_names)
    for name, true in (SPEEDS | turning).items():
        if name in log.velocity_names:
            if name in holds and differs(log.velocity[:, "uvwpqr".index(name)], true):
                yield name
        elif name in holds:
            yield f"no {name}"
    if "attitude" in holds:
        seen = None if log.attitude is None else Rotation.from_quat(log.attitude, scalar_first=True)
        near = np.searchsorted(TRUTH.time, at).clip(0, len(TRUTH.time) - 1)
        true = TRUTH.turns[near]
        if seen is None:
            yield "no attitude"
        elif planar:
            turn = Rotation.from_euler("ZYX", TRUTH.angles[near][:, ::-1] * (1, 0, 0))
            if np.median((seen * turn.inv()).magnitude()) > 0.03:
                yield "heading"
        elif np.median((seen * true.inv()).magnitude()) > 0.03:
            yield "attitude"
    if "wrench" in holds and (
        log.wrench is None
        or any(
            differs(log.wrench[:, k], TRUTH.wrench[:, k])
            for k in ((0, 1, 5) if planar else range(6))
        )
    ):
        yield "wrench"
    for name, true in (("rudder", TRUTH.rudder), ("rpm", TRUTH.rpm)):
        if name in holds:
            alike = [
                abs(np.corrcoef(one, np.interp(at, TRUTH.time, true))[0, 1])
                for one in log.commands.T
                if np.std(one)
            ]
            if max(alike, default=0.0) < 0.8:
                yield f"no {name}"


@pytest.mark.parametrize("name", CASES)
def test_a_stranger_s_log(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    recording = read_recording(case.write(tmp_path, TRUTH))
    found = probe(recording)
    text = found.draft.text
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if case.loads:
            assert found.draft.confidence >= MIN_DRAFT_CONFIDENCE, text
            assert [*wrong(found.mapping().log(recording), case)] == [], text
            return
        assert found.draft.confidence < MIN_DRAFT_CONFIDENCE, text
        assert case.says in text or any(case.says in note for note in found.notes), text
        for before, after in case.add:
            assert before in text, text
            text = text.replace(before, after)
        if case.add:
            mapping = LogMapping.from_dict(parse_yaml(text, "the draft"), "the draft")
            assert [*wrong(mapping.log(recording), case)] == [], text


@pytest.mark.parametrize("name", CASES)
def test_no_sure_channel_is_wrong(name: str, tmp_path: Path) -> None:
    """Above 70 % every channel of a draft is what the draft says, in its unit and its sign."""
    case = CASES[name]
    recording = read_recording(case.write(tmp_path, TRUTH))
    roles = probe(recording).roles
    assert [*wrong_channels(recording, roles, case, SURE_CONFIDENCE)] == []


@pytest.mark.parametrize("name", [name for name, one in CASES.items() if one.commands is not None])
def test_no_channel_of_a_draft_is_wrong(name: str, tmp_path: Path) -> None:
    """However unsure: every channel is what the draft says, and so are the commands."""
    case = CASES[name]
    recording = read_recording(case.write(tmp_path, TRUTH))
    found = probe(recording)
    assert [*wrong_channels(recording, found.roles, case, MIN_CONFIDENCE - 1)] == [], (
        found.draft.text
    )
    drafted_commands = {
        one.column for one in found.roles.all_of("commands") if one.confidence >= MIN_CONFIDENCE
    }
    assert drafted_commands == {*(case.commands or "").split()}, found.draft.text
    names = {one.role.removeprefix("velocity.") for one in select_channels(found.roles)}
    assert names.isdisjoint(case.lacks.split()), found.draft.text


def wrong_channels(recording: Recording, roles: Roles, case: Case, above: int) -> Iterator[str]:
    """Yield the drafted channels above a confidence that are not what the draft says."""
    for one in select_channels(roles):
        if one.confidence <= above or any(map(one.role.startswith, case.apart.split())):
            continue
        column = one.column.removeprefix(f"{one.topic}.")
        values = recording.topic(one.topic).fields[column] * one.sign
        values = values * (unit_factor(one.unit) if one.unit else 1.0)
        known = np.isfinite(values)
        rows = known if len(values) == len(TRUTH.time) else np.ones(len(TRUTH.time), np.bool_)
        if rows.sum() != known.sum():
            yield f"{one.role} is {one.column}, of another clock"
            continue
        start = values[known][0] if one.role.startswith("position.") else None  # from its start
        apart = []
        for true in TRUTH.roles(one.role, roles.vertical_axis.body):
            off = values[known] - true[rows] - (0 if start is None else start - true[rows][0])
            apart.append(np.median(np.abs(2 * np.sin(off / 2))) / np.std(true))  # but for turns
        if min(apart, default=1.0) > 0.05:
            yield f"{one.role} is {one.column}, {one.confidence} %"
