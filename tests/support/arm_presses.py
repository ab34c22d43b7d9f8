"""Calibrations by the arm for tests: on the bench in process, in simulated time."""

from pathlib import Path

import numpy as np

from calibration.taxim.arm.plan import PressSettings
from calibration.taxim.arm.press import BALL, ball_scene, procedure
from harness.basics.arrays import ByteArray, FloatArray
from harness.bench.device import Health, Reading, TactileCamera
from harness.bench.gap import gap_path, load_gap
from harness.bench.station import Bench
from harness.bench.station_file import load_station, station_path
from harness.experiment import begin, perform
from harness.experiment.perform import Performed
from harness.picture.image_file import decode_jpeg
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Progress, Quiet
from mocks.camera.gelsight_stream import encode
from mocks.in_process.bench import in_process_bench
from mocks.world.gap_draw import GapDraw

RADIUS = 2e-3


def begun(folder: Path, presses: int = 15, seed: int = 1, gap: str | None = None) -> begin.Begun:
    """Planned and rehearsed on the mocked station; nothing has moved."""
    station = load_station(station_path("mock"))
    return begin.begin(
        procedure(PressSettings(presses=presses)), ball_scene(RADIUS), station, seed, gap, folder
    )


def opened(recording: Recording) -> Bench:
    """The run's bench, in process."""
    run = RunFiles(recording)
    assert run.scene.object.builtin == BALL
    return in_process_bench(run.scene, run.station, run.context)


def perform_on(bench: Bench, recording: Recording, progress: Progress) -> Performed:
    """What is left of a run, on an open bench."""
    return perform.perform_on(procedure(), bench, RunFiles(recording), progress)


def performed(folder: Path, presses: int = 15, seed: int = 1, gap: str | None = None) -> Recording:
    """A whole run."""
    recording = begun(folder, presses, seed, gap).recording
    complete = perform_on(opened(recording), recording, Quiet()).complete
    assert complete
    return recording


def gap_of_aspect(folder: Path, aspect: float, seed: int) -> Path:
    """A gap like ``target`` of which this seed draws pixels ``aspect`` times as high as wide."""
    usual = load_gap("target")
    sigmas = (GapDraw(usual, seed).run.aspect - 1.0) / usual.sensor.aspect
    if (aspect - 1.0) * sigmas <= 0.0:
        raise ValueError(f"seed {seed} draws an aspect on the other side of one; take another")
    text = gap_path("target").read_text()
    stated = next(line for line in text.splitlines() if line.startswith("aspect"))
    path = folder / "aspect.toml"
    path.write_text(text.replace(stated, f'aspect = "{100.0 * (aspect - 1.0) / sigmas!r} %"'))
    return path


class Creeping:
    """A tactile camera in trouble: its gel creeps on after every change, its light fades, or it sees nothing.

    Args:
        inner: the camera whose pictures are changed.
        lasts: s in which what is left of the creep falls by e.
        share: of a change of the picture that comes late.
        trembles: share of a change by which it comes and goes, twice a second.
        fades: grey levels a second by which everything darkens.
        blind: whether it shows the first picture for ever.
    """

    def __init__(
        self,
        inner: TactileCamera,
        lasts: float = 1.0,
        share: float = 0.0,
        trembles: float = 0.0,
        fades: float = 0.0,
        blind: bool = False,
    ) -> None:
        self._inner = inner
        self._lasts, self._share, self._fades, self._blind = lasts, share, fades, blind
        self._trembles = trembles
        self._late: FloatArray | None = None
        self._first: FloatArray | None = None
        self._time = 0.0

    def open(self) -> None:
        """Nothing to connect."""

    def close(self) -> None:
        """Nothing to release."""

    def health(self) -> Health:
        """The inner one's."""
        return self._inner.health()

    def read(self, count: int, timeout: float) -> Reading:
        """The inner one's next frames, as the trouble has them."""
        frames = self._inner.read(count, timeout)
        shown = [
            self._shown(picture.astype(np.float64), float(time))
            for picture, time in zip(frames.values, frames.times, strict=True)
        ]
        encoded = tuple(encode(picture) for picture in shown)
        decoded = [np.asarray(decode_jpeg(jpeg)) for jpeg in encoded]
        return Reading(frames.channel, frames.times, np.array(decoded), encoded)

    def _shown(self, picture: FloatArray, time: float) -> ByteArray:
        if self._first is None or self._late is None:
            self._first, self._late, self._time = picture, picture, time
        # What is late follows the picture as a spring in honey does.
        part = 1.0 - np.exp(-(time - self._time) / self._lasts)
        self._late = self._late + part * (picture - self._late)
        self._time = time
        seen = self._first if self._blind else (1.0 - self._share) * picture + self._share * self._late
        seen = seen + self._trembles * np.cos(13.0 * time) * (seen - self._first)
        faded = np.clip(np.round(seen - self._fades * time), 0.0, 255.0)
        return np.asarray(faded, dtype=np.uint8)
