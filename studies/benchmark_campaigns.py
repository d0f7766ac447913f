"""The campaigns of the benchmark: every one that is sailed, and those on files."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache, partial
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import hydrodamp as hd
from benchmark_campaign import Campaign, Logs, Pilot, Recording, Sail
from benchmark_crafts import (
    CHANNELS,
    THRUST,
    Craft,
    Joystick,
    Steered,
    Zigzag,
    heavy_rov,
    rov,
    rov_drag,
    tanker,
)
from benchmark_plans import (
    crossflow,
    drifting,
    fewer,
    lagging,
    marginal,
    published,
    remus,
    remus_by_theory,
)
from conditions import COLOURED, SILENT, Coloured
from hydrodamp.basis.term import AXES

EXAMPLES = Path(__file__).parents[1] / "examples"

PAPER = tuple(hd.catalog[key] for key in hd.PAPER_MODELS)
"""The eight models of the catalogue, in the paper's order."""

THRUSTERS = {
    "X": "ch_forward",
    "Y": "ch_lateral",
    "Z": "ch_heave",
    "K": "ch_roll ch_lateral",
    "M": "ch_pitch ch_forward",
    "N": "ch_yaw ch_lateral",
}
"""What channels drive, and where they leak to: their gains are unknown."""

BENT = {
    axis: " ".join(f"{name} {name}*|{name}|" for name in names.split())
    for axis, names in THRUSTERS.items()
}
"""The same for thrust that is not proportional to its channel."""

ROV_MODELS = tuple(model.with_terms(THRUSTERS, key=f"{model.key}+channels") for model in PAPER)
BENT_MODELS = tuple(model.with_terms(BENT, key=f"{model.key}+channels") for model in PAPER)
SHIP_MODELS = hd.read_models(EXAMPLES / "kvlcc2" / "models.yaml")


def noise(scale: float, pushes: float = 0.0, *, coloured: bool = False) -> Coloured:
    """Return sensors' errors in published ones and pushes in three per cent of the damping."""
    base = COLOURED if coloured else Coloured()
    return replace(base, scale=scale, push=COLOURED.push_times(pushes).push)


def tether(scale: float, *, coloured: bool = False) -> Coloured:
    """Return sensors' errors and the pull of a tether."""
    return replace(
        noise(scale, coloured=coloured), push=(0.3, 0.3, 0.3, 0.001, 0.001, 0.001), push_time=5.0
    )


def waves(scale: float, *, coloured: bool = False) -> Coloured:
    """Return sensors' errors and pushes on a ship of 7 m."""
    return replace(noise(scale, coloured=coloured), push=(1, 5, 0, 0, 0, 12), push_time=3.0)


EXACT, STRAPDOWN = Recording(acceleration=0.0), Recording(acceleration=1.0)
STRONG, WEAK = Recording(wrench=1.2), Recording(wrench=0.8)
STRONG_FINS, WEAK_FINS = Recording(fins=1.2), Recording(fins=0.8)


def campaigns() -> Iterator[Campaign]:
    """Yield every campaign; those on files only where ``HYDRODAMP_DATA`` has them."""
    for name, make in SEEN.items():
        yield Campaign(name, models_of(name), make)
    for name, make in UNSEEN.items():
        yield Campaign(name, models_of(name), make, "unseen")
    if folder := os.environ.get("HYDRODAMP_DATA"):
        yield from recorded(Path(folder))


def models_of(name: str) -> tuple[hd.DampingModel, ...]:
    """Return the models that make sense on a campaign that is sailed."""
    kinds = {"rov": ROV_MODELS, "heavy-rov": BENT_MODELS, "tanker": SHIP_MODELS}
    return kinds.get(name.partition("/")[0], PAPER)


def joystick(seed: int, n_runs: int, duration: float, period: float) -> Steered:
    """Return the pilot of an ROV."""
    return Joystick.drawn(seed, n_runs, duration, period)


def zigzags(*angles: tuple[float, float]) -> Callable[[int, int, float, float], Steered]:
    """Return the helmsman of a ship, the same whatever the seed."""
    return lambda *_: Zigzag.of(*angles)


