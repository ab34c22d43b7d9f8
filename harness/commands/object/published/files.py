"""The query files that a command is given, and the files that it writes."""

from dataclasses import dataclass, field
from pathlib import Path

AUDIO, TOUCH, VISION = "audio", "touch", "vision"


@dataclass(frozen=True)
class QueryFiles:
    """The query files that were given, and how they are answered."""

    vision: Path | None  #: cameras and lights.
    audio_vertices: Path | None  #: in metres.
    audio_forces: Path | None  #: a row for each vertex.
    touch_vertices: Path | None  #: in metres.
    touch_gelinfo: Path | None
    """tilt, azimuth and depth, a row for each vertex; None for 1.0, which has none."""
    calibration: Path | None  #: folder of the gel's colours; None for maps alone.
    size: int  #: pixels a side of pictures.
    seconds: float  #: of sounds.
    rate: float  #: samples per second.
    metres_per_unit: float | None
    """of the vision frame, for an object built from its mesh; None for an imported one."""
    compat: bool  #: whether everything is as the published programs do it.


@dataclass(eq=False)
class AnsweredQueries:
    """What was written."""

    files: dict[str, list[Path]] = field(default_factory=dict)  #: by sense, in the order of the queries.
    full_scale: float | None = None  #: of the sounds, in the sound's unit; None for each its own.
    notes: list[str] = field(default_factory=list)  #: what the operator should know.
    seconds: dict[str, float] = field(default_factory=dict)  #: on the clock, by sense.
