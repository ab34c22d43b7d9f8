"""The printed dots of a gel and how they move under a contact. Not built yet."""

from harness.arrays import FloatArray
from harness.sensor import TactileSensor


def move_markers(indentation: FloatArray, sensor: TactileSensor) -> FloatArray:
    """Where the gel's dots are, ``(n, markers, 2)`` metres, under ``(n, rows, columns)`` metres of press.

    Raises:
        NotImplementedError: always; no sensor that ships has markers.
    """
    raise NotImplementedError(
        f"move_markers: the dots of {sensor.name} are not simulated yet ({len(indentation)} contacts asked)"
    )
