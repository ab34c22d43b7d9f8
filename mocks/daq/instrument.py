"""What a DATAQ DI-1110 or DI-2108 makes of the commands it is sent.

From the maker's "Data Acquisition Instrument Command Protocol" (DATAQ Instruments, revised
2019-08-05): commands are lower-case ASCII, arguments separated by one space, ended by a carriage
return; each is answered by itself with its value while the instrument is not scanning, and by
nothing while it is.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

_END = b"\r"
_LONGEST_COMMAND = 256
_MAKER = "DATAQ"
_INPUTS = range(11)  # analogue 0 to 7, counter 8, rate 9, digital word 10
_PACKETS = range(8)
_COLOURS = range(8)
_ENCODINGS = range(2)
_DECIMATIONS = range(1, 513)
_ALGORITHMS = range(4)
_INFO_QUESTIONS = range(10)


@dataclass(frozen=True)
class MockedBoxModel:
    """What one model of the family is.

    Attributes:
        name: product number, as ``info 1`` states it.
        bits: of its converter; fewer than 16 leave it left-justified in 16.
        dividend: Hz; the scan list's rate is this over the divisor of ``srate``.
        divisors: that ``srate`` takes, least and greatest.
        decimates: whether it has ``dec`` and ``deca``.
    """

    name: str
    bits: int
    dividend: int
    divisors: tuple[int, int]
    decimates: bool


MODELS = {
    "DI-1110": MockedBoxModel("1110", 12, 60_000_000, (375, 65535), decimates=False),
    "DI-2108": MockedBoxModel("2108", 16, 60_000_000, (375, 65535), decimates=True),
}


class CommandInterpreter:
    """The command interpreter.

    Args:
        model: of ``MODELS``.
        serial: as ``info 6`` states it.
        echoes_start: whether the echo of ``start`` comes in front of the data; firmwares differ.

    Attributes:
        scanning: whether samples are being taken.
        scan_list: inputs, by slot.
        divisor: of ``srate``.
        packet: bytes that leave at once.
        as_text: whether samples leave as lines of decimal numbers.
        decimation: scans that are taken for each that leaves; the last of them does, whatever ``deca`` says.
    """

    def __init__(self, model: MockedBoxModel, serial: str, echoes_start: bool = False) -> None:
        self.scanning = False
        self.scan_list: list[int] = [0]
        self.divisor = model.divisors[1]
        self.packet = 16
        self.as_text = False
        self.decimation = 1
        self._model = model
        self._serial = serial
        self._echoes_start = echoes_start
        self._pending = b""
        self._commands: Mapping[str, Callable[[list[str]], str | None]] = {
            "info": self._info,
            "slist": self._slist,
            "srate": self._srate,
            "ps": self._ps,
            "led": self._led,
            "encode": self._encode,
            "dec": self._dec,
            "deca": self._deca,
            "start": self._start,
            "stop": self._stop,
        }

    @property
    def aggregate_rate(self) -> float:
        """Hz, nominal, of words: over the whole scan list."""
        return self._model.dividend / self.divisor

    def take(self, data: bytes) -> bytes:
        """Obey what the cable brings; the answers to it."""
        *commands, self._pending = (self._pending + data).split(_END)
        self._pending = self._pending[-_LONGEST_COMMAND:]
        return b"".join(self._answer(command) for command in commands)

    def _answer(self, command: bytes) -> bytes:
        words = command.decode("ascii", "replace").strip("\0\n ").split(" ")
        obey = self._commands.get(words[0])
        was_scanning = self.scanning
        value = obey(words[1:]) if obey is not None else None
        silent = value is None or (was_scanning and words[0] != "stop")
        if silent or (words[0] == "start" and not self._echoes_start):
            return b""
        return f"{' '.join([*words, value] if value else words)}".encode() + _END + b"\0"

    def _info(self, arguments: list[str]) -> str | None:
        question = _whole(arguments, 1)
        if question is None or question[0] not in _INFO_QUESTIONS:
            return None
        answers = {0: _MAKER, 1: self._model.name, 2: "129", 6: self._serial, 9: str(self._model.dividend)}
        return answers.get(question[0], "0")

    def _slist(self, arguments: list[str]) -> str | None:
        wanted = _whole(arguments, 2)
        if wanted is None or self.scanning:
            return None
        slot, source = wanted
        if source not in _INPUTS or not 0 <= slot <= len(self.scan_list):
            return None
        self.scan_list = self.scan_list[:slot]
        if source in self.scan_list:
            return None
        self.scan_list.append(source)
        return ""

    def _srate(self, arguments: list[str]) -> str | None:
        wanted = _whole(arguments, 1)
        low, high = self._model.divisors
        if wanted is None or self.scanning or not low <= wanted[0] <= high:
            return None
        self.divisor = wanted[0]
        return ""

    def _ps(self, arguments: list[str]) -> str | None:
        wanted = _whole(arguments, 1)
        if wanted is None or self.scanning or wanted[0] not in _PACKETS:
            return None
        self.packet = 1 << (wanted[0] + 4)
        return ""

    def _led(self, arguments: list[str]) -> str | None:
        wanted = _whole(arguments, 1)
        return None if wanted is None or wanted[0] not in _COLOURS else ""

    def _encode(self, arguments: list[str]) -> str | None:
        wanted = _whole(arguments, 1)
        if wanted is None or self.scanning or wanted[0] not in _ENCODINGS:
            return None
        self.as_text = wanted[0] == 1
        return ""

    def _dec(self, arguments: list[str]) -> str | None:
        wanted = _whole(arguments, 1)
        if not self._model.decimates or wanted is None or self.scanning or wanted[0] not in _DECIMATIONS:
            return None
        self.decimation = wanted[0]
        return ""

    def _deca(self, arguments: list[str]) -> str | None:
        wanted = _whole(arguments, 1)
        accepted = self._model.decimates and wanted is not None and wanted[0] in _ALGORITHMS
        return "" if accepted and not self.scanning else None

    def _start(self, arguments: list[str]) -> str | None:
        if arguments != ["0"] and arguments:
            return None
        self.scanning = True
        return ""

    def _stop(self, arguments: list[str]) -> str | None:
        if arguments:
            return None
        self.scanning = False
        return ""


def _whole(arguments: list[str], count: int) -> list[int] | None:
    """The arguments as ``count`` whole numbers; None where they are not."""
    if len(arguments) != count or not all(argument.isdigit() for argument in arguments):
        return None
    return [int(argument) for argument in arguments]
