"""An object's sound is that of its modes, at every level, near the surface and nowhere else."""

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.faces.nearest_kernels import shares_on_faces
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.objectfile.audio.audio import CHUNK, ObjectAudio, open_audio
from harness.objectfile.audio.table import scaled, table_from
from harness.objectfile.file import ObjectFile
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.surface_search import SurfaceSearch
from harness.sim.modal.modes import dampings, nearest_shares
from harness.sim.sound.modal_sound import radiation
from tests.samples.object_bench import (
    MODES,
    NEAR,
    egg,
    egg_modes,
    egg_part,
    egg_waves,
    exchange,
)

HALF = 2.0**-10
"""Of a mode's greatest number: half precision rounds to 2^-11, and a little is lost in between."""


@pytest.fixture(scope="module")
def network(egg_object: ObjectFile) -> ObjectAudio:
    return open_audio(egg_object, "network")


@pytest.fixture(scope="module")
def table(egg_object: ObjectFile) -> ObjectAudio:
    return open_audio(egg_object, "table")


def test_the_modes_are_those_that_were_written(network: ObjectAudio) -> None:
    modes = egg_modes(egg())
    np.testing.assert_array_equal(network.frequencies, modes.frequencies)
    np.testing.assert_array_equal(network.dampings, dampings(modes.frequencies, MATERIALS["ceramic"]))


def test_the_network_gives_the_shapes_it_was_made_of(network: ObjectAudio) -> None:
    points, normals = SurfaceSearch(egg()).spread(2 * CHUNK + 3)
    points = points + 0.9 * NEAR * normals
    exact = egg_waves()(points)
    assert np.abs(network.at(points) - exact).max() <= 3e-5 * np.abs(exact).max()


def test_the_table_is_exact_at_its_nodes_to_half_precision(table: ObjectAudio) -> None:
    modes = egg_modes(egg())
    greatest = np.abs(modes.shapes).max(axis=(0, 2))[:, None]
    for found in (table.at(modes.points), table.as_modes().shapes):
        assert (np.abs(found - modes.shapes) <= HALF * greatest).all()


def test_the_table_is_linear_between_nodes_as_the_modes_are(table: ObjectAudio) -> None:
    points, normals = SurfaceSearch(egg()).spread(50)
    points = points + 0.5 * NEAR * normals
    expected = egg_modes(egg()).at(points)
    assert np.abs(table.at(points) - expected).max() <= 2.0 * HALF * np.abs(expected).max()


@pytest.mark.parametrize("level", ["network", "table"])
def test_gains_are_shapes_along_directions(egg_object: ObjectFile, level: str) -> None:
    sound = open_audio(egg_object, "network" if level == "network" else "table")
    points, normals = SurfaceSearch(egg()).spread(9)
    expected = np.einsum("nmd,nd->nm", sound.at(points), normals)
    np.testing.assert_allclose(sound.gains(points, normals), expected, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(sound.gains(points, -normals), -expected, rtol=0.0, atol=1e-12)


def test_as_modes_stands_where_the_solver_s_modes_stand(network: ObjectAudio, table: ObjectAudio) -> None:
    modes = egg_modes(egg())
    expected = radiation(modes, 0.5)
    for sound in (network, table):
        np.testing.assert_allclose(radiation(sound.as_modes(), 0.5), expected, rtol=2e-3)
    finer = Mesh(egg().vertices[:, [0, 1, 2]], egg().faces)
    np.testing.assert_allclose(table.as_modes(finer).shapes, table.as_modes().shapes, atol=1e-4)


@settings(max_examples=10, deadline=None)
@given(size=st.integers(1, 2 * CHUNK + 5))
def test_points_are_answered_each_by_itself(network: ObjectAudio, size: int) -> None:
    points = SurfaceSearch(egg()).spread(size, seed=size)[0]
    whole = network.at(points)
    np.testing.assert_allclose(
        network.at(points[-1:])[0], whole[-1], rtol=0.0, atol=1e-4 * np.abs(whole).max()
    )


def test_nothing_asked_is_nothing_answered(network: ObjectAudio, table: ObjectAudio) -> None:
    for sound in (network, table):
        assert sound.at(np.zeros((0, 3))).shape == (0, MODES, 3)


@pytest.mark.parametrize("level", ["network", "table"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_point_off_the_surface_is_refused_with_value_and_limit(
    egg_object: ObjectFile, level: str, side: float
) -> None:
    sound = open_audio(egg_object, "network" if level == "network" else "table")
    points, normals = SurfaceSearch(egg()).spread(5)
    sound.at(points + side * NEAR * normals)
    points[3] += side * 3.0 * NEAR * normals[3]
    with pytest.raises(OutOfDomain, match=r"1 of 5 points .* [56](\.\d+)? mm.* 2 mm"):
        sound.at(points)


def test_millimetres_given_as_metres_are_refused(network: ObjectAudio) -> None:
    with pytest.raises(OutOfDomain, match=r"4 of 4 points .* 2 mm"):
        network.at(1e3 * egg().vertices[:4])


@pytest.mark.parametrize(
    "bad", [np.zeros(3), np.zeros((2, 2)), np.array([[0.0, np.nan, 0.0]])], ids=["1d", "2", "nan"]
)
def test_what_is_no_point_is_refused(network: ObjectAudio, bad: AnyArray) -> None:
    with pytest.raises(WrongUse, match=r"shape .*\(n, 3\)"):
        network.at(bad)


def test_directions_must_be_unit_and_as_many(network: ObjectAudio) -> None:
    points, normals = SurfaceSearch(egg()).spread(3)
    with pytest.raises(WrongUse, match=r"lengths 1 to 2"):
        network.gains(points, 2.0 * normals)
    with pytest.raises(WrongUse, match=r"3 points .*2 directions"):
        network.gains(points, normals[:2])


def test_opening_a_network_leaves_numpy_s_subnormal_numbers_alone() -> None:
    program = (
        "import sys, tempfile, pathlib, numpy as np\n"
        "from tests.samples.object_bench import egg_file\n"
        "from harness.objectfile.audio.audio import open_audio\n"
        "of = egg_file(pathlib.Path(tempfile.mkdtemp()) / 'egg')\n"
        "open_audio(of).at(of.mesh.vertices[:3])\n"
        "assert (np.array([1e-310]) * np.array([0.5]))[0] == 5e-311\n"
        "assert 'torch' not in sys.modules\n"
    )
    root = str(Path(__file__).parents[4])
    subprocess.run([sys.executable, "-c", program], check=True, env={**os.environ, "PYTHONPATH": root})


def test_an_object_without_that_sound_says_so(spoiled: Path) -> None:
    of = ObjectFile.open(spoiled)
    from harness.objectfile.audio.part import with_audio

    part = egg_part(egg())
    only = type(part)(**{**vars(part), "graph": None})
    with pytest.raises(DataRefused, match="network"):
        open_audio(with_audio(of, only), "network")
    with pytest.raises(WrongUse, match="table=True"):
        with_audio(of, type(part)(**{**vars(part), "graph": None, "table": False}))


def pickled() -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.array([print], dtype=object), allow_pickle=True)
    return stream.getvalue()


def zipped() -> bytes:
    stream = io.BytesIO()
    np.savez(stream, a=np.zeros(3))
    return stream.getvalue()


GOOD = np.ones((4, 2, 3), np.float16)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (pickled(), "holds object"),
        (zipped(), ".npy"),
        (b"", ".npy"),
        (npy_bytes(GOOD, "<f2")[:-1], "bytes"),
        (npy_bytes(GOOD, "<f2") + b"x", "bytes"),
        (npy_bytes(GOOD, "<f2").replace(b"(4, 2, 3)", b"(9, 9, 9)"), "float16"),
        (npy_bytes(GOOD, "<f2").replace(b"'<f2'", b"'>f2'"), "float16"),
        (npy_bytes(GOOD, "<f2").replace(b"False", b"True "), "float16"),
        (npy_bytes(np.full((4, 2, 3), np.nan, np.float16), "<f2"), "24 numbers .*finite"),
    ],
    ids=["pickle", "zip", "empty", "short", "long", "shape", "endian", "order", "nan"],
)
def test_a_table_that_is_none_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(DataRefused, match=said):
        table_from(data, "audio_table.npy", (4, 2, 3))


