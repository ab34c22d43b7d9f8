"""What the mocks' processes share: where the arm is, and which step and sample this is.

The memory is anonymous and inherited by fork, so nothing of it outlives the processes,
however they end. Each cell carries a checksum: a reader that meets a half-written cell reads
it again, without locks that a killed writer could hold for ever.
"""

import mmap
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray

_CHECKSUM = struct.Struct("<I")
_SLOT = 256
_ATTEMPTS = 10_000


@dataclass(frozen=True)
class StepMark:
    """The step and sample that the run is at."""

    number: int  #: counts marks, so that a repeated step is told from the last one.
    step: int  #: of the run.
    sample: int  #: of the step; -1 before the first.


@dataclass(frozen=True, eq=False)
class Firing:
    """The last time that the striker's output was switched on."""

    number: int  #: counts firings; zero before the first.
    base_from_flange: FloatArray  #: ``(4, 4)``, where the flange was.
    step: int  #: of the run.
    sample: int  #: of the step.


class _Cell:
    """A few numbers in shared memory, written by one process and read by any."""

    def __init__(self, memory: mmap.mmap, slot: int, layout: str) -> None:
        self._memory = memory
        self._start = slot * _SLOT
        self._layout = struct.Struct(layout)

    def write(self, *values: float) -> None:
        payload = self._layout.pack(*values)
        packed = payload + _CHECKSUM.pack(zlib.crc32(payload))
        self._memory[self._start : self._start + len(packed)] = packed

    def read(self) -> tuple[float, ...]:
        size = self._layout.size
        for _ in range(_ATTEMPTS):
            packed = self._memory[self._start : self._start + size + _CHECKSUM.size]
            if zlib.crc32(packed[:size]) == _CHECKSUM.unpack(packed[size:])[0]:
                return self._layout.unpack(packed[:size])
        raise RuntimeError("a cell shared by the mocks stays half written; its writer has died")


class SharedPose:
    """Pose of the flange and firings (written by the controller), and mark (written by the lab).

    Args:
        base_from_flange: ``(4, 4)`` before the controller's first cycle.
        viewers: how many cameras acknowledge marks.
    """

    def __init__(self, base_from_flange: FloatArray, viewers: int = 2) -> None:
        memory = mmap.mmap(-1, _SLOT * (3 + viewers))
        self._pose = _Cell(memory, 0, "<12d")
        self._mark = _Cell(memory, 1, "<3q")
        self._firing = _Cell(memory, 2, "<12d3q")
        self._shown = [_Cell(memory, 3 + viewer, "<q") for viewer in range(viewers)]
        self.set_pose(base_from_flange)
        self.set_mark(StepMark(0, -1, -1))
        self._firing.write(*base_from_flange[:3].ravel(), 0, -1, -1)
        for viewer in range(viewers):
            self.set_shown(viewer, 0)

    def set_pose(self, base_from_flange: FloatArray) -> None:
        """Where the flange is, ``(4, 4)``."""
        self._pose.write(*base_from_flange[:3].ravel())

    @property
    def base_from_flange(self) -> FloatArray:
        """``(4, 4)``, newest."""
        return _matrix(self._pose.read())

    def fire(self) -> None:
        """The striker's output was switched on, with the flange where it is now."""
        mark, number = self.mark, self.firing.number + 1
        self._firing.write(*self._pose.read(), number, mark.step, mark.sample)

    @property
    def firing(self) -> Firing:
        """The newest firing."""
        *pose, number, step, sample = self._firing.read()
        return Firing(int(number), _matrix(pose), int(step), int(sample))

    def set_mark(self, mark: StepMark) -> None:
        """Which step and sample the run is at."""
        self._mark.write(mark.number, mark.step, mark.sample)

    @property
    def mark(self) -> StepMark:
        """The newest mark."""
        number, step, sample = self._mark.read()
        return StepMark(int(number), int(step), int(sample))

    def set_shown(self, viewer: int, number: int) -> None:
        """A camera has sent a frame of mark ``number``."""
        self._shown[viewer].write(number)

    def shown(self, viewer: int) -> int:
        """The newest mark of which this camera has sent a frame."""
        return int(self._shown[viewer].read()[0])


def _matrix(rows: Sequence[float]) -> FloatArray:
    pose = np.eye(4)
    pose[:3] = np.reshape(rows, (3, 4))
    return pose
