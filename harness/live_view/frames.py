"""Pictures of an object as a page asks for them: the same as ``touchstone object render vision`` draws."""

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest
from harness.objectfile.vision.render import ObjectVision
from harness.objectfile.vision.view import FIELD_OF_VIEW, camera_for, light_for
from harness.picture.image_file import png_bytes
from harness.picture.pinhole import DirectionalLight

Three = tuple[float, float, float]

_START = 256
"""Pixels along a side, where a page does not say."""


@dataclass(frozen=True)
class ViewRequest:
    """A picture that is asked for; lengths in m, object's frame. None is what ``camera_for`` chooses.

    Attributes:
        camera: where it is.
        look_at: what is in the middle.
        up: in the picture.
        light: towards the lamp; None for over the left shoulder.
        field_of_view: rad across the picture's width.
        width: pixels.
        height: pixels.
    """

    camera: Three | None = None
    look_at: Three | None = None
    up: Three | None = None
    light: Three | None = None
    field_of_view: float = FIELD_OF_VIEW
    width: int = _START
    height: int = _START


def _three(text: str) -> Three:
    x, y, z = (float(part) for part in text.split(","))
    return x, y, z


NAMES = tuple(field.name for field in fields(ViewRequest))
_VECTORS, _COUNTS = ("camera", "look_at", "up", "light"), ("width", "height")
_READ: Mapping[str, Callable[[str], Any]] = {
    **dict.fromkeys(_VECTORS, _three),
    **dict.fromkeys(_COUNTS, int),
    "field_of_view": float,
}
_MEANT = {
    **dict.fromkeys(_VECTORS, "three numbers with commas between them"),
    **dict.fromkeys(_COUNTS, "a whole number of pixels"),
    "field_of_view": "a number of radians",
}


@dataclass(frozen=True, eq=False)
class ViewFrame:
    """A picture for a page.

    Attributes:
        png: of it, before white.
        said: of how it was made: samples, rays, and seconds by stage.
    """

    png: bytes
    said: Mapping[str, Any]


def asked_from(query: Mapping[str, str]) -> ViewRequest:
    """What an address asks for.

    Args:
        query: text by name; what is left out is chosen.

    Raises:
        WrongUse: a name that means nothing, or text that is not what the name stands for.
    """
    read: dict[str, Any] = {}
    for name, text in query.items():
        if name not in _READ:
            raise WrongUse(f"no picture has a {name!r}; {nearest(name, NAMES)}")
        try:
            read[name] = _READ[name](text)
        except ValueError:
            raise WrongUse(f"{name}={text}: {_MEANT[name]} is wanted") from None
    return ViewRequest(**read)


class LiveFrames:
    """Pictures of one object, one at a time, for any number of threads that ask.

    Args:
        name: of the object.
        vision: its look.
    """

    def __init__(self, name: str, vision: ObjectVision) -> None:
        self.name = name
        self._vision = vision
        self._drawing = threading.Lock()

    def start(self) -> Mapping[str, Any]:
        """What a page begins with: name, and the camera and lamp that nobody chose."""
        camera = camera_for(self._vision.surface, _START, _START)
        return {
            "object": self.name,
            "networks": self._vision.entry.level,
            "camera": camera.eye.tolist(),
            "look_at": self._vision.surface.bounds.mean(axis=0).tolist(),
            "light": light_for(camera).direction.tolist(),
            "field_of_view": FIELD_OF_VIEW,
            "size": _START,
            "diagonal_m": self._vision.surface.diagonal,
        }

    def frame(self, asked: ViewRequest) -> ViewFrame:
        """Draw a picture.

        Raises:
            OutOfDomain: a camera within the object or without a direction, a light without one, or a picture
                larger than is drawn.
        """
        begun = time.perf_counter()
        camera = camera_for(
            self._vision.surface,
            asked.width,
            asked.height,
            asked.camera,
            asked.look_at,
            asked.up,
            asked.field_of_view,
        )
        light = light_for(camera) if asked.light is None else DirectionalLight(np.array(asked.light))
        with self._drawing:
            waited = time.perf_counter()
            found = self._vision.picture(camera, light)
            drawn = time.perf_counter()
        png = png_bytes(found.image.display())
        ended = time.perf_counter()
        return ViewFrame(
            png,
            {
                "samples": found.samples,
                "rays": found.rays,
                "seconds": {"wait": waited - begun, "render": drawn - waited, "encode": ended - drawn},
            },
        )
