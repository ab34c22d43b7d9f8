"""A sound card without hardware: PipeWire, private to this program, with one microphone on it.

What is played into the card's null sink comes out of its virtual source, which PortAudio
lists by name like any other microphone (PipeWire's documentation: "Virtual devices", the
factories ``support.null-audio-sink`` and ``adapter``, and its ALSA plug-in). No session bus, no
display and no settings of the user are touched: sockets, settings and state lie in a folder
that is removed at the end, and no real device is opened.

PipeWire carries 32-bit floats, so the upper 24 bits of a sample pass unchanged. Rate and
channel count are the same from end to end, hence nothing is resampled, mixed or dithered.
"""

import contextlib
import ctypes
import ctypes.util
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, WrongUse
from harness.basics.resampling import resample
from harness.bench.acquisition import AcquisitionCalibration
from harness.bench.station_file import Station
from mocks.daq.strike_counts import StrikeCounts, StrikesOnBox
from mocks.far_ends import LabBench
from mocks.faults import Fault
from mocks.lab_processes import FarEnd
from mocks.shared_pose import Firing
from mocks.sound_card.player import AT_ONCE, HEADER, MEANWHILE

MICROPHONE = "mock_microphone"
SPEAKER = "mock_speaker"

_POSITIONS = {1: ("MONO",), 2: ("FL", "FR")}

# A daemon with no devices of its own. Names of modules and factories are PipeWire's.
_DAEMON = """
context.properties = {{
    core.daemon = true
    core.name = pipewire-0
    support.dbus = false
    default.clock.rate = {rate}
    default.clock.allowed-rates = [ {rate} ]
    default.clock.quantum = {quantum}
    default.clock.min-quantum = {quantum}
    default.clock.max-quantum = {quantum}
}}
context.spa-libs = {{
    audio.convert.* = audioconvert/libspa-audioconvert
    support.* = support/libspa-support
}}
context.modules = [
    {{ name = libpipewire-module-protocol-native }}
    {{ name = libpipewire-module-metadata }}
    {{ name = libpipewire-module-spa-node-factory }}
    {{ name = libpipewire-module-client-node }}
    {{ name = libpipewire-module-client-device }}
    {{ name = libpipewire-module-access }}
    {{ name = libpipewire-module-adapter }}
    {{ name = libpipewire-module-link-factory }}
    {{ name = libpipewire-module-session-manager }}
]
context.objects = [
    {{ factory = metadata args = {{ metadata.name = default }} }}
    {{ factory = adapter args = {{
        factory.name = support.null-audio-sink
        node.name = {speaker}
        media.class = Audio/Sink
        audio.rate = {rate}
        audio.position = [ {positions} ]
        monitor.channel-volumes = false
        node.pause-on-idle = false
        priority.driver = 30000
    }} }}
    {{ factory = adapter args = {{
        factory.name = support.null-audio-sink
        node.name = {microphone}
        media.class = Audio/Source/Virtual
        audio.rate = {rate}
        audio.position = [ {positions} ]
        node.pause-on-idle = false
        priority.driver = 20000
    }} }}
]
"""

# PortAudio's list of ALSA devices must end with one named "default" or it stops the program
# by an assertion (libportaudio 19.6, BuildDeviceList).
_DEVICES = """
pcm.{microphone} {{
    type pipewire server "{socket}" capture_node "{microphone}" playback_node "-1"
    rate {rate} channels {channels} format "S32_LE" hint {{ show on description "mocked microphone" }}
}}
pcm.{speaker} {{
    type pipewire server "{socket}" playback_node "{speaker}" capture_node "-1"
    rate {rate} channels {channels} format "S32_LE" hint {{ show on description "mocked speaker" }}
}}
pcm.default {{ type null }}
"""


PACKAGES = "pipewire wireplumber pipewire-alsa libportaudio2"
"""What Debian and Ubuntu call what is needed."""

_PROGRAMS = ("pipewire", "wireplumber", "pw-link")
_PLUGIN = "libasound_module_pcm_pipewire.so"
_START_TIMEOUT = 15.0
_END_TIMEOUT = 2.0
_LOOK_PERIOD = 0.05
_PR_SET_PDEATHSIG = 1
_PUNCTUAL = -10
_LIBC = ctypes.CDLL(None)


