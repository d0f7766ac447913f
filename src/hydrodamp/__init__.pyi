"""The public names and where they live; loaded when first used."""

from .basis.axes import AXES as AXES, VELOCITIES as VELOCITIES
from .basis.basis import Basis as Basis
from .basis.term import Term as Term
from .data.canonical import write_log as write_log
from .data.log import Log as Log, Segment as Segment, concatenate as concatenate
from .data.read import read_log as read_log, read_logs as read_logs
from .errors import (
    FallbackWarning as FallbackWarning,
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
from .identification.adaptive import AdaptiveIdentifier as AdaptiveIdentifier, History as History
from .identification.derivative import (
    Derivative as Derivative,
    FiniteDifference as FiniteDifference,
    RecordedAcceleration as RecordedAcceleration,
    SavitzkyGolay as SavitzkyGolay,
)
from .identification.fit import Fit as Fit, Method as Method, identify as identify
from .identification.gains import ByNoise as ByNoise, ByTerm as ByTerm
from .identification.least_squares import LeastSquares as LeastSquares
from .identification.methods import (
    METHODS as METHODS,
    find_method as find_method,
    identify_all as identify_all,
)
from .identification.online import State as State, observe as observe
from .identification.triangle import (
    Triangle as Triangle,
    accumulate as accumulate,
    damping_wrench as damping_wrench,
    merge as merge,
)
from .kernels.inputs import Sample as Sample
from .models.catalog import (
    PAPER_MODELS as PAPER_MODELS,
    catalog as catalog,
    find_model as find_model,
)
from .models.cite import cite as cite
from .models.damping import Damping as Damping, VehicleStamp as VehicleStamp
from .models.damping_file import read_damping as read_damping, write_damping as write_damping
from .models.files import (
    read_model as read_model,
    read_models as read_models,
    write_model as write_model,
)
from .models.model import DampingModel as DampingModel
from .models.published import published as published
from .report.files import read_comparison as read_comparison, write_comparison as write_comparison
from .simulation.campaign.reenact import Campaign as Campaign, reenact as reenact
from .simulation.columns import Columns as Columns, columns as columns
from .simulation.problem import Problem as Problem, prepare as prepare
from .simulation.replay import Trajectory as Trajectory, simulate as simulate
from .simulation.score import Score as Score, score as score
from .simulation.status import Status as Status
from .validation.compare import compare as compare
from .validation.comparison import Comparison as Comparison, Row as Row
from .validation.paper import TABLE_I as TABLE_I, rank_correlation as rank_correlation
from .vehicle.file import read_vehicle as read_vehicle, write_vehicle as write_vehicle
from .vehicle.fin import Fin as Fin
from .vehicle.fleet import find_vehicle as find_vehicle, fleet as fleet
from .vehicle.matrix import Matrix as Matrix
from .vehicle.propeller import Propeller as Propeller
from .vehicle.thruster import Thruster as Thruster
from .vehicle.vehicle import Vehicle as Vehicle

__version__: str
