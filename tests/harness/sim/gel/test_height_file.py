"""Height maps out of files: what could not be one of this sensor is refused, and the unit is named."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.bench.sensor import GELSIGHT_R15, TactileSensor
from harness.sim.gel.height_file import given_heights, read_heights, spanned

SENSOR = GELSIGHT_R15
TAXIM = TactileSensor("taxim", 480, 640, 0.0295e-3, 5e-3)


def bump(deepest: float) -> FloatArray:
    y, x = np.mgrid[:120, :160] - np.array([60.0, 80.0])[:, None, None]
    return np.asarray(deepest * np.maximum(0.0, 1.0 - (x * x + y * y) / 900.0))


def written(folder: Path, array: Any) -> Path:
    np.save(folder / "h.npy", array)
    return folder / "h.npy"


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_metres_are_handed_on(tmp_path: Path, kind: Any) -> None:
    given = read_heights(written(tmp_path, bump(1e-3).astype(kind)), SENSOR)
    heights = given.heights
    assert not given.missing.any()
    assert heights.dtype == np.float64
    assert heights == pytest.approx(bump(1e-3), rel=1e-6)


def test_nothing_below_an_object_is_asked_about_but_a_gel_may_only_bulge_a_little(tmp_path: Path) -> None:
    far = written(tmp_path, bump(1e-3) - 0.3)  # an object a foot away has no contact
    assert read_heights(far, SENSOR).heights.max() < 0.0
    with pytest.raises(OutOfDomain, match=r" m .*2\.5 mm"):
        read_heights(far, SENSOR, "gel")
    assert read_heights(written(tmp_path, bump(1e-3) - 0.1e-3), SENSOR, "gel").heights.min() < 0.0


@settings(max_examples=40, deadline=None)
@given(
    deepest=st.floats(0.05e-3, 2.5e-3), unit=st.sampled_from([("millimetres", 1e-3), ("micrometres", 1e-6)])
)
def test_another_unit_is_named(deepest: float, unit: tuple[str, float]) -> None:
    name, scale = unit
    assert_refused_for_unit(bump(deepest) / scale, SENSOR, name)


@settings(max_examples=40, deadline=None)
@given(deepest=st.floats(0.15e-3, 2.5e-3))
def test_pixels_are_named(deepest: float) -> None:
    assert_refused_for_unit(bump(deepest) / SENSOR.pitch, SENSOR, "pixels of 0.1245 mm")


def assert_refused_for_unit(heights: FloatArray, sensor: TactileSensor, unit: str) -> None:
    for of in ("object", "gel"):
        with pytest.raises(OutOfDomain, match=r" m .* mm") as refused:
            given_heights(heights, sensor, "gel" if of == "gel" else "object", "h.npy")
        assert unit in str(refused.value)


def test_taxims_published_surface_is_told_for_pixels() -> None:
    y, x = np.mgrid[:480, :640] - np.array([240.0, 320.0])[:, None, None]
    surface = 212.0 + 30.0 * (x * x + y * y < 100.0**2)
    assert_refused_for_unit(surface, TAXIM, "pixels of 0.0295 mm")


def test_beyond_the_gel_is_for_the_caller_to_hold_but_not_far_beyond() -> None:
    given_heights(bump(4e-3), SENSOR, "object", "h.npy")
    with pytest.raises(OutOfDomain, match=r"0\.004 m .*2\.5 mm"):
        given_heights(bump(4e-3), SENSOR, "gel", "h.npy")
    with pytest.raises(OutOfDomain, match=r"0\.011 m .*2\.5 mm"):
        given_heights(bump(11e-3), SENSOR, "object", "h.npy")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e9])
def test_what_is_no_height_is_masked_and_the_rest_as_it_was(bad: float) -> None:
    heights = bump(1e-3)
    heights[7, 40:44] = heights[60:64, 80:83] = bad
    hole = np.zeros(heights.shape, np.bool_)
    hole[7, 40:44] = hole[60:64, 80:83] = True
    for of in ("object", "gel"):
        given = given_heights(heights, SENSOR, "gel" if of == "gel" else "object", "h.npy")
        assert np.array_equal(given.missing, hole)
        assert np.array_equal(given.heights[~hole], heights[~hole])
        assert not given.heights[7].any()
        # An object's hole is where nothing is known to reach the gel; a gel's is spanned.
        inside = given.heights[60:64, 80:83]
        assert not inside.any() if of == "object" else inside.min() > 0.98e-3


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e9])
def test_a_map_without_a_height_is_refused_by_name(bad: float) -> None:
    with pytest.raises(OutOfDomain, match=r"h\.npy: .*19200"):
        given_heights(np.full((120, 160), bad), SENSOR, "object", "h.npy")


def test_what_is_missing_hides_no_wrong_unit_and_no_wrong_sign() -> None:
    holed = np.where(bump(1e-3) > 0.9e-3, np.nan, bump(1e-3))
    with pytest.raises(OutOfDomain, match="millimetres"):
        given_heights(holed * 1e3, SENSOR, "object", "h.npy")
    with pytest.raises(OutOfDomain, match=r"-\d.* mm.*sign"):
        given_heights(-holed, SENSOR, "gel", "h.npy")


def test_a_ray_that_met_nothing_is_no_object_and_nothing_is_missing() -> None:
    heights = np.where(bump(1e-3) > 0.0, bump(1e-3), -1e9)
    assert not given_heights(heights, SENSOR, "object", "h.npy").missing.any()
    given = given_heights(heights, SENSOR, "gel", "h.npy")
    assert np.array_equal(given.missing, heights < 0.0)
    assert given.heights.min() > 0.0


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.01, 0.99))
def test_a_span_stays_between_what_holds_it_and_lies_in_its_plane(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    missing = rng.random((13, 17)) < share
    missing[tuple(rng.integers(0, (13, 17)))] = False
    heights = np.where(missing, np.nan, rng.normal(size=(13, 17)))
    filled = spanned(heights, missing)
    assert np.array_equal(filled[~missing], heights[~missing])
    assert filled.min() >= np.nanmin(heights) - 1e-12
    assert filled.max() <= np.nanmax(heights) + 1e-12
    y, x = np.mgrid[:13, :17]
    inner = missing.copy()
    inner[[0, -1]] = inner[:, [0, -1]] = False
    assert spanned(2.0 * x - y, inner) == pytest.approx(2.0 * x - y, abs=1e-9)


@pytest.mark.parametrize(
    ("shape", "hint"),
    [
        ((160, 120), r"\(160, 120\).*transpose"),
        ((1, 120, 160), r"\(1, 120, 160\)"),
        ((480, 640), r"\(120, 160\)"),
        ((5,), "h.npy"),
    ],
)
def test_another_shape_is_refused(shape: tuple[int, ...], hint: str) -> None:
    with pytest.raises(OutOfDomain, match=hint):
        given_heights(np.zeros(shape), SENSOR, "object", "h.npy")


def test_a_gel_that_only_bulges_has_its_sign_the_wrong_way() -> None:
    with pytest.raises(OutOfDomain, match=r"-\d.* mm.*sign"):
        given_heights(-bump(1e-3), SENSOR, "gel", "h.npy")
    given_heights(np.zeros((120, 160)), SENSOR, "gel", "h.npy")


def test_what_is_no_array_of_heights_is_refused(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"absent\.npy"):
        read_heights(tmp_path / "absent.npy", SENSOR)
    (tmp_path / "h.png").touch()
    with pytest.raises(DataRefused, match=r"\.npy"):
        read_heights(tmp_path / "h.png", SENSOR)
    (tmp_path / "h.npy").write_bytes(b"")
    with pytest.raises(DataRefused, match=r"h\.npy .*archive|h\.npy .*read"):
        read_heights(tmp_path / "h.npy", SENSOR)
    for array in (np.zeros((120, 160), np.uint8), np.zeros((120, 160), np.complex128)):
        with pytest.raises(DataRefused, match="floating-point"):
            read_heights(written(tmp_path, array), SENSOR)
    with pytest.raises(DataRefused, match=r"h\.npy.*read"):
        read_heights(written(tmp_path, np.array([{"a": 1}], dtype=object)), SENSOR)