def test_a_pickle_in_the_table_s_place_is_not_loaded(spoiled: Path) -> None:
    of = exchange(spoiled, "audio_table.npy", pickled())
    with pytest.raises(DataRefused, match="object"):
        open_audio(of, "table")


@settings(max_examples=20, deadline=None)
@given(power=st.integers(-12, 12), seed=st.integers(0, 1000))
def test_the_table_s_error_does_not_depend_on_the_object_s_mass(power: int, seed: int) -> None:
    shapes = np.random.default_rng(seed).normal(size=(20, 3, 3)) * 10.0**power
    kept, scale = scaled(shapes)
    again = kept.astype(np.float64) * scale[:, None]
    assert np.abs(again - shapes).max() <= HALF * np.abs(shapes).max()


def test_a_mode_at_rest_stays_at_rest() -> None:
    kept, scale = scaled(np.zeros((5, 2, 3)))
    assert not kept.any()
    assert scale.tolist() == [1.0, 1.0]


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), most=st.floats(1e-5, 0.05), far=st.floats(0.0, 0.2))
def test_near_is_what_the_nearest_place_of_any_face_says(seed: int, most: float, far: float) -> None:
    mesh, random = egg(), np.random.default_rng(seed)
    points = (
        mesh.bounds[0]
        + random.random((8, 3)) * (mesh.bounds[1] - mesh.bounds[0])
        + far * random.normal(size=3)
    )
    shares = nearest_shares(points[:, None], mesh.corners[None])
    feet = np.einsum("nfc,fcd->nfd", shares, mesh.corners)
    distances = np.linalg.norm(feet - points[:, None], axis=2).min(axis=1)
    search = SurfaceSearch(mesh)
    for point, distance in zip(points, distances, strict=True):
        if distance <= most:
            search.require_within(point[None], most, "it")
        else:
            with pytest.raises(OutOfDomain, match=f"{distance * 1e3:.3g} mm"):
                search.require_within(point[None], most, "it")


@pytest.mark.slow  # odd meshes of one table
def test_shares_rebuild_every_place_on_needles_and_points_too() -> None:
    random = np.random.default_rng(0)
    corners = random.normal(size=(60, 3, 3))
    corners[20:40, 2] = corners[20:40, 0] + 0.3 * (corners[20:40, 1] - corners[20:40, 0])  # needles
    corners[40:50, 1:] = corners[40:50, :1]  # points
    places = np.einsum("nc,ncd->nd", random.dirichlet(np.ones(3), 60), corners)
    shares = shares_on_faces(places, corners, np.arange(60))
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-12)
    assert shares.min() >= 0.0
    np.testing.assert_allclose(np.einsum("nc,ncd->nd", shares, corners), places, atol=1e-9)
