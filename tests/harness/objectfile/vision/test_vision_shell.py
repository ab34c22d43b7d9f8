"""The shell and the march: no place of a surface outside, no ray's way through it without a sample."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused, MeshRefused, WrongUse
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objectfile.vision.march import march, network_at
from harness.objectfile.vision.network.network import VisionGrid
from harness.objectfile.vision.shell import Shell, grid_of, lattice_of, shell_for, surface_shell
from harness.objectfile.vision.voxels import walk
from harness.objects.household import MATERIALS, build
from harness.sim.light.appearance_source import appearance_of
from tests.oracles.plain_look import looking
from tests.oracles.seen_shapes import ball, cuboid, square


def bowl() -> Mesh:
    """Half a ball 0.3 m across, whose wall is 1 mm thick and open to both sides of it."""
    made = ball(0.15, 4)
    inner = Mesh(made.vertices * (0.149 / 0.15), made.faces[:, ::-1])
    both = Mesh(
        np.vstack([made.vertices, inner.vertices]), np.vstack([made.faces, inner.faces + len(made.vertices)])
    )
    keep = both.corners[:, :, 2].max(axis=1) <= 0.0
    return Mesh(both.vertices, both.faces[keep])


SHAPES: dict[str, Callable[[], Mesh]] = {
    "mug": lambda: build("mug", 8e-3),
    "wrench": lambda: build("wrench", 8e-3),
    "1 mm bowl": bowl,
    "sheet": lambda: square(0.2),
    "box": lambda: cuboid(0.1, 0.05, 0.2),
}

SCANS = (
    ("ycb_sim/006_mustard_bottle/006_mustard_bottle.obj", "m"),
    ("ycb_sim/035_power_drill/035_power_drill.obj", "m"),
    ("ycb_isaac/025_mug/textured.obj", "cm"),
)


def drawn_on(mesh: Mesh, count: int, seed: int) -> FloatArray:
    random = np.random.default_rng(seed)
    faces = random.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
    shares = random.dirichlet(np.ones(3), count)
    points: FloatArray = np.einsum("nc,ncx->nx", shares, mesh.corners[faces])
    return points


def marched(
    shell: Shell,
    grid: VisionGrid,
    eye: FloatArray,
    ways: FloatArray,
    step: float,
    most: int,
    stretches: int = 64,
) -> tuple[list[FloatArray], AnyArray]:
    """Of each ray, ``(samples, 2)`` where each sample's stretch begins and ends; and all networks."""
    count, found = len(ways), [np.zeros((0, 2)) for _ in ways]
    networks, resume, going = [], np.zeros(count), np.arange(count, dtype=np.int32)
    while len(going):
        counts, kind = np.zeros(len(going), np.int32), np.zeros(len(going) * most, np.int32)
        local = np.zeros((len(kind), 3), np.float32)
        lengths, places = np.zeros(len(kind), np.float32), np.zeros(len(kind), np.float32)
        from_eye, size = (eye - shell.low) / shell.voxel, shell.voxel
        march(
            *(going, ways, from_eye, size, 8, shell.near, grid.table, grid.cells, step, most),
            *(stretches, resume, counts, kind, local, lengths, places),
        )
        assert (np.abs(local) <= 1.0).all()
        for i, ray in enumerate(going):
            at = slice(i * most, i * most + counts[i])
            ends = places[at, None] + lengths[at, None] * np.array([-0.5, 0.5])
            found[ray] = np.vstack([found[ray], ends])
            networks.append(kind[at])
        going = going[np.isfinite(resume[going])]
    return found, np.concatenate([np.zeros(0, np.int32), *networks])


@pytest.mark.parametrize("name", SHAPES)
def test_every_place_of_a_surface_is_in_its_shell_and_in_a_cell(name: str) -> None:
    mesh = SHAPES[name]()
    lattice = lattice_of(mesh)
    shell = surface_shell(mesh, lattice, 0.0)
    points = np.vstack([drawn_on(mesh, 20_000, 1), mesh.vertices[np.unique(mesh.faces)]])
    voxels = np.floor((points - shell.low) / shell.voxel).astype(int)
    assert shell.occupied[tuple(voxels.T)].all()
    assert (grid_of(shell, lattice).networks(points) >= 0).all()


