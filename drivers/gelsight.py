"""The GelSight: a gel filmed from behind, streamed as motion JPEG by the sensor's own computer."""

from drivers.mjpeg import MjpegStream
from harness.device import Health
from harness.reading import Channel, Reading
from harness.sensor import TactileSensor


class GelSight:
    """A GelSight R1.5 or any gel camera that streams motion JPEG; a ``TactileCamera``.

    Args:
        url: of the stream, for example ``http://gsr15001.local:8080/?action=stream``.
        sensor: its make; frames of another size are refused.
        name: of the instrument, as messages call it.
        serial: its serial number, as the station states it.
        nominal_rate: Hz, as the maker states it; the real rate is measured.
    """

    def __init__(
        self,
        url: str,
        sensor: TactileSensor,
        name: str = "gel",
        serial: str = "",
        nominal_rate: float | None = 25.0,
    ) -> None:
        self.sensor = sensor
        self._serial = serial
        shape = (sensor.rows, sensor.columns, 3)
        channel = Channel("gel.image", "count", shape, "uint8", "gel", nominal_rate)
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
            Channel ``gel.image``: ``(count, rows, columns, 3)`` uint8, RGB, with the JPEG bytes.

        Raises:
            BenchFault: after ``timeout`` s without them.
        """
        return self._stream.read(count, timeout)

    def health(self) -> Health:
        """Rate and drops since opening; the age of a frame on arrival cannot be known."""
        identity = f"{self.sensor.name} {self._serial}".strip() + f" at {self._stream.url}"
        return Health(
            self._stream.name, identity, self._stream.rate, self._stream.drops, None, self._stream.detail
        )
