"""A shape reconstruction's answer as JSON values, human-readable lines, and PLY, OBJ, GLB and NPZ files."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.shape_reconstruction.answer import SENSES, ScoredShape, ShapeAnswer, base_from_stand
from experiments.shape_reconstruction.fits import SEEN, TOUCHED, ShapeEstimate
from experiments.shape_reconstruction.methods import METHOD
from experiments.shape_reconstruction.metric import published_chamfer, shape_error
from experiments.shape_reconstruction.section import ShapeRun
from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import DataRefused, FitRefused
from harness.basics.geometry import apply, inverse, rotation_about, transform
from harness.basics.mesh import Mesh
from harness.basics.whole_file import write_bytes_whole
from harness.experiment.truth import Truth
from harness.recording.run_folder import RunFiles
from harness.sim.solid.surface_samples import random_points

ERRORS = ("chamfer_m", "chamfer_points_m", "accuracy_m", "completeness_m", "f_score")
"""Of an estimate against the truth of a mocked run."""

_BY = {"vision": "by the picture alone", "touch": "by touch alone", "fused": "by all readings"}
"""Of estimates, for people."""

_NOT_ASKED = "the scene does not ask for it"


def true_surface(run: RunFiles, truth: Truth | None) -> Mesh | None:
    """Transform the true object of a mocked run to the frame ``stand``; None if its surface is unknown."""
    if truth is None or truth.surface is None:
        return None
    return Mesh(apply(inverse(base_from_stand(run)), truth.surface.vertices), truth.surface.faces)


def result_of(scored: ScoredShape) -> dict[str, Any]:
    """Return the answer as JSON values; write its surfaces into the folder of the result."""
    answer: ShapeAnswer = scored.found
    truth = true_surface(scored.run, scored.truth)
    estimates = {}
    for sense in SENSES:
        one = answer.by_sense.get(sense, _NOT_ASKED)
        if isinstance(one, ShapeEstimate):
            seconds = answer.seconds[sense]
            errors: dict[str, Any] = dict.fromkeys(ERRORS)
            if truth is not None:
                error = shape_error(one.mesh, truth)
                points = published_chamfer(one.mesh, truth)
                values = (error.chamfer, points, error.accuracy, error.completeness, error.f_score)
                errors = dict(zip(ERRORS, values, strict=True))
            estimates[sense] = {
                **errors,
                "deviation_m": float(one.deviation.mean()),
                "extents_m": np.ptp(one.mesh.bounds, axis=0).tolist(),
                "touched": float((one.known_by == TOUCHED).mean()),
                "seen": float((one.known_by == SEEN).mean()),
                "not_bounded": list(one.not_bounded),
                "doubtful_m": {str(index): float(off) for index, off in one.doubtful.items()},
                "flags": list(one.flags),
                "details": one.details(),
                "mesh": f"{stem_of(sense)}.ply",
                "seconds": seconds,
                "refused": None,
            }
            if scored.folder is not None:
                scored.folder.mkdir(parents=True, exist_ok=True)
                write_estimate(one, scored.folder, stem_of(sense))
        else:
            names = (*ERRORS, "deviation_m", "extents_m", "touched", "seen", "not_bounded", "doubtful_m")
            nothing: dict[str, Any] = dict.fromkeys((*names, "flags", "details", "mesh"))
            estimates[sense] = {**nothing, "seconds": answer.seconds.get(sense), "refused": str(one)}
    fused = estimates["fused"]
    return {
        "error_m": fused["chamfer_m"],
        "deviation_m": fused["deviation_m"],
        "extents_m": fused["extents_m"],
        "method": str(scored.accuracy[METHOD.name]),
        "choose": scored.run.scene.section(ShapeRun).choose,
        "presses": len(answer.evidence.touches),
        "contacts": len(answer.evidence.contacts),
        "repeated": answer.evidence.repeated,
        "ended_by_housing": len(answer.evidence.ended_by_housing),
        "estimates": estimates,
        "seconds": sum(answer.seconds[sense] for sense in answer.by_sense),
        "warnings": _warnings(scored, answer),
    }


def stem_of(sense: str) -> str:
    """Name, without its ending, of a surface's files beside ``result.json``."""
    return f"shape-{sense}"


