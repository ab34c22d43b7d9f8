"""The lab's cameras: what each sees of the world, streamed from a process of its own."""

from collections.abc import Callable, Hashable

from harness.basics.arrays import ByteArray, FloatArray
from mocks.camera.gelsight_stream import MjpegServer
from mocks.lab_processes import ChildPipe
from mocks.shared_pose import SharedPose


class CameraView:
    """A camera's view of the world at the arm's present pose, step and sample."""

    def __init__(
        self, shared: SharedPose, viewer: int, look: Callable[[FloatArray, int, int], ByteArray]
    ) -> None:
        self._shared = shared
        self._viewer = viewer
        self._look = look
        self._pose = shared.base_from_flange
        self._mark = shared.mark

    def state(self) -> Hashable:
        """Pose, step and sample."""
        self._mark = self._shared.mark
        self._pose = self._shared.base_from_flange
        return self._pose.tobytes(), self._mark.step, self._mark.sample

    def picture(self) -> ByteArray:
        """What the world shows there."""
        return self._look(self._pose, self._mark.step, self._mark.sample)

    def sent(self) -> None:
        """Tell the lab which mark has been shown."""
        self._shared.set_shown(self._viewer, self._mark.number)


def stream(address: str, port: int, view: CameraView, rate: float, line: ChildPipe) -> None:
    """Serve a view as MJPEG until the lab is gone.

    Args:
        address: loopback.
        port: of the stream.
        view: what is to be seen.
        rate: frames a second.
        line: to the lab.
    """
    server = MjpegServer(address, port, view, rate)
    line.ready()

    def should_stop() -> bool:
        fault = line.fault()
        if fault is not None:
            server.fault.set(fault)
        return line.should_stop()

    server.serve(should_stop)
