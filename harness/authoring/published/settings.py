"""The settings (``cfg``) of a published look, each read with its limits; and directions for self-tests."""

from typing import Any

import numpy as np

from harness.authoring.published.layout import FileTable
from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused

_MOST_OCTAVES = 16


def sampling(settings: FileTable) -> dict[str, Any]:
    """How rays are sampled, by the keys of ``object.json``; ``DataRefused`` for what no look has."""
    if flag(settings, "llff_lindisp"):
        raise DataRefused(f"{settings.name} samples rays evenly in disparity, as no published object does")
    return {
        "near": settings.number("near"),
        "far": settings.number("far"),
        "samples": whole(settings, "num_samples_per_ray", 4096),
        "importance": whole(settings, "num_importance_samples_per_ray", 4096, least=0),
        "white": flag(settings, "blender_white_background"),
        "colour": "clipped" if flag(settings, "no_color_sigmoid") else "sigmoid",
    }


def refeed(settings: FileTable) -> int | None:
    """The layer behind which the input comes again; written as text where there is none."""
    if settings.values.get("refeed_position_index") in (None, "None"):
        return None
    return whole(settings, "refeed_position_index", 64, least=0)


def octaves_of(settings: FileTable, key: str) -> int:
    """The octaves of an encoding."""
    return whole(settings, key, _MOST_OCTAVES, least=0)


def whole(settings: FileTable, key: str, most: int, least: int = 1) -> int:
    """A whole number within limits; ``DataRefused`` for others."""
    number = settings.number(key)
    if number != round(number) or not least <= number <= most:
        raise DataRefused(f"{settings.name}/{key} is {number:g}, not a whole number from {least} to {most}")
    return int(number)


def sizes(settings: FileTable, key: str, most: int) -> tuple[int, int, int]:
    """Whole numbers along x, y and z, from 1; ``DataRefused`` for others."""
    x, y, z = settings.array(key, (3,)).tolist()
    if not all(size == round(size) and 1 <= size <= most for size in (x, y, z)):
        raise DataRefused(f"{settings.name}/{key} is {[x, y, z]}, not three whole numbers from 1 to {most}")
    return int(x), int(y), int(z)


def flag(settings: FileTable, key: str) -> bool:
    """True or false, which is what a missing one is."""
    value = settings.values.get(key, False)
    if not isinstance(value, bool | int):
        raise DataRefused(f"{settings.name}/{key} is {value!r}, where true or false belongs")
    return bool(value)


def unit_vectors(random: np.random.Generator, count: int) -> AnyArray:
    """``(count, 3)`` float32, in all directions: for self-tests."""
    drawn = random.normal(size=(count, 3))
    units: AnyArray = (drawn / np.linalg.norm(drawn, axis=1, keepdims=True)).astype(np.float32)
    return units
