"""Universal Robots' own collision meshes, one convex body a link, as the vertices alone.

The vertices shipped beside this module are those of the Universal_Robots_ROS2_Description
(BSD-3-Clause, see NOTICE), placed in the frames of the joints. To make them again from the
maker's files: ``python -m harness.twin.link_hulls FOLDER``, where FOLDER holds one folder of
STL files a model.
"""

import sys
from importlib import resources
from pathlib import Path
from typing import Final

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.basics.geometry import apply, rotation_from_vector, transform
from harness.bench.kinematics import ARM_TABLES, LINKS, arm_table

_FILES: Final = ("base", "shoulder", "upperarm", "forearm", "wrist1", "wrist2", "wrist3")

_OFFSETS: Final = {
    "ur3e": (0.0, 0.0, 0.120, 0.027, -0.104, -0.08535, -0.0921),
    "ur5e": (0.0, 0.0, 0.138, 0.007, -0.127, -0.0997, -0.0989),
    "ur10e": (0.0, 0.0, 0.1762, 0.0393, -0.135, -0.12, -0.1168),
}
"""m along the joint's axis at which each mesh sits; measured by the maker from the model."""


def link_hulls(model: str) -> dict[str, FloatArray]:
    """``(n, 3)`` m, the vertices of each link's convex body in the frame of its joint.

    A joint's frame has z along the joint's axis, and turns with it; the base's is the base.

    Raises:
        WrongUse: the model is not known.
    """
    arm_table(model)
    with resources.files("harness.twin").joinpath("data", f"{model}.npz").open("rb") as file:
        stored = np.load(file, allow_pickle=False)
        return {link: stored[link].astype(np.float64) for link in LINKS}


def placed(model: str, folder: Path) -> dict[str, FloatArray]:
    """The same, from the maker's STL files.

    Raises:
        DataRefused: a file is not a binary STL.
    """
    hulls = {}
    for link, name, offset in zip(LINKS, _FILES, _OFFSETS[model], strict=True):
        about_x = rotation_from_vector(np.array([np.pi / 2, 0.0, 0.0]))
        turns = {
            "base": rotation_from_vector(np.array([0.0, 0.0, np.pi])),
            "shoulder": rotation_from_vector(np.array([0.0, 0.0, np.pi])),
            "upper_arm": rotation_from_vector(np.array([0.0, 0.0, -np.pi / 2])) @ about_x,
            "forearm": rotation_from_vector(np.array([0.0, 0.0, -np.pi / 2])) @ about_x,
            "wrist_1": about_x,
            "wrist_2": np.eye(3),
            "wrist_3": about_x,
        }
        link_from_file = transform(turns[link], np.array([0.0, 0.0, offset]))
        path = folder / f"{name}.stl"
        raw = path.read_bytes()
        count = int.from_bytes(raw[80:84], "little")
        if len(raw) != 84 + 50 * count:
            raise DataRefused(f"{path.name}: {len(raw)} bytes are not a binary STL of {count} triangles")
        triangles = np.frombuffer(raw, np.uint8, offset=84).reshape(count, 50)
        corners = triangles[:, 12:48].copy().view("<f4").reshape(-1, 3)
        hulls[link] = apply(link_from_file, np.unique(corners, axis=0).astype(np.float64))
    return hulls


def _pack(folder: Path) -> None:
    target = Path(__file__).parent / "data"
    target.mkdir(exist_ok=True)
    for model in ARM_TABLES:
        hulls = {link: hull.astype(np.float32) for link, hull in placed(model, folder / model).items()}
        np.savez_compressed(target / f"{model}.npz", allow_pickle=False, **hulls)


if __name__ == "__main__":
    _pack(Path(sys.argv[1]))
