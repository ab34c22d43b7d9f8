"""The objects that tables and cost curves are measured on: our own, and real meshes where they are."""

import os
from collections.abc import Mapping
from pathlib import Path

from harness.basics.mesh import Mesh
from harness.basics.store import default_folder, digest
from harness.bench.scene import SceneFile, scene_from_options
from harness.objects.household import MATERIALS

REAL = {
    "025_mug": ("meshes/ycb_isaac/025_mug/textured.obj", "cm", "ceramic"),
    "wineglass": ("meshes/contactdb_objects/wineglass.stl", "m", "glass"),
    "teapot": ("meshes/contactdb_objects/teapot.stl", "m", "ceramic"),
}
"""Real meshes: file under the data folder, units, material."""


def find_data_folder() -> Path:
    """Return the folder of public data, which may be absent.

    TOUCHSTONE_DATA names it; otherwise it is ``shared/data`` beside the checkout if that exists, else
    ``data`` in the user's cache directory.
    """
    named = os.environ.get("TOUCHSTONE_DATA")
    beside = Path(__file__).parents[3] / "shared" / "data"
    return Path(named) if named else beside if beside.is_dir() else default_folder() / "data"


def objects(data: Path | None, real: Mapping[str, tuple[str, str, str]] = REAL) -> dict[str, SceneFile]:
    """Return scenes by the object's name: the built-in ones, and the real ones whose mesh file is present.

    Args:
        data: the data folder; None if it is absent.
        real: paths and materials of real meshes, as in ``REAL``.
    """
    scenes = {name: scene_from_options(f"builtin:{name}") for name in MATERIALS}
    for name, (file, units, material) in real.items():
        if data is not None and (data / file).is_file():
            scenes[name] = scene_from_options(str(data / file), material, units)
    return scenes


def object_key(name: str, mesh: Mesh) -> str:
    """A name that two different objects do not share: the seconds of an object's runs are kept under it."""
    return f"{name}-{digest([mesh.vertices, mesh.faces])[:8]}"
