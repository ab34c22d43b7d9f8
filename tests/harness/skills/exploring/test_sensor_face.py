"""Whether the gel or the housing meets a surface first, by a few places of the sensor's face."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_about, transform
from harness.bench.sensor import GELSIGHT_R15
from harness.skills.exploring.lines import MIDDLE, face_places, gel_first, ways_of

PLACES = face_places(GELSIGHT_R15.housing, GELSIGHT_R15.gel_thickness)


def along_to_plane(lines: FloatArray, height: float) -> FloatArray:
    """How far each place goes until it meets the plane ``z = height``."""
    starts, ways = ways_of(lines, PLACES, 0.1)
    return np.asarray(((height - starts[:, 2]) / ways[:, 2]).reshape(len(lines), -1))


def downward(tilt: float) -> FloatArray:
    over = rotation_about(np.array([0.0, 1.0, 0.0]), tilt) @ np.diag([1.0, -1.0, -1.0])
    return transform(over, np.zeros(3))


@pytest.mark.parametrize(
    ("degrees", "reads"), [(0.0, True), (8.0, True), (-8.0, True), (12.0, False), (30.0, False)]
)
def test_a_plane_is_read_by_a_sensor_that_stands_about_upright_on_it(degrees: float, reads: bool) -> None:
    read, _ = gel_first(along_to_plane(downward(np.radians(degrees))[None], 0.02))
    assert read.tolist() == [reads]


def test_every_place_goes_along_the_way_and_ends_where_the_face_is() -> None:
    line = downward(0.3)
    starts, ways = ways_of(line[None], PLACES, 0.1)
    assert ways == pytest.approx(np.tile(line[:3, 2], (len(PLACES), 1)))
    assert starts + 0.1 * ways == pytest.approx(PLACES @ line[:3, :3].T)
    assert PLACES[MIDDLE] == pytest.approx(np.zeros(3))


def test_where_nothing_is_met_nothing_is_read() -> None:
    assert gel_first(np.full((2, len(PLACES)), np.inf))[0].tolist() == [False, False]


def test_what_the_housing_alone_meets_is_not_read() -> None:
    along = np.full((1, len(PLACES)), np.inf)
    along[0, -1] = 0.05
    assert gel_first(along)[0].tolist() == [False]
    along[0, MIDDLE] = 0.05
    assert gel_first(along)[0].tolist() == [False]  # the gel is met, but cannot be pressed on
    along[0, MIDDLE] = 0.04
    assert gel_first(along)[0].tolist() == [True]