def why_not() -> str:
    """Why no sound card can be mocked on this machine, in a sentence; empty where one can."""
    if sys.platform != "linux":
        return f"PipeWire needs Linux, and this is {sys.platform}"
    missing = [program for program in _PROGRAMS if shutil.which(program) is None]
    missing += [] if any(Path("/usr").glob(f"lib*/**/alsa-lib/{_PLUGIN}")) else ["PipeWire's ALSA plug-in"]
    missing += [] if ctypes.util.find_library("portaudio") else ["PortAudio"]
    if missing:
        return f"{', '.join(missing)} not installed; on Debian: apt-get install {PACKAGES}"
    return ""


class SoundCard:
    """PipeWire with one null sink, its sound led to one microphone; a context manager.

    Its processes end when this object is stopped, and with the process that started them, by
    whatever means that ends (prctl(2), PR_SET_PDEATHSIG; start it from the main thread).

    Args:
        rate: samples a second.
        channels: 1 or 2.
        quantum: samples that PipeWire hands over at a time; a busy computer is late for small ones.
        under: folder in which the card's own is made; None for the system's.
    """

    microphone = MICROPHONE  #: its name among PortAudio's devices.

    def __init__(
        self, rate: int = 48000, channels: int = 1, quantum: int = 2048, under: Path | None = None
    ) -> None:
        if channels not in (1, 2):
            raise ValueError(f"a mocked sound card has 1 or 2 channels, not {channels}")
        self.rate = rate
        self.channels = channels
        self.environment: dict[str, str] = {}  #: what a process that opens it must have in its environment.
        self._quantum = quantum
        self._under = under
        self._folder: Path | None = None
        self._children: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> "SoundCard":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        """Begin, and wait until the microphone can be opened; does nothing if it has begun.

        Raises:
            BenchFault: it cannot be mocked here, or did not start.
        """
        if self._folder is not None:
            return
        reason = why_not()
        if reason:
            raise BenchFault(f"no sound card can be mocked here: {reason}")
        self._folder = Path(tempfile.mkdtemp(prefix="sound-card-", dir=self._under))
        try:
            self._begin(self._folder)
        except BaseException:
            self.stop()
            raise

    def stop(self) -> None:
        """End every process and remove every file; does nothing if it has not begun."""
        for child in reversed(self._children):
            child.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.wait(_END_TIMEOUT)
            child.kill()
            child.wait()
            for pipe in filter(None, (child.stdin, child.stdout)):
                with contextlib.suppress(OSError):
                    pipe.close()
        self._children = []
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None

    def unplug(self) -> None:
        """Take the card away while it is listened to."""
        for child in self._children:
            child.kill()

    def play(self, counts: AnyArray, at: float = AT_ONCE) -> None:
        """Let the microphone hear these samples; else it is silent.

        Args:
            counts: ``(samples, channels)`` int32, of which the upper 24 bits are heard.
            at: s on the bench clock, at which the sink is to take the first of them, to a fraction of a
                sample; it must be far enough ahead. ``AT_ONCE`` for after what was played before, every
                sample as it is; ``MEANWHILE`` for these to be repeated while nothing else is played.

        Raises:
            ValueError: another shape or type.
            BenchFault: the card is not there.
        """
        if counts.dtype != np.int32 or counts.ndim != 2 or counts.shape[1] != self.channels:
            raise ValueError(
                f"int32 of shape (n, {self.channels}) is played, not {counts.dtype} {counts.shape}"
            )
        player = self._children[-1] if self._children else None
        if player is None or player.stdin is None:
            raise BenchFault("the mocked sound card was played on before it was started")
        try:
            player.stdin.write(HEADER.pack(at, counts.nbytes) + counts.tobytes())
            player.stdin.flush()
        except OSError as broken:
            raise BenchFault("the mocked sound card is gone") from broken

    def stumbles(self) -> int:
        """How often since the last call the player came late, so that a gap was heard in what it played."""
        player = self._children[-1] if self._children else None
        if player is None or player.stdout is None:
            return 0
        os.set_blocking(player.stdout.fileno(), False)
        return len(player.stdout.read() or b"")

    def _begin(self, folder: Path) -> None:
        """PipeWire, then its session manager, then the link, then the player."""
        config, devices, socket = folder / "card.conf", folder / "devices.conf", folder / "pipewire-0"
        positions, names = _POSITIONS[self.channels], {"speaker": SPEAKER, "microphone": MICROPHONE}
        places = " ".join(positions)
        config.write_text(_DAEMON.format(rate=self.rate, quantum=self._quantum, positions=places, **names))
        devices.write_text(_DEVICES.format(socket=socket, rate=self.rate, channels=self.channels, **names))
        self.environment = {"ALSA_CONFIG_PATH": str(devices)}
        self._spawn(["pipewire", "-c", str(config)])
        self._wait(socket.exists, "PipeWire made no socket")
        # WirePlumber links streams and leaves devices alone: by a file until 0.4, by a profile from 0.5.
        version = [str(shutil.which("wireplumber")), "--version"]
        stated = subprocess.run(version, capture_output=True, text=True, check=False).stdout
        policy = ("-c", "policy.conf") if "libwireplumber 0.4" in stated else ("-p", "policy")
        self._spawn(["wireplumber", *policy])
        # What the sink plays, and where the microphone hears it, channel by channel.
        outputs = [f"{SPEAKER}:monitor_{each}" for each in positions]
        inputs = [f"{MICROPHONE}:input_{each}" for each in positions]
        wanted = {*outputs, *inputs}
        self._wait(lambda: wanted <= set(self._run(["pw-link", "-io"]).split()), "PipeWire made no sink")
        for output, into in zip(outputs, inputs, strict=True):
            self._run(["pw-link", output, into])
        arguments = SPEAKER, str(self.rate), str(self.channels), str(self._quantum)
        player = self._spawn([sys.executable, "-P", "-m", "mocks.sound_card.player", *arguments])
        if player.stdout is None or player.stdout.read(1) != b".":
            raise BenchFault(f"the mocked sound card's player did not start: {self._last_words()}")

    def _spawn(self, command: list[str]) -> "subprocess.Popen[bytes]":
        log = self._log().open("ab")
        with log:
            child = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=self._surroundings(),
                preexec_fn=_die_with_parent,
            )
        self._children.append(child)
        return child

    def _run(self, command: list[str]) -> str:
        done = subprocess.run(command, env=self._surroundings(), capture_output=True, text=True, check=False)
        return done.stdout

    def _surroundings(self) -> dict[str, str]:
        """The environment of the card's processes: nothing of the user's session is in it."""
        folder = str(self._folder)
        kept = {name: os.environ[name] for name in ("PATH", "LD_LIBRARY_PATH", "HOME") if name in os.environ}
        private = ("XDG_RUNTIME_DIR", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "PIPEWIRE_RUNTIME_DIR")
        root = str(Path(__file__).parents[2])
        return {**kept, **dict.fromkeys(private, folder), "PYTHONPATH": root, **self.environment}

    def _wait(self, there: Callable[[], bool], complaint: str) -> None:
        deadline = now() + _START_TIMEOUT
        while not there():
            ended = [child for child in self._children if child.poll() is not None]
            if ended or now() > deadline:
                raise BenchFault(f"the mocked sound card did not start: {complaint}: {self._last_words()}")
            time.sleep(_LOOK_PERIOD)

    def _log(self) -> Path:
        assert self._folder is not None
        return self._folder / "log"

    def _last_words(self) -> str:
        lines = self._log().read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"


