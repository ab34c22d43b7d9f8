"""A sensor as it was made: another pitch is another scale, and pixels need not be square."""

from dataclasses import replace

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.geometry import transform
from harness.bench.gap import load_gap
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.targets import BALL_RADIUS, ball
from harness.sim.gel.height_map import RasterMesh, height_maps
from mocks.world.gap_draw import GapDraw
from mocks.world.touch import PictureGrid

DEPTH = 0.8e-3


@pytest.fixture(scope="module")
def raster() -> RasterMesh:
    return RasterMesh(ball())


def pressed(x: float, y: float) -> FloatArray:
    """``gel_from_object`` of a ball pressed at a place of the gel, its foot in front."""
    turned = np.diag([1.0, -1.0, -1.0])
    top = np.array([0.0, 0.0, 10.0 * BALL_RADIUS])
    return transform(turned, np.array([x, y, -DEPTH]) - turned @ top)


def middle(gap: FloatArray) -> FloatArray:
    """Pixels (column, row) of the contact's centre of gravity."""
    depth = np.maximum(-gap, 0.0)
    rows, columns = np.mgrid[: gap.shape[0], : gap.shape[1]]
    weighed = [float((depth * columns).sum()), float((depth * rows).sum())]
    return np.array(weighed) / float(depth.sum())


@pytest.mark.parametrize(("pitch", "aspect"), [(1.0, 1.0), (1.02, 1.0), (0.98, 1.013), (1.0, 0.985)])
def test_moves_on_the_gel_are_moves_in_the_picture_over_the_pitch(
    raster: RasterMesh, pitch: float, aspect: float
) -> None:
    grid = PictureGrid.drawn(GELSIGHT_R15, pitch, aspect)
    here, there = (middle(grid.gaps(raster, pressed(x, y))) for x, y in ((-5e-3, -4e-3), (6e-3, 3e-3)))
    column, row = (there - here) * GELSIGHT_R15.pitch * pitch
    assert column == pytest.approx(11e-3, abs=2e-6)
    assert row * aspect == pytest.approx(7e-3, abs=2e-6)
    assert grid.mean_pitch == pytest.approx(GELSIGHT_R15.pitch * pitch * np.sqrt(aspect))


def test_splines_between_rows_change_no_depth_by_more_than_a_facet(raster: RasterMesh) -> None:
    """An aspect so near to one that only the spline is new."""
    plain = height_maps(raster, pressed(1e-3, 2e-3)[None], GELSIGHT_R15)[0]
    splined = PictureGrid(GELSIGHT_R15, 1.0 + 1e-12).gaps(raster, pressed(1e-3, 2e-3))
    deep = plain < -0.05e-3
    assert np.abs(splined[deep] - plain[deep]).max() < 1e-9
    assert not (splined[np.isinf(plain)] < 0.0).any()


def test_a_bench_without_such_a_gap_draws_what_it_always_drew() -> None:
    for seed in range(3):
        run = GapDraw(load_gap("default"), seed).run
        assert (run.pitch, run.aspect) == (1.0, 1.0)
    drawn = [GapDraw(load_gap("target"), seed).run for seed in range(200)]
    assert np.std([run.pitch for run in drawn]) == pytest.approx(0.01, rel=0.2)
    assert np.std([run.aspect for run in drawn]) == pytest.approx(0.005, rel=0.2)
    gap = load_gap("target")
    wider = gap.model_copy(update={"sensor": gap.sensor.model_copy(update={"pitch": 0.05})})
    assert replace(GapDraw(wider, 3).run, pitch=0.0).gel_centre.tolist() == drawn[3].gel_centre.tolist()
