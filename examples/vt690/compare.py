"""Model the turns of a field log of the 690: ``python compare.py DATA``.

DATA is the folder with the .dat files. The turns are found by heading alone; those of the first
half of the log are for identification, those of the second half are replayed whole, open loop,
from their first sample. README.md has the results and says what was chosen how.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import hydrodamp as hd
from hydrodamp.basis import term
from hydrodamp.errors import GapWarning
from hydrodamp.identification.identifiability import identifiability

sys.path.insert(0, str(Path(__file__).parent))
from roll import read_field_log
from turns import turns, with_speed

HERE = Path(__file__).parent
SOURCE = "github.com/ECE-MDE/AUV-Fault-Detection, commit 6e89c60, no licence stated"
AXES = {"yaw": ("N",), "steering": ("Y", "N")}
METHODS = "weak,oe,recommended"
CHOSEN = ("steering", "oe")


def vehicle(*axes: str) -> hd.Vehicle:
    """Return the 690 of the fleet with unknown fins, free along some axes."""
    return replace(hd.fleet["vt690"], actuators=(), axes=axes or term.AXES)


def held_out(parts: list[hd.Log], when: float) -> tuple[list[hd.Log], list[hd.Log]]:
    """Return the turns that begin before a time and those after."""
    return [p for p in parts if p.time[0] < when], [p for p in parts if p.time[0] >= when]


def yaw_fits(
    model: hd.DampingModel, method: str, train: list[hd.Log], test: list[hd.Log]
) -> list[float | None]:
    """Return 100 (1 - rmse/std) of the yaw rate of each held-out turn."""
    craft = vehicle(*AXES[model.key])
    fit = hd.identify(model, craft, hd.concatenate(train), hd.find_method(method))
    scores = [hd.compare([fit], craft, turn).rows[0].score for turn in test]
    return [score.fit_by_axis["r"] for score in scores]


def told(shares: list[float | None]) -> str:
    """Return fits in per cent."""
    return " ".join("diverged" if share is None else f"{share:8.0f}" for share in shares)


def word(grade: hd.Grade) -> str:
    """Return a grade in a word or two."""
    return grade.name.lower().replace("_", " ")


def grades(log: hd.Log, model: hd.DampingModel) -> str:
    """Return, axis by axis, how many coefficients the whole log determines."""
    found = identifiability(hd.prepare(vehicle(), log, model), model)
    lines = [f"{'axis':4} {'excited':8}" + "".join(f"{word(grade):>16}" for grade in hd.Grade)]
    for axis in found.axes:
        own = [grade for label, grade in found.grades.items() if label.startswith(f"{axis.axis}_")]
        counts = "".join(f"{own.count(grade):16}" for grade in hd.Grade)
        lines.append(f"{axis.axis:4} {'yes' if axis.excited else 'no':8}{counts}")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """Prepare, compare and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path, help="folder with the .dat files")
    parser.add_argument("--out", type=Path, help="folder for the log as prepared and the fit")
    parser.add_argument("--methods", default=METHODS, help=f"with commas; default {METHODS}")
    asked = parser.parse_args(arguments)
    warnings.simplefilter("ignore", GapWarning)  # the log's notes have it
    try:
        work(asked)
    except hd.HydrodampError as error:
        print(f"error: {error}\nThe log is at {SOURCE}.", file=sys.stderr)
        return 2
    return 0


def work(asked: argparse.Namespace) -> None:
    """Do what was asked for."""
    nested = asked.data / "vt690_field"
    folder = nested if nested.is_dir() else asked.data
    log = with_speed(read_field_log(folder))
    models = {model.key: model for model in hd.read_models(HERE / "models.yaml")}
    print(f"Data: {SOURCE}.\n\n{log!r}", *log.notes, sep="\n  ", end="\n\n")
    train, test = held_out(turns(log), (log.time[0] + log.time[-1]) / 2)
    for word, parts in (("Identification", train), ("Held out", test)):
        spans = ", ".join(f"{p.time[0]:.0f} to {p.time[-1]:.0f} s" for p in parts)
        print(f"{word}: turns {spans}")
    print("\nYaw rate, 100 (1 - rmse/std) in % of each held-out turn, open loop:")
    for key in AXES:
        for method in asked.methods.split(","):
            shares = yaw_fits(models[key], method, train, test)
            print(f"{key:10} {method:12} {told(shares)}", flush=True)
    print(f"\nWhat the whole log can tell ({models['whole'].title}):")
    print(grades(log, models["whole"]))
    if asked.out:
        write(asked.out, log, models[CHOSEN[0]], train)


def write(folder: Path, log: hd.Log, model: hd.DampingModel, train: list[hd.Log]) -> None:
    """Write the log as prepared, and the coefficients of the model chosen."""
    folder.mkdir(parents=True, exist_ok=True)
    craft = vehicle(*AXES[model.key])
    fit = hd.identify(model, craft, hd.concatenate(train), hd.find_method(CHOSEN[1]))
    hd.write_log(log, folder / "log.csv")
    hd.write_damping(fit.damping, folder / f"{model.key}.yaml")


if __name__ == "__main__":
    raise SystemExit(main())
