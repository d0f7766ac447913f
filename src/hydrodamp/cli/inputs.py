"""Vehicle, models, methods and logs of a command, from the names on the command line."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import hydrodamp as hd
from hydrodamp.cli.output import note
from hydrodamp.errors import (
    FileError,
    HydrodampError,
    HydrodampWarning,
    ModelError,
    ProblemError,
    demand,
    no_such,
)

if TYPE_CHECKING:
    from hydrodamp.identification.fit import Method
    from hydrodamp.identification.model_request import ModelRequest

#: Model of an expert's terms, and model whose terms are selected: both need the training data.
GENERAL, SPARSE = "general", "sparse"

#: Key in the provenance of a fit of the mapping of its log.
MAPPING = "mapping"


def list_models(listed: str | None) -> ModelRequest:
    """Return the models of a comma-separated list; by default the paper's eight and `general`."""
    from hydrodamp.identification.model_request import ModelRequest

    requested = (*hd.PAPER_MODELS, GENERAL) if listed is None else split_names(listed)
    if not requested:
        raise ModelError("the list of models is empty: name at least one model.")
    of_log = tuple(name for name in (GENERAL, SPARSE) if name in requested)
    models: dict[str, hd.DampingModel] = {}
    named = [read_named_models(name) for name in requested if name not in of_log]
    for model in (model for group in named for model in group):
        key = model.key.casefold()  # not all file systems distinguish A.json from a.json
        first = models.setdefault(key, model)
        same = (first.key, first.terms) == (model.key, model.terms)
        if not same or key in of_log:
            raise ModelError(
                f"two different models are called '{model.key}' (case-insensitive): rename the "
                "one in your file."
            )
    return ModelRequest(tuple(models.values()), GENERAL in of_log, SPARSE in of_log)


def read_named_models(name: str) -> tuple[hd.DampingModel, ...]:
    """Return a model by name or ``FILE:NAME``, or all models of a file."""
    file = model_file(name)
    if file != name:
        key, file_models = name.removeprefix(f"{file}:").strip(), hd.read_models(file)
        keys = [model.key for model in file_models]
        if key not in keys:
            raise ModelError(f"{file}: {no_such('model', key, keys)}")
        return (file_models[keys.index(key)],)
    if name not in hd.catalog and (_is_yaml(name) or Path(name).is_file()):
        return hd.read_models(name)
    return (hd.find_model(name),)


def model_file(name: str) -> str:
    """Return the file of ``FILE:NAME``; any other name as it is."""
    file = name.rpartition(":")[0]
    return file if _is_yaml(file) else name


def locate_model(listed: str, key: str) -> str:
    """Return the name of one model of a comma-separated list: the catalogue's, or FILE:NAME."""
    from hydrodamp.identification.general_model import INPUTS
    from hydrodamp.simulation.checks import GAINS

    key = key.removesuffix(GAINS).removesuffix(INPUTS)
    for name in split_names(listed):
        models = () if name in (GENERAL, SPARSE) else read_named_models(name)
        if key in [model.key for model in models]:
            return name if len(models) == 1 else f"{name}:{key}"
    return key


def model_files(listed: str | None) -> list[str]:
    """Return the files, or the names, of a comma-separated list of models."""
    return [model_file(name) for name in split_names(listed or "")]


def _is_yaml(name: str) -> bool:
    return Path(name).suffix.lower() in (".yaml", ".yml")


def find_model(name: str) -> ModelRequest:
    """Return a single model by name or file, or one that needs the log."""
    listed = list_models(name)
    if len(listed) != 1:
        keys = ", ".join(model.key for model in listed.models)
        raise ModelError(
            f"`--model {name}` names several models: {keys}. Give one, such as FILE:NAME; "
            "`hydrodamp compare --models` takes several."
        )
    return listed


def list_methods(listed: str) -> tuple[Method, ...]:
    """Return the methods of a comma-separated list."""
    demand(bool(split_names(listed)), "--methods", "at least one method", "an empty list")
    return tuple(hd.find_method(name) for name in split_names(listed))


def split_names(listed: str) -> tuple[str, ...]:
    """Return the distinct names of a comma-separated list."""
    return tuple(dict.fromkeys(name.strip() for name in listed.split(",") if name.strip()))


def suggest_target(model: hd.DampingModel) -> str:
    """Return a simulator that can hold a model: terms of the attitude need code of its own."""
    return "mujoco" if any(term.needs_attitude for term in model.basis) else "gz-sim"