def _die_with_parent() -> None:
    """In the child: ask Linux for an end when the parent ends, and to be served before others."""
    _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _PUNCTUAL)


NOISE = -110.0
"""Noise level (rms) in dB of full scale, of a typical 24-bit converter."""


@dataclass(frozen=True)
class CardConverter:
    """A converter as it is, which a calibration only approximates."""

    counts_per_pascal: float  #: of microphone, preamplifier and converter.
    offset: float  #: counts at rest.
    full_scale: int  #: greatest count; beyond it the converter stays there.

    @classmethod
    def of(cls, calibration: AcquisitionCalibration) -> "CardConverter":
        """The converter that a calibration of a microphone on a sound card speaks of."""
        return cls(
            1.0 / calibration.pascals_per_count,
            calibration.microphone_offset,
            calibration.microphone_full_scale_counts,
        )

    def counts(self, pressure: FloatArray, noise: np.random.Generator) -> AnyArray:
        """``(t,)`` int32 of ``(t,)`` Pa."""
        own = self.full_scale * 10.0 ** (NOISE / 20.0) * noise.standard_normal(len(pressure))
        wanted = np.rint(pressure * self.counts_per_pascal + self.offset + own)
        clipped: AnyArray = np.clip(wanted, -self.full_scale - 1, self.full_scale).astype(np.int32)
        return clipped