def true_rov() -> hd.Damping:
    """Return the drag of the BlueROV2 with the gains of its thrusters."""
    model = hd.catalog["fossen"].with_terms(THRUSTERS, key="fossen+channels")
    gains = {
        f"{axis}_{channel}": THRUST[CHANNELS.index(channel), AXES.index(axis)]
        for axis, names in THRUSTERS.items()
        for channel in names.split()
    }
    return hd.Damping.from_dict(model, {**rov_drag().as_dict(), **gains})


def ship() -> Craft:
    """Return the tanker of the example."""
    return tanker(hd.read_vehicle(EXAMPLES / "kvlcc2" / "vehicle.yaml"))


ROV = partial(Pilot, rov, joystick, true=true_rov)
HEAVY = partial(Pilot, heavy_rov, joystick)
SHIP = partial(
    Pilot,
    ship,
    zigzags((10, 10), (-20, 20), (30, 10), (-35, 20), (15, 5), (20, 10), (-25, 15)),
    n_runs=7,
    speed=1.18,
    rate=5.0,
)

SEEN: dict[str, Callable[[], Logs]] = {
    "sname/200s": Sail(published, 100, 200.0),
    "sname/45s/0.3x": Sail(published, 101, 45.0, noise(0.3)),
    "sname/80s/coloured-pushed": Sail(published, 102, 80.0, noise(1.0, 1.0, coloured=True)),
    "sname/60s/3x": Sail(published, 103, 60.0, noise(3.0)),
    "sname/600s": Sail(published, 104, 600.0),
    "sname/120s/silent": Sail(published, 105, 120.0, SILENT),
    "sname/60s/accelerations": Sail(published, 106, 60.0, recording=EXACT),
    "sname/60s/50Hz/strapdown": Sail(published, 107, 60.0, rate=50.0, recording=STRAPDOWN),
    "sname/150s/2x/5Hz": Sail(published, 108, 150.0, noise(2.0), 5.0),
    "sname/100s/wrench+20%": Sail(published, 109, 100.0, recording=STRONG),
    "sname/100s/pushed-2x": Sail(published, 110, 100.0, noise(1.0, 2.0)),
    "sname/120s/two-runs": Sail(fewer(published, 0, 2), 111, 120.0),
    "sname2022/200s": Sail(marginal, 120, 200.0),
    "sname2022/60s/0.3x": Sail(marginal, 121, 60.0, noise(0.3)),
    "sname2022/80s/coloured-pushed": Sail(marginal, 122, 80.0, noise(1.0, 1.0, coloured=True)),
    "sname2022/60s/3x": Sail(marginal, 123, 60.0, noise(3.0)),
    "sname2022/300s/2x": Sail(marginal, 124, 300.0, noise(2.0)),
    "sname2022/100s/20Hz/accelerations": Sail(marginal, 125, 100.0, rate=20.0, recording=EXACT),
    "sname2022/100s/wrench-20%": Sail(marginal, 126, 100.0, recording=WEAK),
    "sname2022/45s/50Hz": Sail(marginal, 127, 45.0, rate=50.0),
    "crossflow/200s": Sail(crossflow, 130, 200.0),
    "crossflow/60s/strapdown": Sail(crossflow, 131, 60.0, recording=STRAPDOWN),
    "crossflow/80s/coloured-pushed": Sail(crossflow, 132, 80.0, noise(1.0, 1.0, coloured=True)),
    "crossflow/400s/2x/5Hz": Sail(crossflow, 133, 400.0, noise(2.0), 5.0),
    "crossflow/60s/3x": Sail(crossflow, 134, 60.0, noise(3.0)),
    "drifting/150s": Sail(drifting, 140, 150.0),
    "drifting/100s/fins+20%": Sail(drifting, 141, 100.0, recording=STRONG_FINS),
    "lag-0.2s/200s": Sail(lagging(published, 0.2), 150, 200.0),
    "lag-0.3s/80s/coloured-pushed": Sail(
        lagging(marginal, 0.3), 151, 80.0, noise(1.0, 1.0, coloured=True)
    ),
    "lag-0.1s/60s/50Hz/accelerations": Sail(
        lagging(published, 0.1), 152, 60.0, rate=50.0, recording=EXACT
    ),
    "remus/200s": Sail(remus, 160, 200.0),
    "remus/60s/0.3x": Sail(remus, 161, 60.0, noise(0.3)),
    "remus/100s/20Hz/coloured-pushed": Sail(
        remus, 162, 100.0, noise(1.0, 0.5, coloured=True), 20.0
    ),
    "remus/100s/wrench-20%": Sail(remus, 163, 100.0, recording=WEAK),
    "remus/80s/2x/accelerations": Sail(remus, 164, 80.0, noise(2.0), recording=EXACT),
    "rov/200s": ROV(170, 200.0),
    "rov/60s/0.3x": ROV(171, 60.0, noise(0.3)),
    "rov/120s/coloured-tether": ROV(172, 120.0, tether(1.0, coloured=True)),
    "rov/100s/accelerations": ROV(173, 100.0, recording=EXACT),
    "heavy-rov/200s": HEAVY(180, 200.0),
    "heavy-rov/80s/20Hz/tether": HEAVY(181, 80.0, tether(1.0), 20.0),
    "tanker/200s": SHIP(190, 200.0),
    "tanker/150s/silent": SHIP(191, 150.0, SILENT),
    "tanker/150s/coloured-pushed": SHIP(192, 150.0, waves(1.0, coloured=True)),
    "tanker/100s/3x/accelerations": SHIP(193, 100.0, noise(3.0), recording=EXACT),
    "sname/130s/2x/20Hz": Sail(published, 901, 130.0, noise(2.0), 20.0),
    "sname2022/70s/1.5x/coloured-pushed": Sail(marginal, 902, 70.0, noise(1.5, 2.0, coloured=True)),
    "sname2022/50s/wrench+20%/strapdown": Sail(
        marginal, 903, 50.0, recording=Recording(acceleration=1.0, wrench=1.2)
    ),
    "crossflow/250s/0.5x": Sail(crossflow, 904, 250.0, noise(0.5)),
    "lag-0.12s/110s/5Hz": Sail(lagging(published, 0.12), 905, 110.0, rate=5.0),
    "drifting/90s/fins-20%/coloured": Sail(
        drifting, 906, 90.0, noise(1.0, coloured=True), recording=WEAK_FINS
    ),
    "remus/150s/2x/5Hz": Sail(remus, 907, 150.0, noise(2.0), 5.0),
    "remus-theory/120s": Sail(remus_by_theory, 908, 120.0),
    "rov/90s/2x/coloured-tether": ROV(909, 90.0, tether(2.0, coloured=True)),
    "heavy-rov/250s/0.5x": HEAVY(910, 250.0, noise(0.5)),
    "tanker/180s/2x/10Hz": SHIP(911, 180.0, waves(2.0), rate=10.0),
    "sname/90s/1.5x/coloured": Sail(published, 931, 90.0, noise(1.5, coloured=True)),
    "sname2022/150s": Sail(marginal, 932, 150.0),
    "sname2022/90s/2x/20Hz": Sail(marginal, 933, 90.0, noise(2.0), 20.0),
    "crossflow/100s/2x/coloured-pushed": Sail(
        crossflow, 934, 100.0, noise(2.0, 1.0, coloured=True)
    ),
    "lag-0.25s/150s/wrench-20%": Sail(
        lagging(published, 0.25), 935, 150.0, recording=Recording(wrench=0.8)
    ),
    "drifting/60s/2x": Sail(drifting, 936, 60.0, noise(2.0)),
    "remus/90s/coloured-pushed": Sail(remus, 937, 90.0, noise(1.0, 1.0, coloured=True)),
    "remus-theory/60s/2x": Sail(remus_by_theory, 938, 60.0, noise(2.0)),
    "rov/150s/0.5x": ROV(939, 150.0, noise(0.5)),
    "heavy-rov/100s/2x/tether": HEAVY(940, 100.0, tether(2.0)),
    "tanker/120s/0.5x": SHIP(941, 120.0, waves(0.5)),
}
"""Those that methods may be made on."""

