"""What the networks of an object's look take and give: kinds, limits, tensors."""

from typing import Literal

from harness.objectfile.entries import Domain, Input, Tensor

Kind = Literal["osf", "osf-v"]
"""``osf`` is told what the paper's is; ``osf-v`` also the light's visibility and the surface's normal."""


EXTRAS = {"osf": 0, "osf-v": 4}
"""Further inputs: visibility of the light, then the normal's x, y, z."""


MOST_CELLS = 128
"""Along a side."""


Corner = tuple[float, float, float]


def box_tensors(
    networks: int, box: tuple[Corner, Corner], extras: int, block: int
) -> tuple[tuple[Input, ...], tuple[Tensor, ...]]:
    """The same, of so many networks.

    Args:
        networks: one or more.
        box: m, least and greatest corner of their grid.
        extras: further inputs, 0 or 4.
        block: samples of one network that are asked together.
    """
    low, high = box
    directions = Domain(low=(-1.0,) * 3 * block, high=(1.0,) * 3 * block)
    inputs = [
        graph_input("network", "int64", ("n", 1), "1", "which network, as counted in networks.first",
                    Domain(low=(0.0,), high=(networks - 1.0,))),
        graph_input("points", "float64", ("n", block, 3), "m",
                    "places in the network's cell, else moved to it",
                    Domain(low=low * block, high=high * block), "object"),
        graph_input("views", "float32", ("n", block, 3), "1", "unit, from the camera", directions, "object"),
        graph_input("light", "float32", ("n", 3), "1", "unit, towards the lamp",
                    Domain(low=(-1.0,) * 3, high=(1.0,) * 3), "object"),
    ]  # fmt: skip
    if extras:
        told = Domain(low=(0.0, -1.0, -1.0, -1.0) * block, high=(1.0,) * 4 * block)
        meaning = "whether the lamp is seen from the surface, and its unit normal there"
        inputs.append(graph_input("extras", "float32", ("n", block, extras), "1", meaning, told, "object"))
    density = Tensor(
        name="density", dtype="float32", shape=("n", block, 1), unit="1/m",
        meaning="of a ray's light, the share taken per metre where it is thin",
    )  # fmt: skip
    scattered = Tensor(
        name="scattered", dtype="float32", shape=("n", block, 3), unit="1",
        meaning="linear red, green, blue (sRGB primaries): radiance for a lamp of irradiance pi",
    )  # fmt: skip
    return tuple(inputs), (density, scattered)


def graph_input(
    name: str,
    dtype: str,
    shape: tuple[int | str, ...],
    unit: str,
    meaning: str,
    domain: Domain,
    frame: str = "",
) -> Input:
    """An input whose numbers are brought to the network's own range within the graph."""
    return Input.model_validate({
        "name": name, "dtype": dtype, "shape": shape, "unit": unit, "meaning": meaning,
        "frame": frame, "domain": domain, "normaliser": "in the graph",
    })  # fmt: skip
