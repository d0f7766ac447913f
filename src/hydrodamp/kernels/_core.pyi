"""The compiled core as Python sees it; results are written into the last arrays."""

from hydrodamp.arrays import BoolArray, FloatArray, IndexArray, IntArray

class Plant:
    def __init__(
        self, factors: IndexArray, mass_columns: FloatArray, free: BoolArray, n_channels: int
    ) -> None: ...

class Record:
    def __init__(
        self,
        time: FloatArray,
        velocity: FloatArray,
        down: FloatArray,
        wrench: FloatArray,
        channels: FloatArray,
        propulsion: FloatArray,
    ) -> None: ...

def regressor(
    factors: IndexArray,
    velocity: FloatArray,
    down: FloatArray,
    channels: FloatArray,
    propulsion_speed: FloatArray,
    out: FloatArray,
) -> None: ...
def coriolis(mass_columns: FloatArray, velocity: FloatArray, wrench: FloatArray) -> None: ...
def acceleration(
    plant: Plant,
    matrix: FloatArray,
    velocity: FloatArray,
    down: FloatArray,
    wrench: FloatArray,
    channels: FloatArray,
    propulsion_speed: float,
    rate: FloatArray,
) -> None: ...
def replay(
    plant: Plant,
    matrix: FloatArray,
    record: Record,
    segments: IntArray,
    attitude: FloatArray,
    max_step: float,
    limit: float,
    velocity: FloatArray,
    diverged_at: IntArray,
) -> None: ...
def sensitivities(
    plant: Plant,
    matrix: FloatArray,
    parameters: IndexArray,
    record: Record,
    segments: IntArray,
    attitude: FloatArray,
    max_step: float,
    limit: float,
    velocity: FloatArray,
    jacobian: FloatArray,
) -> None: ...
def adapt(
    plant: Plant,
    a: FloatArray,
    gamma: FloatArray,
    matrix: FloatArray,
    error: FloatArray,
    record: Record,
    segments: IntArray,
    passes: int,
    every: int,
    history_time: FloatArray,
    history_error: FloatArray,
    history_matrix: FloatArray,
) -> None: ...
def adapt_step(
    plant: Plant,
    a: FloatArray,
    gamma: FloatArray,
    matrix: FloatArray,
    error: FloatArray,
    previous: FloatArray,
    current: FloatArray,
) -> None: ...

class Entries:
    def __init__(self, starts: IntArray, rows: IntArray, known: FloatArray) -> None: ...

class Robust:
    def __init__(
        self,
        entries: Entries,
        a: FloatArray,
        gains: FloatArray,
        rest: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        leakage: float,
        dead_zone: float,
    ) -> None: ...

def robust_step(
    plant: Plant,
    entries: Entries,
    robust: Robust,
    coefficients: FloatArray,
    error: FloatArray,
    total: FloatArray,
    duration: FloatArray,
    previous: FloatArray,
    current: FloatArray,
) -> None: ...
def robust_run(
    plant: Plant,
    entries: Entries,
    robust: Robust,
    coefficients: FloatArray,
    error: FloatArray,
    total: FloatArray,
    duration: FloatArray,
    mean_from: int,
    record: Record,
    segments: IntArray,
    every: int,
    track_time: FloatArray,
    track_error: FloatArray,
    track_coefficients: FloatArray,
) -> None: ...
def block_step(
    plant: Plant,
    entries: Entries,
    length: float,
    block: FloatArray,
    row: FloatArray,
    previous: FloatArray,
    current: FloatArray,
) -> bool: ...
def absorb(
    entries: Entries,
    unit: FloatArray,
    forgetting: float,
    coefficients: FloatArray,
    information: FloatArray,
    noise: FloatArray,
    rows: FloatArray,
    row: FloatArray,
) -> None: ...
def recur(
    plant: Plant,
    entries: Entries,
    unit: FloatArray,
    forgetting: float,
    coefficients: FloatArray,
    information: FloatArray,
    noise: FloatArray,
    rows: FloatArray,
    length: float,
    block: FloatArray,
    record: Record,
    segments: IntArray,
    every: int,
    track_time: FloatArray,
    track_noise: FloatArray,
    track_coefficients: FloatArray,
) -> None: ...