AHEAD = 0.3
"""Time in s between the computation of a strike and its start: a sound card requests samples that early."""

_WORD = 32
_IDLE = 2.0


@dataclass(frozen=True)
class Wire:
    """The format and the scale of a sound card's input."""

    rate: int  #: samples a second.
    channels: int  #: of the card.
    channel: int  #: with the microphone.
    converter: CardConverter  #: of that channel.
    sound_rate: float  #: Hz, at which the world makes its sound.

    def samples(self, pressure: FloatArray, noise: np.random.Generator) -> AnyArray:
        """``(n, channels)`` int32 of ``(t,)`` Pa: their upper bits are the converter's counts."""
        count = int((len(pressure) - 1) / self.sound_rate * self.rate)
        heard = resample(pressure, 0.0, self.sound_rate, np.arange(count) / self.rate, float(self.rate))
        counts = self.converter.counts(heard, noise)
        shift = _WORD - 1 - int(self.converter.full_scale).bit_length()
        played = np.zeros((len(counts), self.channels), np.int32)
        played[:, self.channel] = np.left_shift(counts, shift)
        return played


class PluggedCard:
    """A sound card, playing, with the station's microphone on it; a ``FarEnd``.

    Raises:
        BenchFault: no sound card can be mocked on this computer, and why.
        WrongUse: the station's microphone is on the hammer's box, or there is no hammer.
    """

    faults = ("unplug",)  #: the card is taken away, for good.

    def __init__(self, station: Station, folder: Path) -> None:
        section, hammer = station.own_microphone, station.hammer
        if section is None or hammer is None:
            raise WrongUse(f"the station {station.title!r} has no microphone on a sound card; none is mocked")
        channels, rate = section.channels or 1, round(section.rate or 0.0)
        self.card = SoundCard(rate, channels, under=folder)
        self.card.start()
        converter = CardConverter.of(hammer.acquisition)
        self.wire = Wire(rate, channels, section.channel or 0, converter, hammer.rate)
        self.address = self.card.microphone
        self.environment = self.card.environment

    def wait_ready(self, timeout: float) -> None:
        """Nothing to wait for: it plays once it is made."""

    def cue(self, _fault: Fault) -> None:
        """Take the card away."""
        self.card.unplug()

    def kill(self) -> None:
        """End its processes."""
        self.card.stop()


def start_microphone(_name: str, lab: LabBench) -> FarEnd:
    """Plug in a sound card with the station's microphone."""
    return PluggedCard(lab.station, lab.folder)


class StrikesOnCard(StrikesOnBox):
    """Inputs 0 and 1 of the hammer's box, while the card plays the microphone's sound.

    A strike begins on both at one scan of the box, ``AHEAD`` s after it was computed.

    Args:
        strikes: of the run, the box's input 1 being shorted.
        firing: the newest firing.
        card: that plays.
        wire: of the card.
        scans: number of a scan of the box, its bench time in s, and scans a second; of now.
    """

    def __init__(
        self,
        strikes: StrikeCounts,
        firing: Callable[[], Firing],
        card: SoundCard,
        wire: Wire,
        scans: Callable[[], tuple[int, float, float]],
    ) -> None:
        super().__init__(strikes, firing)
        self._card = card
        self._wire = wire
        self._scans = scans

    def begin(self) -> None:
        """Let the card play what is always heard."""
        quiet = self._strikes.sound.idle(_IDLE)
        noise = self._strikes.sound.converter_noise(-1, -1).spawn(1)[0]
        self._card.play(self._wire.samples(quiet, noise), MEANWHILE)

    def _strike(self, firing: Firing) -> None:
        sound = self._strikes.sound
        truth = sound.strike(firing.base_from_flange, firing.step, firing.sample)
        record = self._strikes.read(truth, firing.step, firing.sample)
        noise = sound.converter_noise(firing.step, firing.sample).spawn(1)[0]
        samples = self._wire.samples(truth.pressure, noise)
        number, time, rate = self._scans()
        begin = number + int(np.ceil((now() + AHEAD - time) * rate))
        self._playing = begin, record
        self._card.play(samples, time + (begin - number) / rate)
