"""The query files that a command is given, and the files that it writes."""

from dataclasses import dataclass, field
from pathlib import Path

AUDIO, TOUCH, VISION = "audio", "touch", "vision"


@dataclass(frozen=True)
class QueryFiles:
    """The query files that were given, and how they are answered.

    Attributes:
        vision: cameras and lights.
        audio_vertices: in metres.
        audio_forces: a row for each vertex.
        touch_vertices: in metres.
        touch_gelinfo: tilt, azimuth and depth, a row for each vertex; None for 1.0, which has none.
        calibration: folder of the gel's colours; None for maps alone.
        size: pixels a side of pictures.
        seconds: of sounds.
        rate: samples per second.
        metres_per_unit: of the vision frame, for an object built from its mesh; None for an imported one.
        compat: whether everything is as the published programs do it.
    """

    vision: Path | None
    audio_vertices: Path | None
    audio_forces: Path | None
    touch_vertices: Path | None
    touch_gelinfo: Path | None
    calibration: Path | None
    size: int
    seconds: float
    rate: float
    metres_per_unit: float | None
    compat: bool


@dataclass(eq=False)
class AnsweredQueries:
    """What was written.

    Attributes:
        files: by sense, in the order of the queries.
        full_scale: of the sounds, in the sound's unit; None for each its own.
        notes: what the operator should know.
        seconds: on the clock, by sense.
    """

    files: dict[str, list[Path]] = field(default_factory=dict)
    full_scale: float | None = None
    notes: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
