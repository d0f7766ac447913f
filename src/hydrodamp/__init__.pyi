"""The public names and where they live; loaded when first used."""

from .basis.atoms import AXES as AXES, VELOCITIES as VELOCITIES
from .basis.basis import Basis as Basis
from .basis.term import Term as Term
from .batch.drift import Change as Change
from .batch.season import GroupFit as GroupFit, Season as Season, batch as batch
from .conditioning.actuators import (
    beyond_dead_zone as beyond_dead_zone,
    delayed as delayed,
    lagged as lagged,
)
from .conditioning.current import (
    Current as Current,
    estimate_current as estimate_current,
    without_current as without_current,
)
from .conditioning.derived import (
    acceleration_from_accelerometer as acceleration_from_accelerometer,
    rates_from_attitude as rates_from_attitude,
    velocity_from_position as velocity_from_position,
)
from .conditioning.dropouts import (
    fill_held as fill_held,
    mask_bottom_lock as mask_bottom_lock,
    mask_frozen as mask_frozen,
    mask_lost_frames as mask_lost_frames,
)
from .conditioning.mixing import roll_from_mixing as roll_from_mixing
from .conditioning.spikes import remove_spikes as remove_spikes, steady_attitude as steady_attitude
from .conditioning.steps import CLEANING_STEPS as CLEANING_STEPS, clean as clean
from .conditioning.suspicions import (
    Suspicion as Suspicion,
    note_suspicions as note_suspicions,
    suspicions as suspicions,
)
from .data.canonical import write_log as write_log
from .data.log import Log as Log, Segment as Segment, concatenate as concatenate
from .data.recording import Recording as Recording, Topic as Topic
from .errors import (
    ClockWarning as ClockWarning,
    FileError as FileError,
    ForeignVehicleWarning as ForeignVehicleWarning,
    GapWarning as GapWarning,
    HydrodampError as HydrodampError,
    HydrodampWarning as HydrodampWarning,
    LogError as LogError,
    MethodError as MethodError,
    ModelError as ModelError,
    ProblemError as ProblemError,
    PropulsionWarning as PropulsionWarning,
    TermError as TermError,
    VehicleError as VehicleError,
)
from .export.export import export as export
from .export.fidelity import Fidelity as Fidelity, Replays as Replays
from .export.target import Target as Target
from .export.targets import TARGETS as TARGETS, find_target as find_target
from .identification.adaptive import (
    AdaptiveIdentifier as AdaptiveIdentifier,
    ByNoise as ByNoise,
    ByTerm as ByTerm,
    History as History,
    State as State,
)
from .identification.differences import (
    Derivative as Derivative,
    FiniteDifference as FiniteDifference,
    RecordedAcceleration as RecordedAcceleration,
    SavitzkyGolay as SavitzkyGolay,
)
from .identification.dissipative import Dissipative as Dissipative
from .identification.fit import (
    Fit as Fit,
    Method as Method,
    Uncertainty as Uncertainty,
    fitted as fitted,
    identify as identify,
)
from .identification.grades import (
    Grade as Grade,
    Identifiability as Identifiability,
    graded as graded,
    identifiability as identifiability,
)
from .identification.linear import (
    LeastSquares as LeastSquares,
    Ridge as Ridge,
    WeakForm as WeakForm,
)
from .identification.methods import (
    METHODS as METHODS,
    cite as cite,
    find_method as find_method,
    identify_all as identify_all,
)
from .identification.online import observe as observe
from .identification.output_error import OutputError as OutputError
from .identification.power import (
    OperatingBox as OperatingBox,
    WorstPower as WorstPower,
    operating_box as operating_box,
    worst_power as worst_power,
)
from .identification.recommended import Recommended as Recommended
from .identification.recursive import (
    RecursiveLeastSquares as RecursiveLeastSquares,
    RecursiveState as RecursiveState,
)
from .identification.residuals import diagnose as diagnose
from .identification.rows import (
    Differenced as Differenced,
    Equations as Equations,
    Folds as Folds,
    Rows as Rows,
    accumulate as accumulate,
    damping_wrench as damping_wrench,
    folds as folds,
)
from .identification.sparse import Sparse as Sparse
from .identification.triangle import Triangle as Triangle, merge as merge
from .identification.weak import WeakEquations as WeakEquations
from .ingest.datasets import Dataset as Dataset, fetch as fetch, find_dataset as find_dataset
from .ingest.mapping.log_mapping import (
    LogMapping as LogMapping,
    json_schema as json_schema,
    presets as presets,
    read_mapping as read_mapping,
)
from .ingest.probing.delay import Delay as Delay, delays as delays
from .ingest.probing.probe import Probe as Probe, probe as probe
from .ingest.read import (
    read_log as read_log,
    read_logs as read_logs,
    read_recording as read_recording,
)
from .kernels.plant import Sample as Sample
from .models.catalog import (
    PAPER_MODELS as PAPER_MODELS,
    catalog as catalog,
    find_model as find_model,
)
from .models.damping import Damping as Damping, VehicleStamp as VehicleStamp
from .models.files import (
    read_damping as read_damping,
    read_models as read_models,
    write_damping as write_damping,
    write_model as write_model,
)
from .models.model import DampingModel as DampingModel
from .models.published import published as published
from .planning.dive import (
    DivePlan as DivePlan,
    Prediction as Prediction,
    Reach as Reach,
    Stretch as Stretch,
)
from .planning.envelope import Envelope as Envelope, read_envelope as read_envelope
from .planning.manoeuvres import Manoeuvre as Manoeuvre
from .planning.plan import plan as plan
from .report.figures.diagnostics import (
    correlation_figure as correlation_figure,
    excitation_figure as excitation_figure,
    front_figure as front_figure,
    horizons_figure as horizons_figure,
    power_figure as power_figure,
    residuals_figure as residuals_figure,
)
from .report.figures.look import save_figure as save_figure
from .report.figures.series import (
    commands_figure as commands_figure,
    replays_figure as replays_figure,
    velocities_figure as velocities_figure,
)
from .report.files import read_comparison as read_comparison, write_comparison as write_comparison
from .report.page import write_report as write_report
from .simulation.campaign.conditions import (
    WHITE as WHITE,
    Conditions as Conditions,
)
from .simulation.campaign.reenact import (
    Campaign as Campaign,
    reenact as reenact,
)
from .simulation.problem import (
    Columns as Columns,
    Problem as Problem,
    columns as columns,
    prepare as prepare,
)
from .simulation.replay import (
    HorizonScore as HorizonScore,
    Score as Score,
    Trajectory as Trajectory,
    horizon_scores as horizon_scores,
    score as score,
    simulate as simulate,
)
from .simulation.status import Status as Status
from .validation.bands import (
    PredictionBand as PredictionBand,
    prediction_band as prediction_band,
)
from .validation.choice import (
    Choice as Choice,
    front as front,
)
from .validation.compare import (
    TABLE_I as TABLE_I,
    Comparison as Comparison,
    Row as Row,
    compare as compare,
)
from .validation.crossvalidation import (
    CrossValidation as CrossValidation,
    cross_validate as cross_validate,
)
from .validation.vehicle_doubt import VehicleDoubt as VehicleDoubt, vehicle_doubt as vehicle_doubt
from .vehicle.actuators import (
    Fin as Fin,
    Matrix as Matrix,
    Propeller as Propeller,
    Thruster as Thruster,
)
from .vehicle.file import (
    find_vehicle as find_vehicle,
    fleet as fleet,
    read_vehicle as read_vehicle,
    write_vehicle as write_vehicle,
)
from .vehicle.vehicle import Vehicle as Vehicle

__version__: str
