"""The public names and where they live; loaded when first used."""

from .basis.term import Term as Term
from .batch.batch import batch as batch
from .conditioning.derivatives import rates_from_attitude as rates_from_attitude
from .conditioning.pipeline import clean as clean
from .conditioning.quality_checks import check_quality as check_quality
from .data.canonical import write_log as write_log
from .data.concatenation import concatenate as concatenate
from .data.log import Log as Log
from .errors import HydrodampError as HydrodampError, HydrodampWarning as HydrodampWarning
from .experiment_design.envelope import Envelope as Envelope
from .experiment_design.plan import plan as plan
from .export.export import export as export, find_target as find_target
from .identification.adaptive import AdaptiveIdentifier as AdaptiveIdentifier
from .identification.composite import CompositeIdentifier as CompositeIdentifier
from .identification.differentiation import (
    FiniteDifference as FiniteDifference,
    RecordedAcceleration as RecordedAcceleration,
    SavitzkyGolay as SavitzkyGolay,
)
from .identification.dissipative import Dissipative as Dissipative
from .identification.fit import Fit as Fit, Uncertainty as Uncertainty
from .identification.general_model import general_model as general_model
from .identification.grades import Grade as Grade
from .identification.least_squares import (
    LeastSquares as LeastSquares,
    Ridge as Ridge,
    WeakForm as WeakForm,
)
from .identification.methods import (
    METHODS as METHODS,
    find_method as find_method,
    identify as identify,
    identify_all as identify_all,
)
from .identification.online import observe as observe
from .identification.output_error import OutputError as OutputError, Recommended as Recommended
from .identification.predicted_error import (
    predict_error as predict_error,
    prediction_band as prediction_band,
)
from .identification.recursive import RecursiveLeastSquares as RecursiveLeastSquares
from .identification.stepwise import StepwiseSelection as StepwiseSelection
from .ingest.inspection.probe import probe as probe
from .ingest.mapping.log_mapping import LogMapping as LogMapping, read_mapping as read_mapping
from .ingest.read import (
    read_log as read_log,
    read_logs as read_logs,
    read_recording as read_recording,
)
from .models.catalog import (
    PAPER_MODELS as PAPER_MODELS,
    catalog as catalog,
    find_model as find_model,
    published as published,
)
from .models.damping import Damping as Damping
from .models.files import (
    read_damping as read_damping,
    read_models as read_models,
    write_damping as write_damping,
    write_model as write_model,
)
from .models.model import DampingModel as DampingModel
from .report.figures.diagnostics import (
    front_figure as front_figure,
    residuals_figure as residuals_figure,
)
from .report.figures.replays import replays_figure as replays_figure
from .report.figures.style import save_figure as save_figure
from .report.files import read_comparison as read_comparison, write_comparison as write_comparison
from .report.fit_tables import format_coefficients as format_coefficients
from .report.page import write_report as write_report
from .simulation.campaign.reenact import reenact as reenact
from .simulation.problem import Problem as Problem, prepare as prepare
from .simulation.replay import (
    Score as Score,
    Trajectory as Trajectory,
    score as score,
    simulate as simulate,
)
from .status import Status as Status
from .validation.compare import (
    PAPER_TABLE_I as PAPER_TABLE_I,
    Comparison as Comparison,
    compare as compare,
)
from .validation.cross_validation import cross_validate as cross_validate
from .validation.diagnostics import diagnose as diagnose
from .vehicle.actuators import (
    Curve as Curve,
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
