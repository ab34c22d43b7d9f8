"""A picture as light: what every level of vision gives, and what they are compared by."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, block_means, read_only
from harness.basics.errors import OutOfDomain
from harness.picture.srgb import bytes_from_linear


@dataclass(frozen=True, eq=False)
class LinearImage:
    """The object before nothing: what it shines, and how much of each pixel it covers.

    Colours are multiplied by coverage, so that pictures are laid over each other by adding:
    ``colour + (1 - alpha) * behind``.
    """

    colour: FloatArray
    """``(rows, columns, 3)`` linear red, green, blue (sRGB's), mean over the whole pixel, zero or more; under
    light of irradiance pi a white surface that faces it has 1."""
    alpha: FloatArray  #: ``(rows, columns)`` the share of each pixel that the object covers, 0 to 1.
    depth: FloatArray
    """``(rows, columns)`` m, z in the camera's frame, mean over what is covered; +inf where nothing is."""

    def __post_init__(self) -> None:
        shape = self.alpha.shape
        if len(shape) != 2 or self.colour.shape != (*shape, 3) or self.depth.shape != shape:
            raise OutOfDomain(
                f"a picture has colours {self.colour.shape}, alpha {shape} and depth {self.depth.shape}; "
                "give (rows, columns, 3), (rows, columns) and (rows, columns)"
            )
        for each in (self.colour, self.alpha, self.depth):
            read_only(each)

    def over(self, behind: float | FloatArray) -> FloatArray:
        """``(rows, columns, 3)`` linear light of the picture before something.

        Args:
            behind: linear light, one number, ``(3,)``, or ``(rows, columns, 3)``.
        """
        seen: FloatArray = self.colour + (1.0 - self.alpha)[..., None] * behind
        return seen

    def display(self, behind: float | FloatArray = 1.0, exposure: float = 1.0) -> ByteArray:
        """``(rows, columns, 3)`` grey levels of 0 to 255 in sRGB, before something.

        Args:
            behind: as in ``over``.
            exposure: factor on the object's light, zero or more; not on what is behind.

        Raises:
            OutOfDomain: an exposure below zero, or none.
        """
        if not (np.isfinite(exposure) and exposure >= 0.0):
            raise OutOfDomain(f"an exposure of {exposure!r} was asked for; give zero or more")
        return bytes_from_linear(exposure * self.colour + (1.0 - self.alpha)[..., None] * behind)


def binned(image: LinearImage, by: int) -> LinearImage:
    """Average ``by`` x ``by`` pixels to one; ``OutOfDomain`` if a side is no multiple of ``by``."""
    rows, columns = image.alpha.shape
    if by < 1 or rows % by or columns % by:
        raise OutOfDomain(f"a picture of {rows} x {columns} pixels is no whole number of {by} x {by}")
    alpha = block_means(image.alpha, by)
    # What is not covered has no depth, and none of the weight.
    seen = block_means(image.alpha * np.where(image.alpha > 0.0, image.depth, 0.0), by)
    depth = np.divide(seen, alpha, out=np.full_like(alpha, np.inf), where=alpha > 0.0)
    colour = block_means(image.colour, by)
    return LinearImage(colour, alpha, depth)