def test_a_shell_is_tight() -> None:
    """No voxel farther from the surface than its own half diagonal; behind it, so much farther."""
    mesh = ball(0.05, 4)
    lattice = lattice_of(mesh)
    for deep in (0.0, 1.0, 3.0):
        shell = surface_shell(mesh, lattice, deep)
        centres = shell.low + shell.voxel * (np.argwhere(shell.occupied) + 0.5)
        height = np.linalg.norm(centres, axis=1) - 0.05
        half = 0.5 * np.sqrt(3.0) * shell.voxel
        # Faces are chords: their middles lie a little inside.
        flat = 0.05 - float(np.linalg.norm(mesh.corners.mean(axis=1), axis=1).min())
        assert height.max() <= half + 1e-9
        assert height.min() >= -half - deep * shell.voxel - flat - 1e-9
        # What lies less deep than asked is inside.
        random = np.random.default_rng(0).standard_normal((5000, 3))
        way = random / np.linalg.norm(random, axis=1, keepdims=True)
        inside = way * (0.05 - flat - (deep * shell.voxel) * np.linspace(0.0, 1.0, 5000)[:, None])
        voxels = np.floor((inside - shell.low) / shell.voxel).astype(int)
        assert shell.occupied[tuple(voxels.T)].mean() > 0.99


def test_voxels_come_back_from_their_words() -> None:
    occupied = np.random.default_rng(2).random((9, 4, 13)) < 0.3
    shell = Shell.of(np.zeros(3), 1e-3, occupied)
    assert shell.words.shape == (3, 1, 4)
    assert np.array_equal(shell.occupied[:9, :4, :13], occupied)
    assert shell.occupied.sum() == occupied.sum()


def _in_voxels(occupied: AnyArray, place: FloatArray) -> bool:
    at = np.floor(place).astype(int)
    return bool((at >= 0).all() and (at < occupied.shape).all() and occupied[tuple(at)])


@pytest.mark.parametrize("kind", ["any", "axis", "from inside", "diagonal", "on a face"])
def test_stretches_are_where_the_voxels_are(kind: str) -> None:
    """Against places all along each ray, asked one by one."""
    random = np.random.default_rng(4)
    occupied = random.random((12, 8, 16)) < 0.2
    shell, shape = Shell.of(np.zeros(3), 1.0, occupied), np.array([12.0, 8.0, 16.0])
    runs, met = np.empty((64, 2)), 0
    for _ in range(25):
        eye, way = shape * random.uniform(-0.5, 1.5, 3), random.standard_normal(3)
        if kind in ("axis", "on a face"):
            way = np.eye(3)[random.integers(3)] * random.choice([-1.0, 1.0])
            eye = np.where(way == 0.0, shape * random.random(3), np.where(way > 0.0, -3.0, shape + 3.0))
        if kind == "on a face":
            eye = np.where(way == 0.0, np.floor(eye), eye)
        if kind == "from inside":
            eye = shape * random.random(3)
        if kind == "diagonal":
            eye, way = np.floor(shape * random.random(3)) - 20.0, np.ones(3)
        count, after = walk(eye, way, 0.0, shell.near, runs)
        assert after == np.inf
        ends = runs[:count]
        assert (ends[:, 1] >= ends[:, 0]).all()
        assert (ends[1:, 0] >= ends[:-1, 1]).all()
        places = np.arange(0.0005, 60.0, 0.037)
        inside = np.any((places[:, None] > ends[:, 0]) & (places[:, None] < ends[:, 1]), axis=1)
        wanted = np.array([_in_voxels(occupied, eye + t * way) for t in places])
        if kind == "diagonal":
            # On an edge of four voxels rounding decides; each of the four would be right.
            continue
        border = np.abs(places[:, None, None] - ends[None]).min(axis=(1, 2), initial=np.inf) < 1e-9
        assert np.array_equal(inside[~border], wanted[~border])
        met += count
    assert met > 10 or kind == "diagonal"


def never_missed(mesh: Mesh, away: float) -> int:
    """The first hit of exact ray casting lies within what some sample stands for; hits are counted."""
    lattice, hits = lattice_of(mesh), 0
    shell = surface_shell(mesh, lattice)
    grid, exact = grid_of(shell, lattice), RayMesh(mesh)
    for along in ((0.3, -0.8, 0.5), (1.0, 0.0, 0.0), (0.01, 0.02, 1.0)):
        camera = looking(mesh, away, 48, along=along)
        ways = camera.directions().reshape(-1, 3)
        if along == (1.0, 0.0, 0.0):
            ways[:] = -np.eye(3)[0]
        distance = exact.first_hits(camera.eye, ways).distance
        samples, networks = marched(shell, grid, camera.eye, ways, 0.5 * shell.voxel, 4)
        assert (networks >= 0).all()
        # Places are kept as float32.
        near = 4e-7 * (away + 2.0) * float(np.ptp(mesh.bounds, axis=0).max())
        met = np.flatnonzero(np.isfinite(distance))
        for ray in met:
            ends = samples[ray]
            held = (ends[:, 0] - near <= distance[ray]) & (distance[ray] <= ends[:, 1] + near)
            assert held.any(), (ray, distance[ray], ends)
        hits += len(met)
    return hits


