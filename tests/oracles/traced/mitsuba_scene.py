"""A surface, a camera and lights as Mitsuba is told of them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import NO_TEXTURE, Appearance

_TURNED = np.diag([-1.0, -1.0, 1.0, 1.0])
"""Mitsuba's camera has x to the left and y up."""

_NEAR, _FAR = 1e-4, 1e4
"""m."""


def surfaces_of(mitsuba: Any, appearance: Appearance) -> dict[str, Any]:
    """Meshes for a scene, one for each texture, matt on both sides.

    Args:
        mitsuba: the module, its variant set.
        appearance: of a surface.

    Raises:
        NotImplementedError: a texture under tints that are not one colour.
    """
    made = {}
    for texture in np.unique(appearance.texture_of):
        chosen = np.flatnonzero(appearance.texture_of == texture)
        made[f"surface_{texture}"] = _surface(mitsuba, appearance, chosen, int(texture))
    return made


def camera_of(mitsuba: Any, camera: Pinhole, samples: int) -> dict[str, Any]:
    """The sensor of a scene, with so many samples a pixel."""
    width = 2.0 * np.degrees(np.arctan(0.5 * camera.width / camera.focal_px))
    x, y = camera.centre_px
    return {
        "type": "perspective",
        "fov": float(width),
        "fov_axis": "x",
        "near_clip": _NEAR,
        "far_clip": _FAR,
        "principal_point_offset_x": 0.5 - x / camera.width,
        "principal_point_offset_y": 0.5 - y / camera.height,
        "to_world": mitsuba.ScalarTransform4f(camera.object_from_camera @ _TURNED),
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "pixel_format": "rgba",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent" if samples == 1 else "multijitter", "sample_count": samples},
    }


def lamps_of(lights: Sequence[DirectionalLight]) -> dict[str, Any]:
    """The emitters of a scene; a dark one where there is none, which Mitsuba insists on."""
    dark = DirectionalLight(np.array([0.0, 0.0, 1.0]), 0.0)
    return {
        f"lamp_{k}": {
            "type": "directional",
            "direction": (-light.direction).tolist(),
            "irradiance": {"type": "rgb", "value": [light.irradiance] * 3},
        }
        for k, light in enumerate(lights or (dark,))
    }


def _surface(mitsuba: Any, appearance: Appearance, chosen: IntArray, texture: int) -> Any:
    """One mesh, no corner shared: each has its own normal, place and tint."""
    count = len(chosen)
    colours: dict[str, Any]
    if texture == NO_TEXTURE:
        colours = {"type": "mesh_attribute", "name": "vertex_tint"}
    else:
        colours = _bitmap(mitsuba, appearance, chosen, texture)
    properties = mitsuba.Properties()
    matt = {"type": "twosided", "matt": {"type": "diffuse", "reflectance": colours}}
    properties["mesh_bsdf"] = mitsuba.load_dict(matt)
    mesh = mitsuba.Mesh(
        "surface", 3 * count, count, has_vertex_normals=True, has_vertex_texcoords=True, props=properties
    )
    if texture == NO_TEXTURE:
        mesh.add_attribute("vertex_tint", 3, _flat(appearance.tints[chosen]))
    told = mitsuba.traverse(mesh)
    told["vertex_positions"] = _flat(appearance.mesh.corners[chosen])
    told["vertex_normals"] = _flat(appearance.normals[chosen])
    # Mitsuba's v runs down the picture.
    told["vertex_texcoords"] = _flat(appearance.places[chosen] * [1.0, -1.0] + [0.0, 1.0])
    told["faces"] = np.arange(3 * count, dtype=np.uint32)
    told.update()
    return mesh


def _bitmap(mitsuba: Any, appearance: Appearance, chosen: IntArray, texture: int) -> dict[str, Any]:
    if not np.all(appearance.tints[chosen] == 1.0):
        raise NotImplementedError(
            "mitsuba_scene renders textures as they are, not under tints; make the tints 1"
        )
    picture = mitsuba.Bitmap(np.array(appearance.textures[texture]))
    return {"type": "bitmap", "bitmap": picture, "wrap_mode": "repeat", "filter_type": "bilinear"}


def _flat(values: FloatArray) -> Any:
    return np.ascontiguousarray(values, np.float32).ravel()
