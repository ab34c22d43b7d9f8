"""What a picture is to be like, and what it took."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from harness.basics.errors import WrongUse
from harness.picture.linear_image import LinearImage

VisionLevel = Literal["fused", "onnx", "one_sample"]
LEVELS: tuple[VisionLevel, ...] = ("fused", "onnx", "one_sample")

COVERS = (1, 3, 5, 7)
"""Sub-pixels along a pixel: odd, so that one is its centre."""


MOST_RAYS = 8
"""Along a pixel."""


@dataclass(frozen=True)
class RenderSettings:
    """What a picture is to be like; each is a knob of cost against error.

    Attributes:
        level: which way the networks are asked.
        step: voxels that a sample stands for at most.
        termination: a ray with less of its light left than this ends; 0 ends none.
        coverage: sub-pixels along a pixel, of the mesh's outline; 1 takes the networks' own outline, at the
            pixels' centres alone.
        lead: voxels before the mesh at which a ray begins; infinite for where the shell begins, which is
            also where it begins for coverage 1, whose rays know of no mesh. A finite lead is cheaper and not
            only a way to skip: networks are a little fatter than the mesh, so that it cuts an outline that
            lies before another part of the object as coverage cuts the outermost.
        rays: along a pixel, so that 2 are four of them. With one, the edge of a print or of a shadow within a
            pixel is on this side or on that.
        wave: samples of a ray that are asked for together; changes no picture, only its cost.
    """

    level: VisionLevel = "fused"
    step: float = 0.5
    termination: float = 0.03
    coverage: int = 3
    lead: float = float("inf")
    rays: int = 1
    wave: int = 3

    def __post_init__(self) -> None:
        if self.level not in LEVELS or self.coverage not in COVERS:
            raise WrongUse(
                f"level {self.level!r} with coverage {self.coverage}; levels are {', '.join(LEVELS)}, "
                f"coverages {', '.join(map(str, COVERS))}"
            )
        if not 1 <= self.rays <= MOST_RAYS:
            raise WrongUse(f"{self.rays} rays along a pixel; 1 to {MOST_RAYS}, so that 2 are four of them")
        if not self.lead >= 0.0:
            raise WrongUse(f"a lead of {self.lead} voxels; 0 or more, or infinite for the whole shell")
        if not (0.01 <= self.step <= 100.0 and 0.0 <= self.termination < 1.0 and 1 <= self.wave <= 1024):
            raise WrongUse(
                f"a step of {self.step} voxels, an end at {self.termination}, {self.wave} samples at once; "
                "0.01 to 100 voxels, 0 to below 1 and 1 to 1024 samples are possible"
            )

    @property
    def marches(self) -> bool:
        """Whether rays are followed through the shell."""
        return self.level != "one_sample"


@dataclass(frozen=True, eq=False)
class Rendered:
    """A picture and what it took.

    Attributes:
        image: linear light, coverage and depth.
        level: it was made at.
        samples: that networks were asked for.
        rays: that were followed.
        seconds: of each part, and ``render`` of all.
    """

    image: LinearImage
    level: VisionLevel
    samples: int
    rays: int
    seconds: Mapping[str, float] = field(default_factory=dict)