def _warnings(scored: ScoredShape, answer: ShapeAnswer) -> list[str]:
    said = [f"{sense}: {one}" for sense, one in answer.by_sense.items() if isinstance(one, FitRefused)]
    fused, left_out = answer.fused, scored.answering.left_out
    said += [*scored.answering.readings.refused_pictures, *(f"shape: {flag}" for flag in fused.flags)]
    if fused.not_bounded:
        said.append(f"nothing bounds the object along {', '.join(fused.not_bounded)}: press there, or look")
    said += [
        f"step {index} is {1e3 * off:.1f} mm off what all others say: it may have slipped"
        for index, off in fused.doubtful.items()
    ]
    if answer.evidence.repeated:
        said.append(
            f"{answer.evidence.repeated} presses repeat an earlier one within the bench's errors; each place "
            "counts once"
        )
    if left_out:
        said.append(f"{len(left_out)} presses were left out; of the last: {left_out[-1]}")
    if scored.run.scene.section(ShapeRun).choose == "planned":
        said.append(
            "presses were planned on the object's own mesh: a benchmark, no reconstruction of an unknown"
        )
    return said


def lines_of(result: Mapping[str, Any]) -> list[str]:
    """A line a sense, the fused one last."""
    mock = "mock bench, " if result["mock"] else ""
    said = []
    for sense, one in result["estimates"].items():
        if one["extents_m"] is None:
            said.append(f"{mock}{_BY[sense]}: no answer: {one['refused']}")
            continue
        sides = " x ".join(f"{1e2 * side:.1f}" for side in one["extents_m"])
        open_sides = f", not bounded along {', '.join(one['not_bounded'])}" if one["not_bounded"] else ""
        error = (
            "" if one["chamfer_m"] is None else f"; {1e3 * one['chamfer_m']:.1f} mm off the truth on average"
        )
        stated = f"known to {1e3 * one['deviation_m']:.1f} mm on average"
        cost = f"{one['seconds']:.1f} s; {one['mesh']}"
        said.append(f"{mock}{_BY[sense]}: {sides} cm{open_sides}, {stated}{error}; {cost}")
    return said


POINTS = 10_000
"""Of the file of points, even by area."""

PALE_AT = 10.0e-3
"""M of deviation, at and beyond which a place has the colour of the least known."""

_COLOURS = np.array([[27, 63, 174], [90, 170, 190], [246, 217, 168], [220, 61, 42]], dtype=np.float64)
"""From well known to hardly known, at even steps of deviation."""

_PLY_HEADER = (
    "ply\nformat binary_little_endian 1.0\n"
    "comment metres; z up, z = 0 at the support; deviation is one standard deviation in metres\n"
    "comment known_by: 0 supposed, 1 seen, 2 touched\n"
    "element vertex {vertices}\n"
    "property double x\nproperty double y\nproperty double z\n"
    "property float deviation\nproperty uchar known_by\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    "element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
)
_PLY_VERTEX = np.dtype([("place", "<f8", 3), ("deviation", "<f4"), ("known_by", "u1"), ("colour", "u1", 3)])
_PLY_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])


def write_estimate(estimate: ShapeEstimate, folder: Path, name: str = "shape") -> dict[str, Path]:
    """``NAME.ply``, ``NAME.obj``, ``NAME.glb`` and ``NAME.npz`` in a folder, each whole or not at all.

    The same answer gives the same bytes. The GLB has y up, as its format demands; all others have ``stand``.

    Args:
        estimate: finite, with one face or more.
        folder: that there is.
        name: of the files, without what follows the point.

    Returns:
        The paths by their kind.

    Raises:
        DataRefused: numbers that are not finite or not one a vertex.
    """
    mesh, count = estimate.mesh, len(estimate.mesh.vertices)
    finite = np.isfinite(mesh.vertices).all() and np.isfinite(estimate.deviation).all()
    if len(mesh.faces) == 0 or not finite or not len(estimate.deviation) == len(estimate.known_by) == count:
        raise DataRefused(
            f"an answer of {len(mesh.faces)} faces and {count} vertices with {len(estimate.deviation)} "
            f"deviations and {len(estimate.known_by)} sources is not written; give faces, and of every "
            "vertex one finite deviation and one source"
        )
    made = {
        "ply": ply_bytes_of(estimate),
        "obj": obj_bytes_of(estimate),
        "glb": glb_bytes_of(estimate),
        "npz": points_bytes_of(estimate),
    }
    paths = {kind: folder / f"{name}.{kind}" for kind in made}
    for kind, data in made.items():
        write_bytes_whole(paths[kind], data)
    return paths


