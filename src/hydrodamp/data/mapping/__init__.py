"""How the topics and columns of any log become those of the canonical form.

A mapping is a YAML file. Every entry on the right is a column, ``topic.field`` where a log has
topics, or a table with more to say about it::

    extends: rep103-odometry       # a preset, or a mapping file beside this one
    frame: FLU                     # body and world: FRD (default, world NED) or FLU (world z up)
    time: {column: t_ms, unit: ms} # or `recorded`: when each message was recorded
    attitude:                      # roll pitch yaw, or qw qx qy qz; yaw alone with u v r
      roll: roll_rad
      pitch: {column: pitch_deg, unit: deg, sign: -1}
      yaw: yaw_rad
    velocity: {u: u, v: v, w: w, p: p, q: q, r: r}
    commands: {rudder: {column: delta_deg, unit: deg, hold: true}}
    acceleration: {du: ax}         # optional, as are wrench {X ... N}, eta, segment

Read :mod:`~hydrodamp.data.mapping.log_mapping` first: the value a mapping file becomes. Then
:mod:`~hydrodamp.data.mapping.schema` (the form of the file),
:mod:`~hydrodamp.data.mapping.composition` (presets and overrides),
:mod:`~hydrodamp.data.mapping.finding` (channels in a recording),
:mod:`~hydrodamp.data.mapping.feeds` (their numbers, topic by topic, and their clocks),
:mod:`~hydrodamp.data.mapping.frames` (axes),
:mod:`~hydrodamp.data.mapping.assembling` (one clock, our axes) and
:mod:`~hydrodamp.data.mapping.joining` (all of it in a row).
"""

from hydrodamp.data.mapping.composition import presets
from hydrodamp.data.mapping.log_mapping import LogMapping, json_schema, read_mapping

__all__ = ["LogMapping", "json_schema", "presets", "read_mapping"]
