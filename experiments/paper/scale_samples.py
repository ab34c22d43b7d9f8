"""Samples that the paper's networks learn from: pictures, single strikes and imprints of the same shapes."""

from collections.abc import Callable

import numpy as np

from experiments.paper.scale_networks import FIELD, SIDE, sequence_of, spectrogram_of
from experiments.scale_estimation.unseen.training.contact_samples import TouchableShape, imprint_sample
from experiments.scale_estimation.unseen.training.outlines import PLACE, PUT, drawn_camera
from experiments.scale_estimation.unseen.training.samples import (
    RATE,
    SampleRow,
    draw_size,
    ringing_of,
    shape_of,
    strike_responses,
)
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.geometry import apply, inverse, transform
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.picture.srgb import linear_from_srgb, srgb_from_linear
from harness.sim.light.appearance import NO_TEXTURE, Appearance, smooth_normals
from harness.sim.light.direct_image import LitObject

_STREAMS = {"picture": 11, "spectrogram": 12, "imprints": 13}
"""Number each sense's draws apart from one another and from those of the networks that ship."""

_RAYS = 2
"""Along each side of a pixel."""

_BRIGHTNESS = (0.4, 1.1)
"""Of the lamp and of the rest of the room's light: white that faces the light has 1."""

_FILL = (0.05, 0.4)

_SLANT = 1.0
"""Rad, deviation of the lamp from the line of sight."""

_COLOUR = (0.3, 0.95)
"""Of the albedo in sRGB, 1 for white."""


def pictures(seed: int, count: int, number: int) -> list[SampleRow]:
    """So many crops of one shape: sizes, places, cameras, lamps and albedos drawn anew for each."""
    mesh = shape_of(number, seed).surface
    # A shape one long that reflects all light; matt, so that its colour is a factor.
    faces = len(mesh.faces)
    tints, places = np.ones((faces, 3, 3)), np.zeros((faces, 3, 2))
    textures = np.full(faces, NO_TEXTURE)
    lit = LitObject(Appearance(mesh, smooth_normals(mesh), tints, places, textures))
    random = np.random.default_rng((seed, number, _STREAMS["picture"]))
    rows: list[SampleRow] = []
    for _ in range(count):
        size = draw_size(random)
        rows.append(({"crop": _crop(lit, mesh, size, random)}, size))
    return rows


def single_strikes(seed: int, count: int, number: int) -> list[SampleRow]:
    """The spectrograms of strikes of so many draws of one shape; none where its modes cannot be solved."""
    shape, rows = ringing_of(number, seed), list[SampleRow]()
    if shape is None:
        return rows
    random = np.random.default_rng((seed, number, _STREAMS["spectrogram"]))
    for _ in range(count):
        size, material = draw_size(random), str(random.choice(list(MATERIALS)))
        responses, band = strike_responses(shape, size, material, random)
        for response in responses:
            try:
                rows.append(({"spectrogram": spectrogram_of(response, RATE, band)}, size))
            except FitRefused:  # so is a strike at a bench that excites no mode
                continue
    return rows


def imprint_sequences(seed: int, count: int, number: int) -> list[SampleRow]:
    """So many sequences of imprints of one shape; those whose presses met nothing are left out."""
    shape = TouchableShape.of(shape_of(number, seed))
    random, rows = np.random.default_rng((seed, number, _STREAMS["imprints"])), []
    for _ in range(count):
        size = draw_size(random)
        found = imprint_sample(shape, size, random)
        if found:
            rows.append((dict(zip(("imprints", "last"), sequence_of(found), strict=True)), size))
    return rows


PAPER_MAKERS: dict[str, Callable[[int, int, int], list[SampleRow]]] = {
    "picture": pictures,
    "spectrogram": single_strikes,
    "imprints": imprint_sequences,
}


def _crop(lit: LitObject, mesh: Mesh, size: float, random: np.random.Generator) -> FloatArray:
    """``(3, SIDE, SIDE)`` as ``crop_of`` makes them, drawn at that size."""
    yaw = random.uniform(0.0, 2.0 * np.pi)
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    base_from_object = transform(turn, PLACE + np.append(PUT * random.standard_normal(2), 0.0))
    camera = crop_camera(mesh, size, base_from_object, drawn_camera(random))
    # A lamp about the line of sight, and weaker light along it and from above.
    back = -camera.forward
    slant = np.tan(min(abs(_SLANT * random.standard_normal()), 1.4))
    across = np.cross(back, random.standard_normal(3))
    aside = back + slant * (across / np.linalg.norm(across))
    strengths = np.pi * np.array([random.uniform(*_BRIGHTNESS), *random.uniform(*_FILL, 2)])
    lamps = [
        DirectionalLight(direction, float(strength))
        for direction, strength in zip((aside, back, np.array([0.0, 0.0, 1.0])), strengths, strict=True)
    ]
    image = lit.render(camera, lamps, _RAYS, shadow=bool(random.random() < 0.5)).image
    grey = random.uniform(*_COLOUR)  # most colours are pale
    albedo = linear_from_srgb(np.clip(grey + 0.12 * random.standard_normal(3), 0.05, 1.0))
    covered = np.maximum(image.alpha, 1e-9)[..., None]
    shades = srgb_from_linear(np.clip(image.colour * albedo / covered, 0.0, 1.0))
    return np.asarray((shades * image.alpha[..., None]).transpose(2, 0, 1))


def crop_camera(
    mesh: Mesh, size: float, base_from_object: FloatArray, base_from_camera: FloatArray
) -> Pinhole:
    """Return a camera of the bench, cropped to the object, in the frame of its shape of unit length."""
    object_from_camera = inverse(base_from_object) @ base_from_camera
    object_from_camera[:3, 3] /= size
    corners = apply(inverse(object_from_camera), mesh.vertices)
    focal = SIDE / FIELD
    seen = focal * corners[:, :2] / corners[:, 2:]
    x, y = 0.5 * (SIDE - seen.min(axis=0) - seen.max(axis=0))
    return Pinhole(SIDE, SIDE, focal, (float(x), float(y)), object_from_camera)
