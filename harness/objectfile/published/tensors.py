"""What the graphs of imported networks take and give."""

import math

from harness.basics.arrays import FloatArray
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.vision_tensors import graph_input

Pair = tuple[Input, Tensor]

TILT = math.radians(15.0)
"""rad: the greatest tilt of a press; with the depths and distances below it is in the published program
(``OF_render.py``) and not in its files."""

PRESSED = (0.5e-3, 2.0e-3)
"""m: least and greatest depth of a press."""

SEEN = (33.9e-3, 40.0e-3)
"""m from camera to gel: what the network's 0 and 1 stand for."""

DEPTH_PIXELS = (120, 160)
"""Rows and columns of a map of 2.0."""


def gains_tensors(modes: int, low: FloatArray, high: FloatArray) -> Pair:
    """Points in metres to gains of so many modes."""
    box = Domain(low=tuple(low.tolist()), high=tuple(high.tolist()))
    points = graph_input("points", "float64", ("n", 3), "m", "where the object is struck", box, "mesh")
    gains = Tensor(
        name="gains", dtype="float32", shape=("n", modes, 3), unit="not stated by the file", frame="mesh",
        meaning="gain of each mode for a unit force along x, y, z",
    )  # fmt: skip
    return points, gains


def depth_tensors(low: FloatArray, high: FloatArray) -> Pair:
    """Nine numbers of a pixel to the distance of the gel there."""
    rows, columns = DEPTH_PIXELS
    box = Domain(
        low=(*low.tolist(), 0.0, -1.0, -1.0, PRESSED[0], 0.0, 0.0),
        high=(*high.tolist(), TILT, 1.0, 1.0, PRESSED[1], rows - 1.0, columns - 1.0),
    )
    meaning = "x y z, m; tilt, rad; cosine and sine of its azimuth; depth of the press, m; row; column"
    pixel = graph_input("pixel", "float64", ("n", 9), "m, rad, 1 and pixels", meaning, box, "mesh")
    depth = Tensor(
        name="depth",
        dtype="float32",
        shape=("n", 1),
        unit="m",
        meaning="from the gel's camera to its surface",
    )
    return pixel, depth


def spectrum_tensors() -> Pair:
    """Normalised place, frequency and time to a value of the short-time spectrum."""
    box = Domain(low=(0.0,) * 5, high=(1.0,) * 5)
    place = graph_input(
        "place", "float64", ("n", 5), "1", "x y z of a voxel, frequency, time: 0 to 1", box, "mesh"
    )
    spectrum = Tensor(
        name="spectrum", dtype="float32", shape=("n", 2, 3), unit="not stated by the file", frame="mesh",
        meaning="real and imaginary part, for a unit force along x, y, z",
    )  # fmt: skip
    return place, spectrum


def colours_tensors(most: float) -> Pair:
    """Normalised place and pixel to colour; ``most`` is the greatest normalised coordinate."""
    box = Domain(low=(-1.0,) * 5, high=(most, most, most, 1.0, 1.0))
    place = graph_input("place", "float64", ("n", 5), "1", "x y z; row and column, -1 to 1", box, "mesh")
    colours = Tensor(
        name="colours", dtype="float32", shape=("n", 3), unit="1", meaning="red green blue, -1 to 1"
    )
    return place, colours


def osf_tensors(reach: float) -> tuple[tuple[Input, ...], tuple[Tensor, ...]]:
    """A point, a view and a light to raw colour and density; points lie within ``reach`` of the origin."""
    within = Domain(low=(-reach,) * 3, high=(reach,) * 3)
    inputs = (
        graph_input("points", "float64", ("n", 3), "1", "where", within, "vision"),
        _direction("views", ("n", 3), "unit, from the camera", 3),
        _direction("light", ("n", 3), "as trained: unit, the light's direction", 3),
    )  # fmt: skip
    return inputs, _raw(("n",))


def cell_tensors(
    networks: int, block: int, low: FloatArray, high: FloatArray
) -> tuple[tuple[Input, ...], tuple[Tensor, ...]]:
    """The same, of blocks of samples of one network each."""
    box = Domain(low=tuple(low.tolist()) * block, high=tuple(high.tolist()) * block)
    which = Domain(low=(0.0,), high=(networks - 1.0,))
    inputs = (
        graph_input("network", "int64", ("n", 1), "1", "which network", which),
        graph_input("points", "float64", ("n", block, 3), "1", "where, in the network's cell", box, "vision"),
        _direction("views", ("n", block, 3), "unit, from the camera", 3 * block),
        _direction("light", ("n", 3), "as trained: unit, the light's direction", 3),
    )
    return inputs, _raw(("n", block))


def _raw(rows: tuple[int | str, ...]) -> tuple[Tensor, ...]:
    meanings = {"colour_raw": (3, "red green blue before the sigmoid"),
                "density_raw": (1, "density before it is cut off at zero")}  # fmt: skip
    return tuple(
        Tensor.model_validate(
            {"name": name, "dtype": "float32", "shape": (*rows, size), "unit": "1", "meaning": meaning}
        )
        for name, (size, meaning) in meanings.items()
    )


def _direction(name: str, shape: tuple[int | str, ...], meaning: str, numbers: int) -> Input:
    return graph_input(
        name, "float32", shape, "1", meaning, Domain(low=(-1.0,) * numbers, high=(1.0,) * numbers), "vision"
    )
