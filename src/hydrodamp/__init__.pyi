"""The public names and where they live; loaded when first used."""

from .basis.basis import Basis as Basis
from .basis.term import AXES as AXES, VELOCITIES as VELOCITIES, Term as Term
from .batch.batch import BatchResult as BatchResult, GroupFit as GroupFit, batch as batch
from .batch.groups import ChangePoint as ChangePoint
from .conditioning.actuator_response import (
    apply_dead_zone as apply_dead_zone,
    apply_delay as apply_delay,
    apply_first_order_lag as apply_first_order_lag,
)
from .conditioning.current import (
    Current as Current,
    estimate_current as estimate_current,
    subtract_current as subtract_current,
)
from .conditioning.derivatives import (
    acceleration_from_accelerometer as acceleration_from_accelerometer,
    rates_from_attitude as rates_from_attitude,
    velocity_from_position as velocity_from_position,
)
from .conditioning.dropouts import (
    interpolate_sample_and_hold as interpolate_sample_and_hold,
    mask_dvl_dropouts as mask_dvl_dropouts,
    mask_frozen as mask_frozen,
    mask_mocap_dropouts as mask_mocap_dropouts,
)
from .conditioning.interpolation import set_interpolation as set_interpolation
from .conditioning.outliers import (
    remove_attitude_outliers as remove_attitude_outliers,
    remove_outliers as remove_outliers,
)
from .conditioning.pipeline import CLEANING_STEPS as CLEANING_STEPS, clean as clean
from .conditioning.quality_checks import (
    QualityIssue as QualityIssue,
    annotate_quality as annotate_quality,
    check_quality as check_quality,
)
from .data.canonical import write_log as write_log
from .data.concatenation import concatenate as concatenate
from .data.log import Log as Log, Segment as Segment
from .data.measurement import Measurement as Measurement
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
from .experiment_design.envelope import Envelope as Envelope, read_envelope as read_envelope
from .experiment_design.guidance import Manoeuvre as Manoeuvre
from .experiment_design.plan import plan as plan
from .experiment_design.result import (
    DivePlan as DivePlan,
    PlanSegment as PlanSegment,
    Prediction as Prediction,
)
from .export.export import TARGETS as TARGETS, export as export, find_target as find_target
from .export.fidelity import Fidelity as Fidelity, Replays as Replays
from .export.target import Target as Target
from .identification.adaptive import (
    AdaptiveIdentifier as AdaptiveIdentifier,
    History as History,
    State as State,
)
from .identification.adequacy import Adequacy as Adequacy, Form as Form, ScoreTest as ScoreTest
from .identification.command_response import (
    CommandResponse as CommandResponse,
    estimate_command_response as estimate_command_response,
)
from .identification.composite import (
    CompositeIdentifier as CompositeIdentifier,
    CompositeState as CompositeState,
)
from .identification.differentiation import (
    Derivative as Derivative,
    FiniteDifference as FiniteDifference,
    RecordedAcceleration as RecordedAcceleration,
    SavitzkyGolay as SavitzkyGolay,
)
from .identification.dissipative import Dissipative as Dissipative
from .identification.dissipativity import (
    OperatingBox as OperatingBox,
    PowerMaximum as PowerMaximum,
    max_damping_power as max_damping_power,
    operating_box as operating_box,
)
from .identification.fit import (
    Fit as Fit,
    Method as Method,
    Uncertainty as Uncertainty,
    make_fit as make_fit,
)
from .identification.general_model import general_model as general_model
from .identification.grades import Grade as Grade
from .identification.identifiability import (
    Identifiability as Identifiability,
    grade_fit as grade_fit,
    identifiability as identifiability,
)
from .identification.least_squares import (
    LeastSquares as LeastSquares,
    Ridge as Ridge,
    WeakForm as WeakForm,
)
from .identification.methods import (
    METHODS as METHODS,
    cite as cite,
    find_method as find_method,
    identify as identify,
    identify_all as identify_all,
)
from .identification.online import observe as observe
from .identification.output_error import OutputError as OutputError, Recommended as Recommended
from .identification.parameters import Estimate as Estimate
from .identification.predicted_error import (
    PredictionBand as PredictionBand,
    predict_error as predict_error,
    prediction_band as prediction_band,
)
from .identification.recursive import (
    RecursiveLeastSquares as RecursiveLeastSquares,
    RecursiveState as RecursiveState,
)
from .identification.regression import (
    Folds as Folds,
    PointwiseRegression as PointwiseRegression,
    RegressionForm as RegressionForm,
    Rows as Rows,
    Triangle as Triangle,
    accumulate as accumulate,
    damping_wrench as damping_wrench,
    folds as folds,
    merge as merge,
)
from .identification.stepwise import StepwiseSelection as StepwiseSelection
from .identification.weak_form import WeakRegression as WeakRegression
from .ingest.datasets import Dataset as Dataset, fetch as fetch, find_dataset as find_dataset
from .ingest.inspection.delay import Delay as Delay, estimate_delays as estimate_delays
from .ingest.inspection.probe import Probe as Probe, probe as probe
from .ingest.mapping.log_mapping import (
    LogMapping as LogMapping,
    json_schema as json_schema,
    presets as presets,
    read_mapping as read_mapping,
)
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
    published as published,
)
from .models.damping import Damping as Damping, VehicleStamp as VehicleStamp
from .models.files import (
    read_damping as read_damping,
    read_models as read_models,
    write_damping as write_damping,
    write_model as write_model,
)
from .models.model import DampingModel as DampingModel
from .report.figures.diagnostics import (
    front_figure as front_figure,
    horizons_figure as horizons_figure,
    power_figure as power_figure,
    residuals_figure as residuals_figure,
)
from .report.figures.replays import replays_figure as replays_figure
from .report.figures.style import save_figure as save_figure
from .report.files import read_comparison as read_comparison, write_comparison as write_comparison
from .report.fit_tables import format_coefficients as format_coefficients
from .report.page import write_report as write_report
from .simulation.campaign.conditions import (
    WHITE_NOISE as WHITE_NOISE,
    Conditions as Conditions,
)
from .simulation.campaign.reenact import (
    Campaign as Campaign,
    reenact as reenact,
)
from .simulation.problem import (
    EquationTable as EquationTable,
    Problem as Problem,
    equation_table as equation_table,
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
from .status import Status as Status
from .validation.compare import (
    PAPER_TABLE_I as PAPER_TABLE_I,
    Comparison as Comparison,
    Row as Row,
    compare as compare,
)
from .validation.cross_validation import (
    CrossValidation as CrossValidation,
    cross_validate as cross_validate,
)
from .validation.diagnostics import diagnose as diagnose
from .validation.selection import Selection as Selection, pareto_front as pareto_front
from .validation.verdict import AxisVerdict as AxisVerdict, Light as Light, Verdict as Verdict
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
