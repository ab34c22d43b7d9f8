from io import BytesIO

import matplotlib.image as mpl_image
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.basics.geometry import translation
from harness.basics.mesh import closed_hull
from harness.report.figures.charts import ErrorCurve, error_chart
from harness.report.figures.pictures import Heat, Posterior, box, cylinder
from harness.report.figures.shading import BenchPart, Shot, back_projected, look_at, see
from harness.report.figures.tiles import difference, height_picture, png
from harness.report.wording import duration, millimetres

CAMERA = look_at(np.zeros(3), 0.7, 0.4, 0.2, 90, 120)
CUBE = BenchPart(box(np.full(3, -0.02), np.full(3, 0.02)), np.eye(4), (0.2, 0.6, 0.3), smooth=False)


@given(azimuth=st.floats(-7.0, 7.0), elevation=st.floats(-1.5, 1.5), width=st.floats(0.05, 2.0))
def test_the_focus_is_the_centre_and_the_width_is_the_width(
    azimuth: float, elevation: float, width: float
) -> None:
    focus = np.array([0.1, -0.4, 0.3])
    camera = look_at(focus, azimuth, elevation, width, 200, 300)
    aside = camera.camera_from_object[0, :3] * 0.5 * width
    pixels, depth = camera.project(np.array([focus, focus + aside, focus - aside]))
    assert pixels[0] == pytest.approx([150.0, 100.0], abs=1e-6)
    assert pixels[1:, 0] == pytest.approx([300.0, 0.0], abs=1e-6)
    assert depth[0] == pytest.approx(4.0 * width)


def test_what_is_seen_lies_on_the_bodies_it_is_said_to_lie_on() -> None:
    view = see((CUBE,), CAMERA)
    filled = view.part == 0
    assert filled.any()
    points = back_projected(CAMERA, np.where(filled, view.depth, 1.0))[filled]
    assert np.abs(points).max(axis=1) == pytest.approx(0.02, abs=1e-9)
    corners = CUBE.mesh.corners[view.face[filled]]
    normal = CUBE.mesh.face_normals[view.face[filled]]
    assert np.einsum("ij,ij->i", points - corners[:, 0], normal) == pytest.approx(0.0, abs=1e-9)


def test_the_nearer_body_hides_the_farther_whatever_their_order() -> None:
    towards = CAMERA.eye / np.linalg.norm(CAMERA.eye)
    nearer = BenchPart(CUBE.mesh, translation(0.06 * towards), (0.9, 0.1, 0.1), smooth=False)
    one, other = see((CUBE, nearer), CAMERA), see((nearer, CUBE), CAMERA)
    assert one.part[45, 60] == 1
    assert other.part[45, 60] == 0
    assert np.array_equal(one.depth, other.depth)


def test_bodies_behind_the_eye_are_not_drawn() -> None:
    behind = BenchPart(CUBE.mesh, translation(1.5 * CAMERA.eye), (0.9, 0.1, 0.1))
    assert (see((behind,), CAMERA).part == -1).all()
    assert (Shot((behind,), CAMERA).picture() == 1.0).all()


def test_a_picture_is_white_where_nothing_is_and_within_range_elsewhere() -> None:
    picture = Shot((CUBE,), CAMERA).picture()
    assert picture.shape == (90, 120, 3)
    assert (picture[0] == 1.0).all()
    assert 0.0 <= picture.min() < picture[45, 60].max() < 1.0


def test_the_far_side_is_hidden_and_the_near_side_is_not() -> None:
    shot = Shot((CUBE,), CAMERA)
    towards = CAMERA.eye / np.linalg.norm(CAMERA.eye)
    assert shot.hidden(np.array([-0.02 * towards, 0.05 * towards]), 1e-3).tolist() == [True, False]


def test_paint_covers_only_the_body_it_is_meant_for() -> None:
    other = BenchPart(CUBE.mesh, translation(np.array([0.0, 0.0, 0.05])), (0.2, 0.6, 0.3), smooth=False)
    shot = Shot((CUBE, other), CAMERA)
    red = (np.array([1.0, 0.0, 0.0]), 1.0)
    painted = shot.picture(
        0, lambda points: (np.tile(red[0], (len(points), 1)), np.full(len(points), red[1]))
    )
    changed = np.any(painted != shot.picture(), axis=2)
    owner = see((CUBE, other), CAMERA).part
    assert changed[owner == 0].mean() > 0.9
    assert changed[owner == 1].mean() < 0.1


