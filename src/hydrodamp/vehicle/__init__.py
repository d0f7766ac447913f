"""The vehicle: everything that is known before a log is read.

Read :mod:`~hydrodamp.vehicle.mass` (the rigid-body mass matrix and what a mass
matrix must satisfy), :mod:`~hydrodamp.vehicle.hull` (added mass from length and
diameter), :mod:`~hydrodamp.vehicle.actuation` and
:mod:`~hydrodamp.vehicle.actuators` (fins, propellers, thrusters, plain
matrices), :mod:`~hydrodamp.vehicle.columns` (all that as columns of the
regressor), :mod:`~hydrodamp.vehicle.vehicle` (the value that holds them), then
:mod:`~hydrodamp.vehicle.schema`, :mod:`~hydrodamp.vehicle.unneeded`,
:mod:`~hydrodamp.vehicle.faults` and :mod:`~hydrodamp.vehicle.file` (the vehicle
file), :mod:`~hydrodamp.vehicle.template` (a file to fill in) and
:mod:`~hydrodamp.vehicle.fleet` (named vehicles with their sources).
"""