UNSEEN: dict[str, Callable[[], Logs]] = {
    "sname/70s/2x/coloured-pushed": Sail(published, 951, 70.0, noise(2.0, 1.0, coloured=True)),
    "sname/180s/0.5x/20Hz": Sail(published, 952, 180.0, noise(0.5), 20.0),
    "sname2022/110s/1.5x": Sail(marginal, 953, 110.0, noise(1.5)),
    "sname2022/90s/fins-20%": Sail(marginal, 954, 90.0, recording=WEAK_FINS),
    "crossflow/120s/pushed": Sail(crossflow, 955, 120.0, noise(1.0, 1.0)),
    "lag-0.15s/100s/2x": Sail(lagging(marginal, 0.15), 956, 100.0, noise(2.0)),
    "drifting/120s/coloured": Sail(drifting, 957, 120.0, noise(1.0, coloured=True)),
    "remus/120s/2x": Sail(remus, 958, 120.0, noise(2.0)),
    "remus-theory/90s/accelerations": Sail(remus_by_theory, 959, 90.0, recording=EXACT),
    "rov/90s/2x": ROV(960, 90.0, noise(2.0)),
    "heavy-rov/120s/tether": HEAVY(961, 120.0, tether(1.0)),
    "tanker/180s/2x": SHIP(962, 180.0, waves(2.0)),
}
"""Those that nobody looks at while making a method."""


