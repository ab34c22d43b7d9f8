"""ObjectFolder 1.0's touch: a network from a place and a pixel to the colour that the sensor's camera sees.

One picture a place, pressed along the normal: it knows no tilt, no depth and no gel. 1.0 drew its pictures
as a DIGIT's; here they are the sensor's of all rows of the table.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.runtime import Network
from harness.objectfile.vision_tensors import graph_input

INPUTS = 5
CHANNELS = 3
COLOURS_FILE = "touch_colours.onnx"


@dataclass(frozen=True, eq=False)
class ColourNetwork:
    """The trained network, ready to be queried.

    Attributes:
        network: five numbers of a pixel to a colour of -1 .. 1.
        low: ``(3,)`` m, of the box in which places are 0 to 1.
        high: ``(3,)`` m.
        shape: rows and columns of a picture.
    """

    network: Network
    low: FloatArray
    high: FloatArray
    shape: tuple[int, int]

    def picture(self, point: FloatArray) -> ByteArray:
        """``(rows, columns, 3)`` of the press at a ``(3,)`` place in m."""
        place = np.broadcast_to(
            (point - self.low) / (self.high - self.low), (self.shape[0] * self.shape[1], 3)
        )
        rows = np.concatenate([place, pixel_places(self.shape)], axis=1)
        found = self.network({"place": rows})["colours"]
        grey = np.clip(np.rint(127.5 * (found + 1.0)), 0.0, 255.0)
        return grey.astype(np.uint8).reshape(*self.shape, CHANNELS)


def pixel_places(shape: tuple[int, int]) -> FloatArray:
    """``(rows * columns, 2)``: where a pixel is, -1 .. 1, row by row."""
    rows, columns = (np.linspace(-1.0, 1.0, size) for size in shape)
    return np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)


def colours_pair() -> tuple[Input, Tensor]:
    """What the network takes and gives."""
    box = Domain(low=(0.0, 0.0, 0.0, -1.0, -1.0), high=(1.0,) * INPUTS)
    meaning = "x y z, 0 to 1; row and column, -1 to 1"
    place = graph_input("place", "float64", ("n", INPUTS), "1", meaning, box)
    colours = Tensor(
        name="colours",
        dtype="float32",
        shape=("n", CHANNELS),
        unit="1",
        meaning="red green blue, -1 to 1",
    )
    return place, colours
