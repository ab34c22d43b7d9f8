"""A toy driver: a thermometer that sends a line of kelvins ten times a second."""

import socket

import numpy as np

from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.bench.device import Channel, Health, Reading

CHANNEL = Channel("thermometer.temperature", "K", (), "float64", nominal_rate=10.0)


class Thermometer:
    def __init__(self, address: str, serial: str) -> None:
        self._address, self._serial = address, serial
        self._line: socket.socket | None = None

    def open(self) -> None:
        host, _, port = self._address.partition(":")
        try:
            self._line = socket.create_connection((host, int(port)), 2.0)
        except OSError as error:
            raise BenchFault(f"no thermometer at {self._address}; check its cable") from error

    def close(self) -> None:
        if self._line is not None:
            self._line.close()

    def read(self, count: int, timeout: float) -> Reading:
        assert self._line is not None
        self._line.settimeout(timeout)
        times, values = [], []
        with self._line.makefile() as lines:
            for line in lines:
                times.append(now())
                values.append(float(line))
                if len(values) == count:
                    return Reading(CHANNEL, np.array(times), np.array(values))
        raise BenchFault("the thermometer sends nothing; check its cable")

    def health(self) -> Health:
        return Health("thermometer", f"thermometer {self._serial}", 10.0, 0, None)