def ply_bytes_of(estimate: ShapeEstimate) -> bytes:
    """Binary, little endian: each vertex with its deviation, by what it is known, and its colour."""
    mesh = estimate.mesh
    vertices, faces = np.zeros(len(mesh.vertices), _PLY_VERTEX), np.zeros(len(mesh.faces), _PLY_FACE)
    vertices["place"], vertices["deviation"] = mesh.vertices, estimate.deviation
    vertices["known_by"], vertices["colour"] = estimate.known_by, colours_of(estimate.deviation)
    faces["count"], faces["corners"] = 3, mesh.faces
    header = _PLY_HEADER.format(vertices=len(vertices), faces=len(faces))
    return header.encode() + vertices.tobytes() + faces.tobytes()


def obj_bytes_of(estimate: ShapeEstimate) -> bytes:
    """Text: each vertex with its colour behind it, as most viewers read them."""
    shares = colours_of(estimate.deviation) / 255.0
    rows = np.column_stack([estimate.mesh.vertices, shares])
    text = io.StringIO()
    text.write("# metres; z up, z = 0 at the support; colours by deviation\n")
    np.savetxt(text, rows, fmt="v %.9g %.9g %.9g %.4f %.4f %.4f")
    np.savetxt(text, estimate.mesh.faces + 1, fmt="f %d %d %d")
    return text.getvalue().encode()


def glb_bytes_of(estimate: ShapeEstimate) -> bytes:
    """Binary glTF 2.0, painted; metres, y up."""
    import trimesh  # here, because importing it takes a third of a second

    colours = np.column_stack([colours_of(estimate.deviation), np.full(len(estimate.deviation), 255)])
    body = trimesh.Trimesh(
        estimate.mesh.vertices,
        estimate.mesh.faces,
        vertex_colors=colours.astype(np.uint8),
        process=False,
    )
    y_up_from_stand = transform(rotation_about(np.array([1.0, 0.0, 0.0]), -0.5 * np.pi), np.zeros(3))
    scene = trimesh.Scene()
    scene.add_geometry(body, node_name="shape", geom_name="shape", transform=y_up_from_stand)
    return bytes(scene.export(file_type="glb"))  # type: ignore[no-untyped-call]


def points_bytes_of(estimate: ShapeEstimate) -> bytes:
    """``points``, ``normals``, ``deviation`` and ``known_by`` of places all over the surface."""
    points, faces = random_points(estimate.mesh, POINTS, np.random.default_rng(0))
    corners = estimate.mesh.faces[faces]
    nearest = np.linalg.norm(estimate.mesh.vertices[corners] - points[:, None], axis=2).argmin(axis=1)
    vertices = corners[np.arange(len(points)), nearest]
    stream = io.BytesIO()
    np.savez(
        stream,
        allow_pickle=False,
        points=points,
        normals=estimate.mesh.face_normals[faces],
        deviation=estimate.deviation[vertices],
        known_by=estimate.known_by[vertices].astype(np.float64),
    )
    return stream.getvalue()


def colours_of(deviation: FloatArray) -> ByteArray:
    """``(n, 3)`` RGB of ``(n,)`` m: blue where it is well known, red from ``PALE_AT`` on."""
    at = np.clip(deviation / PALE_AT, 0.0, 1.0) * (len(_COLOURS) - 1)
    steps = np.arange(len(_COLOURS))
    channels = [np.interp(at, steps, _COLOURS[:, channel]) for channel in range(3)]
    return np.round(np.column_stack(channels)).astype(np.uint8)
