"""The scene camera: a view of the bench, streamed as motion JPEG over HTTP."""

from drivers.mjpeg import MjpegStream
from harness.device import Health
from harness.reading import Channel, Reading


class SceneCamera:
    """A camera that looks at the bench; reads like a ``TactileCamera``.

    Args:
        url: of the stream, for example ``http://127.1.2.3:8081/?action=stream``.
        rows: pixels; frames of another size are refused.
        columns: pixels.
        name: of the instrument, as messages call it.
        serial: its serial number, as the station states it.
        nominal_rate: Hz, as the maker states it; the real rate is measured.
    """

    def __init__(
        self,
        url: str,
        rows: int,
        columns: int,
        name: str = "camera",
        serial: str = "",
        nominal_rate: float | None = None,
    ) -> None:
        self._serial = serial
        channel = Channel("camera.image", "count", (rows, columns, 3), "uint8", "camera", nominal_rate)
        self._stream = MjpegStream(name, url, channel)

    def open(self) -> None:
        """Connect and wait for the first frame.

        Raises:
            BenchFault: nothing answers, no frame comes, or frames have another size.
        """
        self._stream.open()

    def close(self) -> None:
        """Release the stream."""
        self._stream.close()

    def read(self, count: int, timeout: float) -> Reading:
        """The next ``count`` frames that arrive from now on.

        Returns:
            Channel ``camera.image``: ``(count, rows, columns, 3)`` uint8, RGB, with the JPEG bytes.

        Raises:
            BenchFault: after ``timeout`` s without them.
        """
        return self._stream.read(count, timeout)

    def health(self) -> Health:
        """Rate and drops since opening; the age of a frame on arrival cannot be known."""
        identity = f"scene camera {self._serial}".strip() + f" at {self._stream.url}"
        return Health(
            self._stream.name, identity, self._stream.rate, self._stream.drops, None, self._stream.detail
        )
