"""The scene camera's frame, pose and lamps, from a station and a scene: over the wire it is read by."""

import threading

import numpy as np
import pytest

from harness.basics.arrays import ByteArray
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.geometry import apply, inverse
from harness.bench.named_files import SHIPPED
from harness.bench.scene import Light, SceneFile, scene_from_options
from harness.bench.scene_camera import scene_frame, scene_lamps, scene_pinhole
from harness.bench.station_file import Station, load_station, station_path
from mocks.camera.gelsight_stream import MjpegServer
from tests.oracles.seen_shapes import cuboid

MESH = cuboid(0.1, 0.08, 0.06)
SCENE = scene_from_options("builtin:mug")
REAL = SHIPPED / "stations" / "example_bench.toml"
BENCH = load_station(station_path("mock"))


class Grey:
    """A camera that sees one grey."""

    def state(self) -> int:
        return 0

    def picture(self) -> ByteArray:
        return np.full((12, 16, 3), 90, np.uint8)

    def sent(self) -> None:
        pass


def camera_at(url: str | None) -> Station:
    """The example bench, but for its camera."""
    station = load_station(REAL)
    assert station.camera is not None
    camera = station.camera.model_copy(update={"url": url, "rows": 12, "columns": 16})
    return station.model_copy(update={"camera": None if url is None else camera})


def test_a_frame_is_what_the_camera_streams() -> None:
    server, stop = MjpegServer("127.0.0.1", 0, Grey(), 50.0), threading.Event()
    thread = threading.Thread(target=server.serve, args=(stop.is_set,))
    thread.start()
    try:
        frame = scene_frame(camera_at(f"http://127.0.0.1:{server.port}/?action=stream"), SCENE, MESH)
    finally:
        stop.set()
        thread.join()
    assert frame.shape == (12, 16, 3)
    assert (np.abs(frame.astype(int) - 90) <= 1).all()


def test_the_camera_sees_the_object_where_the_station_says_it_is() -> None:
    """A point of the object is in the same pixel by way of the base, worked out by hand."""
    camera = scene_pinhole(BENCH, SCENE, MESH)
    assert BENCH.camera is not None
    base_from_camera = BENCH.camera.base_from_camera.matrix
    corner = MESH.vertices[:1]
    x, y, z = apply(inverse(base_from_camera), apply(SCENE.base_from_object(MESH), corner))[0]
    place, depth = camera.project(corner)
    np.testing.assert_allclose(place[0], [600.0 * x / z + 320.0, 600.0 * y / z + 240.0], atol=1e-9)
    assert depth[0] == pytest.approx(z)
    assert (camera.width, camera.height) == (640, 480)


def lit_from(*positions: tuple[str, str, str]) -> SceneFile:
    lights = tuple(Light(position=each, colour=(1.0, 0.5, 0.0)) for each in positions)  # type: ignore[arg-type]
    return SCENE.model_copy(update={"lights": lights})


def test_lamps_turn_with_the_object() -> None:
    scene = lit_from(("0 m", "0 m", "9 m"), ("2 m", "1 m", "0.3 m"))
    base_from_object = scene.base_from_object(MESH)
    middle = apply(base_from_object, MESH.bounds.mean(axis=0)[None])[0]
    for lamp, light in zip(scene_lamps(scene, MESH), scene.lights, strict=True):
        wanted = np.array(light.position) - middle
        np.testing.assert_allclose(
            base_from_object[:3, :3] @ lamp.light.direction, wanted / np.linalg.norm(wanted), atol=1e-12
        )
        assert lamp.colour.tolist() == [1.0, 0.5, 0.0]


def test_what_no_bench_has_is_refused() -> None:
    for ask in (scene_pinhole, scene_frame):
        with pytest.raises(WrongUse, match=r"\[camera\]"):
            ask(camera_at(None), SCENE, MESH)
    middle = apply(SCENE.base_from_object(MESH), MESH.bounds.mean(axis=0)[None])[0]
    inside = SCENE.model_copy(update={"lights": (Light.model_construct(position=tuple(middle)),)})
    with pytest.raises(OutOfDomain, match="light"):
        scene_lamps(inside, MESH)