def recorded(folder: Path) -> Iterator[Campaign]:
    """Yield the campaigns on files."""
    for place in sorted((folder / "campaigns").glob("*/vehicle.yaml")):
        yield Campaign(f"oracle/{place.parent.name}", PAPER, partial(_oracle, place.parent))
    yield from _left_out("bluerov2", folder / "bluerov2_kth", "run_")
    yield from _left_out("kvlcc2", folder / "kvlcc2_hsva", "HSVA_CPMC_KVLCC2_Z_")
    if (folder / "vt690_field").is_dir():
        steering = hd.read_models(EXAMPLES / "vt690" / "models.yaml")[1:2]
        for turn in range(N_TURNS):
            make = partial(_turn, folder / "vt690_field", turn)
            yield Campaign(f"vt690-field/turn-{turn}", steering, make)


def _oracle(folder: Path) -> Logs:
    train, test = (hd.read_log(folder / f"{name}.csv") for name in ("estimation", "validation"))
    return Logs(hd.read_vehicle(folder / "vehicle.yaml"), train, test)


def _left_out(example: str, folder: Path, start: str) -> Iterator[Campaign]:
    """Yield a campaign for every run: it is held out, and all others are to identify from."""
    models, runs = (
        hd.read_models(EXAMPLES / example / "models.yaml"),
        sorted(folder.glob(f"{start}*")),
    )
    for held in runs:
        others = [run for run in runs if run != held]
        name = f"{example}/{held.stem.removeprefix(start)}"
        yield Campaign(name, models, partial(read_runs, EXAMPLES / example, others, [held]))


def read_runs(example: Path, train: Sequence[Path], test: Sequence[Path]) -> Logs:
    """Return runs on files as an example reads them."""
    mapping = example / "mapping.yaml"
    vehicle = hd.read_vehicle(example / "vehicle.yaml")
    return Logs(vehicle, hd.read_logs(list(train), mapping), hd.read_logs(list(test), mapping))


N_TURNS = 7
"""Turns in the field log of the 690, as the example finds them."""


def _turn(folder: Path, held: int) -> Logs:
    """Return the turns of the field log, one held out; the fins' effect is unknown."""
    parts = field_turns(folder)
    others = [part for turn, part in enumerate(parts) if turn != held]
    return Logs(field_vehicle(), hd.concatenate(others), parts[held])


def field_vehicle() -> hd.Vehicle:
    """Return the 690 of the field log: its fins are unknown, sway and yaw are free."""
    return replace(hd.fleet["vt690"], actuators=(), axes=("Y", "N"))


def load_module(path: Path) -> ModuleType:
    """Return the module of a script of an example."""
    spec = spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    found = module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


@cache
def field_turns(folder: Path) -> list[hd.Log]:
    """Return the turns of the field log, as the example finds them."""
    example = EXAMPLES / "vt690"
    found = load_module(example / "turns.py")
    log = load_module(example / "roll.py").read_field_log(folder)
    turns: list[hd.Log] = found.turns(found.with_speed(log))
    return turns