def test_heat_is_hottest_at_the_weights_and_absent_away_from_them() -> None:
    places = np.array([[0.0, 0.0, 0.0], [0.03, 0.0, 0.0], [0.0, 0.05, 0.0]])
    weights = np.array([3.0, 1.0, 0.0])
    heat = Heat(Posterior(places, weights, places[0], places[:1], np.ones(1), 1e-3))
    opaque = heat(np.vstack([places, [[1.0, 1.0, 1.0]]]))[1]
    assert opaque[0] == pytest.approx(1.0)
    assert opaque[1] > 0.9
    assert opaque[2] == pytest.approx(0.0)
    assert opaque[3] == 0.0


def test_heat_does_not_depend_on_the_sum_of_the_weights() -> None:
    rng = np.random.default_rng(0)
    places, weights = rng.uniform(-0.03, 0.03, (300, 3)), rng.random(300)
    one, other = (
        Heat(Posterior(places, scale * weights, places[0], places[:1], np.ones(1), 1e-3))
        for scale in (1.0, 1e-9)
    )
    assert one(places)[0] == pytest.approx(other(places)[0])


@pytest.mark.parametrize(
    "mesh", [box(np.zeros(3), np.ones(3)), cylinder(0.1, 0.0, 0.4)], ids=["box", "cylinder"]
)
def test_props_are_closed_and_outward(mesh: object) -> None:
    part = mesh if isinstance(mesh, type(CUBE.mesh)) else CUBE.mesh
    a, b, c = part.corners[:, 0], part.corners[:, 1], part.corners[:, 2]
    volume = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)
    expected = 1.0 if len(part.vertices) == 8 else 0.5 * 64 * np.sin(2 * np.pi / 64) * 0.01 * 0.4
    assert volume == pytest.approx(expected)
    assert closed_hull(part.vertices).face_areas.sum() == pytest.approx(part.face_areas.sum())


def test_equal_images_differ_by_middle_grey_and_the_sign_shows() -> None:
    image = np.full((4, 5, 3), 100, np.uint8)
    assert (difference(image, image) == 127).all()
    assert (difference(image + np.uint8(10), image) > 127).all()
    assert (difference(image, image + np.uint8(10)) < 127).all()
    assert (difference(np.full((4, 5, 3), 255, np.uint8), np.zeros((4, 5, 3), np.uint8)) == 255).all()


def test_a_small_picture_is_kept_pixel_for_pixel_and_a_large_one_averaged() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    back = np.round(np.asarray(mpl_image.imread(BytesIO(png(picture))))[..., :3] * 255).astype(np.uint8)
    assert np.array_equal(back, picture)
    large = np.repeat(np.repeat(picture, 20, axis=0), 20, axis=1)[:, :800]
    small = np.round(np.asarray(mpl_image.imread(BytesIO(png(large))))[..., :3] * 255).astype(np.uint8)
    assert small.shape == (300, 400, 3)
    assert np.array_equal(small[::10, ::10], picture)


def test_a_flat_height_map_has_a_picture() -> None:
    assert len(np.unique(height_picture(np.zeros((3, 4)), 0.0).reshape(-1, 3), axis=0)) == 1


def test_errors_of_zero_are_drawn_on_a_logarithmic_scale() -> None:
    figure = error_chart(
        (ErrorCurve("ours", (1.0, 2.0), (0.01, 0.0)), ErrorCurve("other", (), ())), "contacts used", False
    )
    line = figure.axes[0].lines[0]
    assert np.isfinite(np.asarray(line.get_ydata())).all()
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["ours", "other"]  # type: ignore[union-attr]


def test_what_answers_has_one_colour_in_every_chart() -> None:
    def colours(*named: str) -> dict[str, str]:
        curves = tuple(ErrorCurve(by, (1.0, 2.0), (1e-3, 2e-3), by=by) for by in named)
        lines = error_chart(curves, "contacts used", False).axes[0].lines
        return {str(line.get_label()): str(line.get_color()) for line in lines}

    every = colours("both", "touch", "audio", "geometry", "particle")
    assert len(set(every.values())) == len(every)
    for others in (("touch", "particle"), ("audio", "both", "touch")):
        assert colours(*others) == {by: every[by] for by in others}


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(None, "–"), (4e-5, "40 µs"), (0.0123, "12.3 ms"), (2.5, "2.50 s")],  # noqa: RUF001
)
def test_times_are_said_in_the_unit_that_suits_them(seconds: float | None, said: str) -> None:
    assert duration(seconds) == said


def test_lengths_are_said_in_millimetres() -> None:
    assert millimetres(0.0012345) == "1.23 mm"
    assert millimetres(None) == "–"  # noqa: RUF001
