"""A vehicle to try ``hydrodamp live`` on, without water: ``python vehicle.py``.

It sails the training runs of the paper's campaign, one after the other with a pause of five seconds
between, and sends by MAVLink what an autopilot sends: attitude and rates, velocity along north,
east and down, the pulse widths of the fins, and the propeller's speed.
"""

from __future__ import annotations

import argparse
import socket
import sys
import time
from collections.abc import Iterator

import numpy as np
from pymavlink.dialects.v20 import common
from scipy.spatial.transform import Rotation

import hydrodamp as hd

PAUSE = 5.0  # s


def sent(log: hd.Log) -> Iterator[tuple[float, bytes]]:
    """Yield when what is sent [s]: for every sample four packets, the commands first."""
    link = common.MAVLink(None, srcSystem=1, srcComponent=1)
    turns, clock = Rotation.from_quat(log.attitude, scalar_first=True), 1.0
    angles, over_ground = turns.as_euler("ZYX"), turns.apply(log.velocity[:, :3].copy())
    commands = np.column_stack([log.command(name) for name in ("rudder", "elevator", "rpm")])
    for run in log.segments:
        for k in range(run.start, run.stop):
            now = clock + float(log.time[k] - log.time[run.start])
            rudder, elevator, rpm = commands[k]
            fins, boot = [round(1500 + 1000 * fin) for fin in (rudder, elevator)], round(1000 * now)
            for message in (
                link.servo_output_raw_encode(1000 * boot, 0, *fins, *[0] * 6),
                link.named_value_float_encode(boot, b"rpm", rpm),
                link.local_position_ned_encode(boot, 0, 0, 0, *over_ground[k]),
                link.attitude_encode(boot, *angles[k, ::-1], *log.velocity[k, 3:]),
            ):
                yield now, message.pack(link)
        clock = now + PAUSE


def main(arguments: list[str]) -> int:
    """Sail and send."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--port", type=int, default=14550, help="of this machine, where to send to")
    parser.add_argument("--pace", type=float, default=10.0, help="times as fast as the clock")
    parser.add_argument("--duration", type=float, default=300.0, help="of each of four runs [s]")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    log = hd.reenact(seed=given.seed, duration=given.duration).train
    begun = time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for now, packet in sent(log):
            time.sleep(max(0.0, begun + now / given.pace - time.monotonic()))
            out.sendto(packet, ("127.0.0.1", given.port))
    print(f"sent {log.n} samples of {len(log.segments)} runs")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
