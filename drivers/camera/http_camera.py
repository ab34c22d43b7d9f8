"""Cameras that stream motion JPEG over HTTP: the GelSight, filmed from behind, and the scene camera."""

from drivers.camera.mjpeg import MjpegStream
from harness.bench.device import Health
from harness.bench.reading import Channel, Reading
from harness.bench.sensor import TactileSensor


class HttpCamera:
    """One camera on its stream; a ``TactileCamera``. ``gelsight`` and ``scene_camera`` make them.

    Args:
        stream: that the camera's own computer serves.
        identity: make, and serial number as the station states it.
    """

    def __init__(self, stream: MjpegStream, identity: str) -> None:
        self._stream = stream
        self._identity = identity

    def open(self) -> None:
        """Connect and wait for the first frame.

        Raises:
            BenchFault: nothing answers, no frame comes, frames have another size or no colour, or all frames
                are one picture.
        """
        self._stream.open()

    def close(self) -> None:
        """Release the stream."""
        self._stream.close()

    def read(self, count: int, timeout: float) -> Reading:
        """The next ``count`` frames that arrive from now on.

        Returns:
            ``(count, rows, columns, 3)`` uint8, RGB, with the JPEG bytes.

        Raises:
            BenchFault: after ``timeout`` s without them, or where the stream is frozen.
        """
        return self._stream.read(count, timeout)

    def health(self) -> Health:
        """Rate and drops since opening, and a failure at present; how old frames arrive cannot be known."""
        stream = self._stream
        identity = f"{self._identity} at {stream.url}"
        return Health(
            stream.name, identity, stream.rate, stream.drops, None, stream.detail, failure=stream.failure
        )


def gelsight(
    url: str, sensor: TactileSensor, name: str = "gel", serial: str = "", nominal_rate: float | None = 25.0
) -> HttpCamera:
    """A GelSight R1.5 or any gel camera that streams motion JPEG; reads ``gel.image``.

    Args:
        url: of the stream, for example ``http://gsr15001.local:8080/?action=stream``.
        sensor: its make; frames of another size are refused.
        name: of the instrument, as messages call it.
        serial: its serial number, as the station states it.
        nominal_rate: Hz, as the maker states it; the real rate is measured.
    """
    shape = (sensor.rows, sensor.columns, 3)
    channel = Channel("gel.image", "count", shape, "uint8", "gel", nominal_rate)
    return HttpCamera(MjpegStream(name, url, channel, colour=True), f"{sensor.name} {serial}".strip())


def scene_camera(
    url: str,
    rows: int,
    columns: int,
    name: str = "camera",
    serial: str = "",
    nominal_rate: float | None = None,
) -> HttpCamera:
    """A camera that looks at the bench; reads ``camera.image``.

    Args:
        url: of the stream, for example ``http://127.1.2.3:8081/?action=stream``.
        rows: pixels; frames of another size are refused.
        columns: pixels.
        name: of the instrument, as messages call it.
        serial: its serial number, as the station states it.
        nominal_rate: Hz, as the maker states it; the real rate is measured.
    """
    channel = Channel("camera.image", "count", (rows, columns, 3), "uint8", "camera", nominal_rate)
    return HttpCamera(MjpegStream(name, url, channel), f"scene camera {serial}".strip())
