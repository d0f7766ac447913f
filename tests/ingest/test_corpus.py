"""Logs of strangers, from thirty writers, through the draft alone; against the truth in them."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hydrodamp.data.channels import unit_factor
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.inspection.draft import MIN_CONFIDENCE, SURE_CONFIDENCE, select_channels
from hydrodamp.ingest.inspection.probe import MIN_DRAFT_CONFIDENCE, probe
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.read import read_recording
from strangers import CASES, EPOCH, Truth, turned

TRUTH = Truth()
SPEEDS = dict(zip("uvwpqr", np.hstack((TRUTH.body, TRUTH.rates)).T, strict=True))


def wrong(log, case):
    """Yield what a log lacks of the truth, or has otherwise, beside what a case lets it have."""
    holds = case.holds.split()
    at = log.time - EPOCH if log.time[0] > 1e9 else log.elapsed

    def differs(values, true, tolerance=case.tolerance):
        known = np.interp(at, TRUTH.time, true)
        inner = slice(5, -5)  # what is derived is less sure at the ends
        rms_error = np.sqrt(np.mean((values - known)[inner] ** 2))
        return bool(rms_error > tolerance * np.std(true[5:-5]) + 1e-9)

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
    if "attitude" in holds and log.attitude is None:
        yield "no attitude"
    elif "attitude" in holds:
        near = np.searchsorted(TRUTH.time, at).clip(0, len(TRUTH.time) - 1)
        true = turned(TRUTH.angles[near] * ((0, 0, 1) if planar else 1))
        off = Rotation.from_quat(log.attitude, scalar_first=True) * true.inv()
        if np.median(off.magnitude()) > 0.03:
            yield "attitude"
    axes = (0, 1, 5) if planar else range(6)
    if "wrench" in holds and (
        log.wrench is None or any(differs(log.wrench[:, k], TRUTH.wrench[:, k]) for k in axes)
    ):
        yield "wrench"
    for name, true in (("rudder", TRUTH.rudder), ("rpm", TRUTH.rpm)):
        if name in holds:
            matches = [
                abs(np.corrcoef(item, np.interp(at, TRUTH.time, true))[0, 1])
                for item in log.commands.T
                if np.std(item)
            ]
            if max(matches, default=0.0) < 0.8:
                yield f"no {name}"


def names_of_cases():
    """Yield the names; slow are bags, MATLAB files and the cases whose commands are listed."""
    for name, case in CASES.items():
        is_slow = case.commands is not None or name.startswith(("ros", "matlab"))
        yield pytest.param(name, marks=[pytest.mark.slow] if is_slow else [])


@pytest.mark.slow
@pytest.mark.parametrize("name", [*names_of_cases()])
def test_a_stranger_s_log(name, tmp_path):
    """No sure channel of the draft is wrong; where commands are listed, no channel at all."""
    case = CASES[name]
    recording = read_recording(case.write(tmp_path, TRUTH))
    probed = probe(recording)
    text, roles = probed.draft.text, probed.roles
    above = SURE_CONFIDENCE if case.commands is None else MIN_CONFIDENCE - 1
    assert [*wrong_channels(recording, roles, case, above)] == [], text
    if case.commands is not None:
        commands = {x.column for x in roles.all_of("commands") if x.confidence >= MIN_CONFIDENCE}
        assert commands == {*case.commands.split()}, text
        names = {item.role.removeprefix("velocity.") for item in select_channels(roles)}
        assert names.isdisjoint(case.lacks.split()), text
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if case.loads:
            assert probed.draft.confidence >= MIN_DRAFT_CONFIDENCE, text
            assert [*wrong(probed.mapping().log(recording), case)] == [], text
            return
        assert probed.draft.confidence < MIN_DRAFT_CONFIDENCE, text
        assert case.says in text or any(case.says in note for note in probed.notes), text
        for before, after in case.add:
            assert before in text, text
            text = text.replace(before, after)
        if case.add:
            mapping = LogMapping.from_dict(parse_yaml(text, "the draft"), "the draft")
            assert [*wrong(mapping.log(recording), case)] == [], text


def wrong_channels(recording, roles, case, above):
    """Yield the drafted channels above a confidence that are not what the draft says."""
    for item in select_channels(roles):
        if item.confidence <= above or any(map(item.role.startswith, case.apart.split())):
            continue
        column = item.column.removeprefix(f"{item.topic}.")
        values = recording.topic(item.topic).fields[column] * item.sign
        values = values * (unit_factor(item.unit) if item.unit else 1.0)
        known = np.isfinite(values)
        rows = known if len(values) == len(TRUTH.time) else np.ones(len(TRUTH.time), np.bool_)
        if rows.sum() != known.sum():
            yield f"{item.role} is {item.column}, of another clock"
            continue
        start = values[known][0] if item.role.startswith("position.") else None  # from its start
        differences = []
        for true in TRUTH.roles(item.role, roles.vertical_axis.body):
            off = values[known] - true[rows] - (0 if start is None else start - true[rows][0])
            differences.append(
                np.median(np.abs(2 * np.sin(off / 2))) / np.std(true)
            )  # but for turns
        if min(differences, default=1.0) > 0.05:
            yield f"{item.role} is {item.column}, {item.confidence} %"
