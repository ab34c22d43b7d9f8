"""PortAudio as `sounddevice` shows it, its callbacks made by a test, on a clock that the test turns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray


class PortAudioError(Exception):
    pass


@dataclass
class Status:
    input_underflow: bool = False
    input_overflow: bool = False
    output_underflow: bool = False
    priming_output: bool = False

    def __bool__(self) -> bool:
        return self.input_underflow or self.input_overflow or self.output_underflow or self.priming_output


@dataclass
class Times:
    inputBufferAdcTime: float  # noqa: N815 - PortAudio's names
    currentTime: float  # noqa: N815


FINE = Status()
DEVICES = (("Loud speaker", 0), ("Lab card: USB Audio (hw:1,0)", 2), ("Lab card: USB Audio #1 (hw:2,0)", 1))


class FakePortAudio:
    """Stands for the module `sounddevice`; see `FakeStream` for the one stream it opens."""

    PortAudioError = PortAudioError

    def __init__(self, devices: Sequence[tuple[str, int]] = DEVICES) -> None:
        self.devices = devices
        self.time = 1000.0
        self.refusal = ""
        self.listed = 0
        self.stream: FakeStream | None = None

    def _terminate(self) -> None:
        pass

    def _initialize(self) -> None:
        self.listed += 1

    def query_hostapis(self) -> tuple[dict[str, Any], ...]:
        return ({"name": "ALSA"},)

    def query_devices(self) -> list[dict[str, Any]]:
        return [
            {"name": name, "index": index, "hostapi": 0, "max_input_channels": inputs}
            for index, (name, inputs) in enumerate(self.devices)
        ]

    def check_input_settings(self, **settings: Any) -> None:
        if self.refusal:
            raise PortAudioError(self.refusal)

    def RawInputStream(self, **settings: Any) -> "FakeStream":  # noqa: N802 - sounddevice's name
        self.stream = FakeStream(self, settings)
        return self.stream


class FakeStream:
    """A stream whose callbacks a test makes with `deliver`; the first comes when it starts."""

    def __init__(self, library: FakePortAudio, settings: dict[str, Any]) -> None:
        self.settings = settings
        self.closed = False
        self._library = library
        self._callback: Callable[..., None] = settings["callback"]
        self._samples = settings["blocksize"] * settings["channels"]

    def start(self) -> None:
        self.deliver()

    def close(self) -> None:
        self.closed = True

    def deliver(
        self,
        counts: AnyArray | None = None,
        *,
        status: Status = FINE,
        late: float = 0.0,
        age: float | None = None,
        elapsed: float | None = None,
    ) -> None:
        """One callback, a block's time after the last one and ``late`` s late; ``age`` 0 states none."""
        block = self.settings["blocksize"] / self.settings["samplerate"]
        self._library.time += block if elapsed is None else elapsed
        raw = np.zeros(self._samples, np.int32) if counts is None else counts
        self._library.time += late
        current = self._library.time + 5.0  # PortAudio's own clock is not the bench's
        stated = block + late if age is None else age
        adc = current - stated if stated else 0.0
        data = packed(raw, self.settings["dtype"])
        self._callback(data, self.settings["blocksize"], Times(adc, current), status)
        self._library.time -= late


def packed(counts: AnyArray, dtype: str) -> bytes:
    """Counts as PortAudio hands them over: little-endian, 3 or 4 bytes each."""
    raw = np.asarray(counts, "<i4").reshape(-1, 1).view(np.uint8)
    return bytes(raw[:, :3].tobytes() if dtype == "int24" else raw.tobytes())