@pytest.mark.parametrize("away", [0.5, 2.0, pytest.param(25.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", SHAPES)
def test_the_march_misses_no_surface(name: str, away: float) -> None:
    never_missed(SHAPES[name](), away)


@pytest.mark.parametrize("name", MATERIALS)
def test_the_march_misses_nothing_of_built_in_objects(name: str) -> None:
    assert never_missed(build(name), 2.0) > 100


@pytest.mark.parametrize(("name", "units"), SCANS)
def test_the_march_misses_nothing_of_scans(shared_data: Path, name: str, units: str) -> None:
    assert never_missed(appearance_of(str(shared_data / "meshes" / name), units).mesh, 2.0) > 100


@pytest.mark.parametrize("most", [1, 2, 3, 7])
def test_samples_are_the_same_however_many_are_taken_at_once(most: int) -> None:
    mesh = SHAPES["mug"]()
    lattice = lattice_of(mesh)
    shell = surface_shell(mesh, lattice)
    grid = grid_of(shell, lattice)
    camera = looking(mesh, 2.0, 24)
    ways = camera.directions().reshape(-1, 3)
    whole, _ = marched(shell, grid, camera.eye, ways, 0.5 * shell.voxel, 512)
    parts, _ = marched(shell, grid, camera.eye, ways, 0.5 * shell.voxel, most, 1)
    for a, b in zip(whole, parts, strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-6 * 0.3)


def test_no_sample_stands_for_more_than_the_step() -> None:
    mesh = SHAPES["box"]()
    lattice = lattice_of(mesh)
    shell = surface_shell(mesh, lattice)
    camera = looking(mesh, 2.0, 24)
    for step in (0.3, 1.0, 5.0):
        samples, _ = marched(
            shell,
            grid_of(shell, lattice),
            camera.eye,
            camera.directions().reshape(-1, 3),
            step * shell.voxel,
            64,
        )
        lengths = np.concatenate([np.diff(ends, axis=1)[:, 0] for ends in samples])
        assert 0.0 < lengths.max() <= step * shell.voxel * (1.0 + 1e-3)


def test_a_place_beside_its_cell_by_rounding_has_its_network() -> None:
    table = np.full((3, 1, 1), -1, np.int32)
    table[1] = 7
    for x, wanted in ((1.0, 7), (1.0 - 1e-9, 7), (2.0, 7), (2.0 + 1e-9, 7), (0.99, -1), (2.01, -1)):
        assert network_at(table, np.array([x, 0.5, 0.5])) == wanted
    assert network_at(table, np.array([1.5, 1.0, 1.0])) == 7
    assert network_at(table, np.array([1.5, 1.1, 1.0])) == -1
    assert network_at(table, np.array([-5.0, 0.5, 0.5])) == -1


def test_a_mesh_of_another_object_is_refused() -> None:
    mug, wrench = SHAPES["mug"](), SHAPES["wrench"]()
    lattice = lattice_of(mug)
    grid = grid_of(surface_shell(mug, lattice), lattice)
    again = shell_for(Mesh(mug.vertices.astype(np.float32).astype(np.float64), mug.faces), grid)
    assert again.voxel == pytest.approx(lattice.voxel)
    with pytest.raises(DataRefused, match="different objects"):
        shell_for(wrench, grid)


def test_surfaces_and_lattices_that_are_none_are_refused() -> None:
    with pytest.raises(MeshRefused):
        lattice_of(Mesh(np.zeros((3, 3)), np.zeros((0, 3), int)))
    with pytest.raises(MeshRefused):
        lattice_of(Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]])))
    with pytest.raises(MeshRefused):
        lattice_of(Mesh(np.full((3, 3), np.nan), np.array([[0, 1, 2]])))
    for cells, per_cell in ((0, 8), (129, 8), (16, 6), (16, 128)):
        with pytest.raises(WrongUse):
            lattice_of(SHAPES["box"](), cells, per_cell)
    with pytest.raises(WrongUse):
        surface_shell(SHAPES["box"](), lattice_of(SHAPES["box"]()), -1.0)
    with pytest.raises(WrongUse):
        Shell.of(np.zeros(3), 0.0, np.ones((2, 2, 2), bool))
