"""Files of every format, written by the programs other people write them with."""

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from writers import Dataflash, RosBag, Ulog

Write = Callable[..., Path]


@pytest.fixture
def dataflash():
    """An empty ArduPilot log."""
    return Dataflash()


@pytest.fixture
def dive(dataflash):
    """A short ArduPilot log with units, two sensors of a kind, text, and every kind of number."""
    log = dataflash
    log.define(130, "UNIT", "QbZ", "TimeUS,Id,Label")
    log.define(131, "MULT", "Qbd", "TimeUS,Id,Mult")
    log.define(132, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
    log.define(140, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    log.define(141, "IMU", "QBff", "TimeUS,I,GyrX,GyrZ")
    log.define(142, "MSG", "QZ", "TimeUS,Message")
    log.define(143, "ALL", "QbhiqBHIdfgcCeEL", "TimeUS,b,h,i,q,B,H,I,d,f,g,c,C,e,E,L")
    for letter, label in (("s", b"s"), ("d", b"deg"), ("#", b"instance"), ("E", b"rad/s")):
        log.write_message("UNIT", 0, ord(letter), label)
    for letter, scale in (("F", 1e-6), ("0", 1.0), ("-", 0.0), ("C", 1e-3)):
        log.write_message("MULT", 0, ord(letter), scale)
    log.write_message("FMTU", 0, 140, b"sddd", b"F000")
    log.write_message("FMTU", 0, 141, b"s#EE", b"F-0C")
    log.write_message("MSG", 900_000, "ArduSub V4.1 °".encode())
    for k in range(20):
        time = 1_000_000 + 100_000 * k
        log.write_message("ATT", time, 0.01 * k, -0.02 * k, 350 + 0.5 * k)
        log.write_message("IMU", time + 1, 0, 0.5 * k, 1.0)
        log.write_message("IMU", time + 2, 1, 0.25 * k, 2.0)
    integers = (-5, -500, -70_000, -(2**40), 250, 60_000, 2**31)
    scaled = (-1.25, 300.5, -70.01, 9e4, 58.1234567)
    log.write_message("ALL", 3_000_000, *integers, 1 / 3, 0.1, 0.25, *scaled)
    return log


@pytest.fixture
def bag():
    """What writes bags."""
    return RosBag()


def ulog(path, n=10, *, dropout=False, instances=1):
    log = Ulog(1_000_000)
    log.define("vehicle_attitude", "float[4] q;uint8_t reset;uint8_t[3] _padding0")
    log.define("big", "float[80] values")
    for instance in range(instances):
        log.announce(instance, "vehicle_attitude", instance)
    log.announce(9, "big")
    for k in range(n):
        for instance in range(instances):
            log.send(instance, 1_000_000 + 100_000 * k, "4fB", 1.0, 0.1 * k, 0.0, instance, k)
        if dropout and k == 3:
            log.write_message("O", struct.pack("<H", 250))
    log.send(9, 1_000_000, "80f", *range(80))
    return log.save(path)


@pytest.fixture
def write_ulog():
    """What writes ULogs."""
    return ulog
