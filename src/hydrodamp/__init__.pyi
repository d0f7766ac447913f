"""The public names and where they live; loaded when first used."""

from .basis.axes import AXES as AXES
from .basis.axes import VELOCITIES as VELOCITIES
from .basis.basis import Basis as Basis
from .basis.term import Term as Term
from .data.canonical import write_log as write_log
from .data.log import Log as Log
from .data.log import Segment as Segment
from .data.log import concatenate as concatenate
from .data.read import read_log as read_log
from .data.read import read_logs as read_logs
from .errors import (
    FallbackWarning as FallbackWarning,
)
from .errors import (
    FileError as FileError,
)
from .errors import (
    ForeignVehicleWarning as ForeignVehicleWarning,
)
from .errors import (
    GapWarning as GapWarning,
)
from .errors import (
    HydrodampError as HydrodampError,
)
from .errors import (
    HydrodampWarning as HydrodampWarning,
)
from .errors import (
    LogError as LogError,
)
from .errors import (
    MethodError as MethodError,
)
from .errors import (
    ModelError as ModelError,
)
from .errors import (
    ProblemError as ProblemError,
)
from .errors import (
    PropulsionWarning as PropulsionWarning,
)
from .errors import (
    TermError as TermError,
)
from .errors import (
    VehicleError as VehicleError,
)
from .identification.adaptive import AdaptiveIdentifier as AdaptiveIdentifier
from .identification.adaptive import History as History
from .identification.derivative import (
    FiniteDifference as FiniteDifference,
)
from .identification.derivative import (
    RecordedAcceleration as RecordedAcceleration,
)
from .identification.derivative import (
    SavitzkyGolay as SavitzkyGolay,
)
from .identification.fit import Fit as Fit
from .identification.fit import identify as identify
from .identification.gains import ByNoise as ByNoise
from .identification.gains import ByTerm as ByTerm
from .identification.least_squares import LeastSquares as LeastSquares
from .identification.methods import (
    METHODS as METHODS,
)
from .identification.methods import (
    find_method as find_method,
)
from .identification.methods import (
    identify_all as identify_all,
)
from .identification.online import State as State
from .identification.online import observe as observe
from .identification.triangle import (
    Triangle as Triangle,
)
from .identification.triangle import (
    accumulate as accumulate,
)
from .identification.triangle import (
    damping_wrench as damping_wrench,
)
from .identification.triangle import (
    merge as merge,
)
from .kernels.inputs import Sample as Sample
from .models.catalog import (
    PAPER_MODELS as PAPER_MODELS,
)
from .models.catalog import (
    catalog as catalog,
)
from .models.catalog import (
    find_model as find_model,
)
from .models.cite import cite as cite
from .models.damping import Damping as Damping
from .models.damping import VehicleStamp as VehicleStamp
from .models.damping_file import read_damping as read_damping
from .models.damping_file import write_damping as write_damping
from .models.files import (
    read_model as read_model,
)
from .models.files import (
    read_models as read_models,
)
from .models.files import (
    write_model as write_model,
)
from .models.model import DampingModel as DampingModel
from .models.published import published as published
from .report.files import read_comparison as read_comparison
from .report.files import write_comparison as write_comparison
from .simulation.campaign.reenact import Campaign as Campaign
from .simulation.campaign.reenact import reenact as reenact
from .simulation.problem import Problem as Problem
from .simulation.problem import prepare as prepare
from .simulation.replay import Trajectory as Trajectory
from .simulation.replay import simulate as simulate
from .simulation.score import Score as Score
from .simulation.score import score as score
from .simulation.status import Status as Status
from .validation.compare import compare as compare
from .validation.comparison import Comparison as Comparison
from .validation.comparison import Row as Row
from .validation.paper import TABLE_I as TABLE_I
from .validation.paper import rank_correlation as rank_correlation
from .vehicle.file import read_vehicle as read_vehicle
from .vehicle.file import write_vehicle as write_vehicle
from .vehicle.fin import Fin as Fin
from .vehicle.fleet import find_vehicle as find_vehicle
from .vehicle.fleet import fleet as fleet
from .vehicle.matrix import Matrix as Matrix
from .vehicle.propeller import Propeller as Propeller
from .vehicle.thruster import Thruster as Thruster
from .vehicle.vehicle import Vehicle as Vehicle

__version__: str
