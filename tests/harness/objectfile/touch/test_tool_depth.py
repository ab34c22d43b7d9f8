"""Codes show the object along a tool as its mesh does, everywhere a gel can come to."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.authoring.touch.data import choose_nodes
from harness.authoring.touch.touch import OFF, code_surface
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.geometry import frame_facing, transform
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.objectfile.file import ObjectFile, create_object
from harness.objectfile.runtime import Network
from harness.objectfile.touch.graph import MOST_TILT, codes_graph
from harness.objectfile.touch.part import CodesPart, with_touch
from harness.objectfile.touch.tool_depth import CodedDepth, open_tool_depth
from harness.sim.gel.height_map import RasterMesh, depth_image
from harness.sim.solid.surface_samples import random_points
from tests.oracles.seen_shapes import cuboid
from tests.samples import touch_bench as tb

RAYS = 4 * tb.SENSOR.pitch
SHAPE = (40, 44)
STEEL = MATERIALS["steel"]


@pytest.fixture(scope="module")
def of(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only."""
    return tb.peg_file(tmp_path_factory.mktemp("objects") / "peg")


@pytest.fixture(scope="module")
def coded(of: ObjectFile) -> CodedDepth:
    return open_tool_depth(of)


def view(seed: int, aside: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    """View from object, along a tool that presses a random place of the peg square or leant."""
    random = np.random.default_rng(seed)
    mesh = tb.peg()
    _, faces = random_points(mesh, 1, random)
    axis = -mesh.face_normals[faces[0]] + 0.1 * random.normal(size=3)
    towards = frame_facing(axis / np.linalg.norm(axis), random.uniform(0.0, 6.0))
    middle = towards.T @ mesh.bounds.mean(axis=0)
    return transform(towards.T, np.array([aside[0] - middle[0], aside[1] - middle[1], 0.0]))


def seen(view_from_object: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The mesh's own depth, and the cosine between the tool and the surface; -1 where there is none."""
    image = depth_image(RasterMesh(tb.peg()), view_from_object, RAYS, *SHAPE)
    facing = -tb.peg().face_normals[image.face] @ view_from_object[2, :3]
    return image.depth, np.where(image.face < 0, -1.0, facing)


@pytest.mark.parametrize("seed", range(6))
def test_what_a_gel_can_come_to_is_as_deep_as_on_the_mesh(coded: CodedDepth, seed: int) -> None:
    """At a crease to half a patch's pixel, which is all that a look-up between its sides may be off there."""
    there, facing = seen(view(seed))
    found = coded(view(seed), RAYS, *SHAPE)
    level = facing > np.cos(MOST_TILT)
    assert np.count_nonzero(level) > 40
    gaps = np.abs(found[level] - there[level])
    assert gaps.max() < 0.5 * tb.SPEC.pitch
    assert np.median(gaps) < 1e-5


@pytest.mark.parametrize("seed", range(6))
def test_beside_the_object_nothing_is_seen(coded: CodedDepth, seed: int) -> None:
    """But by a pixel at its outline, where the half-covered one counts."""
    near = np.isfinite(seen(view(seed))[0])
    for axis in (0, 1):
        near |= np.roll(near, 1, axis) | np.roll(near, -1, axis)
    assert not np.isfinite(coded(view(seed), RAYS, *SHAPE)[~near]).any()


def test_a_view_moved_by_whole_pixels_is_the_picture_moved(coded: CodedDepth) -> None:
    """Tiles follow the view's pixels, so that where the picture is cut off changes nothing within it."""
    still = coded(view(3), RAYS, *SHAPE)
    moved = coded(view(3, (2.0 * RAYS, -3.0 * RAYS)), RAYS, *SHAPE)
    np.testing.assert_allclose(moved[:-3, 2:], still[3:, :-2], rtol=0.0, atol=1e-9)


def test_a_coarser_view_is_every_other_pixel_of_a_fine_one(coded: CodedDepth) -> None:
    fine = coded(view(1), RAYS, 41, 41)[::2, ::2]
    coarse = coded(view(1), 2.0 * RAYS, 21, 21)
    both = np.isfinite(coarse) & np.isfinite(fine)
    assert np.count_nonzero(both) > 20
    assert np.median(np.abs(coarse[both] - fine[both])) < 5e-6


def test_far_beside_the_object_there_is_nothing(coded: CodedDepth) -> None:
    assert np.isinf(coded(view(0, (1.0, 1.0)), RAYS, *SHAPE)).all()


@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_pixels_that_are_no_whole_number_of_rays_are_refused(coded: CodedDepth, factor: float) -> None:
    with pytest.raises(WrongUse, match=r" mm .* mm .*touch\.shapes = reference"):
        coded(view(0), factor * RAYS, *SHAPE)


@pytest.mark.parametrize(("measured", "rms"), [({"unseen_places_psnr_db_p10": 40.0}, 20e-6), ({}, 0.0)])
def test_its_error_is_what_the_card_states(tmp_path: Path, measured: dict[str, float], rms: float) -> None:
    """Forty decibels below a press of 2 mm."""
    part = tb.peg_part()
    assert part.codes is not None
    stated = with_touch(
        create_object(tmp_path / "peg", "peg", tb.peg(), STEEL, tb.PROVENANCE),
        replace(part, codes=replace(part.codes, measured=measured)),
    )
    assert open_tool_depth(stated).rms == pytest.approx(rms, rel=1e-12)


def test_an_object_without_codes_is_refused(egg_object: ObjectFile) -> None:
    with pytest.raises(DataRefused, match="--only touch"):
        open_tool_depth(egg_object)


def test_gaps_alone_are_those_of_the_whole_graph(of: ObjectFile, coded: CodedDepth) -> None:
    entry = of.description.touch
    assert entry is not None
    assert entry.codes is not None
    made = entry.codes.network
    whole = Network(of.read(made), made.file, made.inputs, made.outputs)
    asked = coded.nodes.posed(np.arange(3), tb.coded().nodes[np.arange(3)].object_from_node)
    found = coded.network(asked)
    assert set(found) == {"gaps"}
    np.testing.assert_array_equal(found["gaps"], whole(asked)["gaps"])


def test_a_folder_of_codes_opens_anywhere(of: ObjectFile, tmp_path: Path) -> None:
    shutil.copytree(of.folder, tmp_path / "moved")
    again = open_tool_depth(ObjectFile.open(tmp_path / "moved"))
    np.testing.assert_array_equal(again(view(2), RAYS, *SHAPE), open_tool_depth(of)(view(2), RAYS, *SHAPE))


@pytest.fixture(scope="module")
def post(tmp_path_factory: pytest.TempPathFactory) -> tuple[CodedDepth, Mesh]:
    """A plate with a post on it, 30 mm tall, and its codes."""
    plate, pole = cuboid(0.06, 0.06, 0.01), cuboid(0.01, 0.01, 0.03)
    raised = pole.vertices + np.array([0.0, 0.0, 0.02])
    faces = np.concatenate([plate.faces, pole.faces + len(plate.vertices)])
    mesh = Mesh(np.concatenate([plate.vertices, raised]), faces)
    coded = code_surface(RasterMesh(mesh), choose_nodes(mesh, tb.SPACING), tb.SENSOR, tb.SPEC)
    codes = CodesPart(codes_graph(coded.patches, tb.SENSOR, tb.SKIRT), coded.nodes, OFF * tb.SPACING)
    part = replace(tb.peg_part(), codes=codes)
    folder = tmp_path_factory.mktemp("objects") / "post"
    return open_tool_depth(with_touch(create_object(folder, "post", mesh, STEEL, tb.PROVENANCE), part)), mesh


@pytest.mark.parametrize("lean", [8.0, 16.0, 25.0])
def test_what_stands_beside_a_place_casts_no_surface_over_it(
    post: tuple[CodedDepth, Mesh], lean: float
) -> None:
    """A post is in the way of a gel beside it; a tile must not show it where a leant tool sees past it."""
    coded, mesh = post
    axis = np.array([np.sin(np.radians(lean)), 0.0, -np.cos(np.radians(lean))])
    towards = transform(frame_facing(axis, 0.3).T, np.zeros(3))
    there = depth_image(RasterMesh(mesh), towards, RAYS, *SHAPE)
    level = -mesh.face_normals[there.face] @ axis > np.cos(MOST_TILT)
    level &= there.face >= 0
    found = coded(towards, RAYS, *SHAPE)
    assert np.isfinite(found[level]).mean() > 0.95
    assert (there.depth[level] - found[level]).max() < 0.5 * tb.SPEC.pitch
