"""The language of DATAQ DI-1110 and DI-2108 boxes: commands, answers, words of the stream.

From the maker's "Data Acquisition Instrument Command Protocol" (DATAQ Instruments, revised
2019-08-05). The stream is little-endian 16-bit words in scan-list order without any framing.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse

VENDOR = 0x0683
MAKER, MODEL, FIRMWARE, SERIAL, DIVIDEND = 0, 1, 2, 6, 9
"""Questions of ``info``."""

START, STOP = "start 0", "stop"
END = b"\r"

_PACKET_LARGEST = 7
_PACKET_SECONDS = 2.5e-3


@dataclass(frozen=True)
class BoxModel:
    """What the driver must know of a model.

    Attributes:
        number: as ``info 1`` answers.
        bits: of the converter; words of fewer than 16 are left-justified.
        volts: full scale, either sign.
        divisors: least and greatest that ``srate`` takes.
        resets: commands that undo what another program may have left on the box: text for binary, and
            the decimation of a model that has it.
    """

    number: str
    bits: int
    volts: float
    divisors: tuple[int, int]
    resets: tuple[str, ...]

    @property
    def full_scale(self) -> int:
        """Greatest count."""
        return (1 << (self.bits - 1)) - 1


MODELS = {
    "DI-1110": BoxModel("1110", 12, 10.0, (375, 65535), ("encode 0",)),
    "DI-2108": BoxModel("2108", 16, 10.0, (375, 65535), ("encode 0", "dec 1", "deca 1")),
}


def known_model(name: str) -> BoxModel:
    """The model of that name; ``WrongUse`` where this driver knows none."""
    if name not in MODELS:
        raise WrongUse(f"no acquisition box {name!r} is known; there is {', '.join(MODELS)}")
    return MODELS[name]


def divisor(dividend: int, rate: float, channels: int, model: BoxModel) -> int:
    """What ``srate`` must be told for ``rate`` Hz on each of ``channels``.

    Raises:
        WrongUse: the box cannot sample at just this rate.
    """
    low, high = model.divisors
    exact = dividend / (rate * channels)
    whole = round(exact)
    if abs(exact - whole) > 1e-9 * exact or not low <= whole <= high:
        nearest = dividend / (min(max(whole, low), high) * channels)
        raise WrongUse(
            f"the box cannot sample {channels} channels at {rate:g} Hz each; it takes {dividend} Hz over a "
            f"whole number from {low} to {high} for all of them: {nearest:.10g} Hz is the nearest"
        )
    return whole


def packet_exponent(rate: float, channels: int) -> int:
    """What ``ps`` must be told, so that a packet is no older than 2.5 ms when it is full."""
    wanted = 2.0 * channels * rate * _PACKET_SECONDS
    return int(np.clip(np.floor(np.log2(max(wanted, 16.0))) - 4, 0, _PACKET_LARGEST))


def answer_to(command: str, heard: bytes) -> str | None:
    """The value in the echo of a command: what follows the command in a whole line.

    Other lines are echoes of earlier commands, which a box that was busy sends late. None where no line
    is an echo of this command.
    """
    for line in heard.replace(b"\0", b"").split(END)[:-1]:
        text = line.strip(b"\n ").decode("ascii", "replace")
        if text == command or text.startswith(command + " "):
            return text[len(command) :].strip()
    return None


def without_start_echo(data: bytes) -> tuple[bool, bytes]:
    """The first bytes of a stream without an echo of the start in front, which some firmwares send.

    Returns:
        Whether more bytes are needed to tell, and the data.
    """
    echo = START.encode() + END
    if len(data) <= len(echo) and echo.startswith(data):
        return True, data
    return False, data[len(echo) :].removeprefix(b"\0") if data.startswith(echo) else data


def counts(words: AnyArray, model: BoxModel) -> AnyArray:
    """Counts of int16 ``words`` as the box left-justified them; volts are ``counts * volts / 2^(bits-1)``."""
    shifted: AnyArray = words >> (16 - model.bits)
    return shifted


def likely_loss(words: AnyArray, offsets: FloatArray, tolerance: float, model: BoxModel) -> int | None:
    """How many bytes are missing, from what the channels rest at.

    Args:
        words: ``(n, channels)`` int16 as read, of a quiet time; n at least 16.
        offsets: ``(channels,)`` counts that the channels rest at, as calibrated.
        tolerance: counts within which they do.
        model: of the box.

    Returns:
        0 where the order is right; the least number of bytes (less than a scan) whose loss puts the
        calibrated offsets in their places; None where nothing does.
    """
    data = np.ascontiguousarray(words).view(np.uint8).ravel()
    scan = 2 * words.shape[1]
    for missing in range(scan):
        kept = data[(scan - missing) % scan :]
        kept = kept[: len(kept) // scan * scan]
        tried = kept.view("<i2").reshape(-1, words.shape[1])
        rests = np.median(counts(tried, model), axis=0)
        if np.all(np.abs(rests - offsets) <= tolerance):
            return missing
    return None