def read_damping_and_vehicle(
    damping: str, vehicle: str
) -> tuple[hd.Damping, hd.Fit | None, hd.Vehicle]:
    """Return a damping, its fit if the file has one, and the named vehicle or that of the fit."""
    from hydrodamp.identification.estimated_vehicle import estimated_vehicle
    from hydrodamp.identification.fit_files import read_damping_file

    numbers, fit = read_damping_file(Path(damping))
    if vehicle:
        craft = hd.find_vehicle(vehicle)
        return numbers, fit, craft if fit is None else estimated_vehicle(craft, fit)
    if fit is None or fit.vehicle is None:
        raise FileError(
            f"{damping}: contains no vehicle. Give its vehicle with `--vehicle`, or identify again "
            "with `hydrodamp identify --out`."
        )
    return numbers, fit, fit.vehicle


def read_logs(paths: Sequence[str], mapping: str | None) -> hd.Log:
    """Return the concatenated logs of files."""
    once = tuple(dict.fromkeys(paths))
    return hd.read_log(once[0], mapping) if len(once) == 1 else hd.read_logs(once, mapping)


def mapping_provenance(mapping: str | None) -> dict[str, str]:
    """Return the mapping of a log for the provenance of its fits; files by their whole path."""
    is_file = mapping is not None and Path(mapping).is_file()
    return {MAPPING: str(Path(mapping or "").resolve()) if is_file else mapping} if mapping else {}


def read_logs_as_fitted(paths: Sequence[str], mapping: str | None, fit: hd.Fit | None) -> hd.Log:
    """Return logs by a mapping, by default canonical ones as is and others by that of the fit."""
    fitted = "" if fit is None else fit.provenance.get(MAPPING, "")
    if mapping or not fitted:
        return read_logs(paths, mapping)
    with suppress(HydrodampError):
        log = read_logs(paths, None)
        note(f"read as canonical; the log of the fit was read by {fitted}: `--mapping` names one.")
        return log
    log = read_logs(paths, fitted)
    note(f"read by {fitted}, the mapping of the fit; `--mapping` names another.")
    return log


def training_log(logs: Sequence[str], train: Sequence[str], mapping: str | None) -> hd.Log:
    """Return the training data: LOG, or the data of --train."""
    if not logs and not train:
        raise ProblemError("there are no training data: name a LOG.")
    log = read_logs(logs, mapping) if logs else None
    return log if log is not None and not train else _select("--train", train, log, mapping)


def train_and_test(
    logs: Sequence[str], train: Sequence[str], test: Sequence[str], mapping: str | None
) -> tuple[hd.Log, hd.Log, dict[str, str]]:
    """Return training data, test data and their overlap, for provenance."""
    from hydrodamp.data.intervals import find_overlap
    from hydrodamp.validation.excitation import describe_overlap

    log = read_logs(logs, mapping) if logs else None
    train_log = _select("--train", train, log, mapping)
    test_log = _select("--test", test, log, mapping)
    overlap = _overlap_files(train, test) if log is None else find_overlap(log, train, test)
    if overlap:
        warnings.warn(describe_overlap(overlap), HydrodampWarning, stacklevel=2)
    return train_log, test_log, {"overlap": overlap} if overlap else {}


def _select(
    option: str, values: Sequence[str], whole: hd.Log | None, mapping: str | None
) -> hd.Log:
    """Return the data that an option names."""
    from hydrodamp.data.intervals import INTERVAL

    if whole is None and any(map(INTERVAL.fullmatch, values)):
        raise ProblemError(f"`{option} {values[0]}` is a time span of LOG, and LOG is not given.")
    if whole is not None:
        segments = (_select_segment(option, value, whole) for value in dict.fromkeys(values))
        return hd.concatenate(segments)
    return read_logs(values, mapping)


def _select_segment(option: str, value: str, whole: hd.Log) -> hd.Log:
    """Return a segment or a time span of LOG."""
    from hydrodamp.data.intervals import parse_interval, select_data

    names = {segment.name for segment in whole.segments}
    if value not in names and Path(value).is_file():
        raise ProblemError(f"`{option} {value}` is a file: omit LOG, or name a part of it.")
    interval = parse_interval(value, whole)
    if interval is not None and interval.shift and option:
        start, end = interval.start + interval.shift, interval.end + interval.shift
        note(
            f"`{option} {value}` is by the clock of the log: {start:.10g}:{end:.10g} in seconds "
            "from its first sample."
        )
    return select_data(whole, value)


def _overlap_files(train: Sequence[str], test: Sequence[str]) -> str:
    from hydrodamp.data.intervals import ALL_TEST_DATA

    train_paths = {Path(name).resolve() for name in train}
    shared = [name for name in dict.fromkeys(test) if Path(name).resolve() in train_paths]
    return ALL_TEST_DATA if len(shared) == len({*test}) else ", ".join(shared)
