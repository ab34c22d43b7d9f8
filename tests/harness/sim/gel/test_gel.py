"""The gel's skirt: OpenCV's own blur as the oracle, and what must hold of any gel."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.gel import R15_SKIRT, TAXIM_SKIRT, GelSkirt, deform, half_kernel, over_range, skirt_for


def _ball(rows: int, columns: int, radius: float, depth: float) -> FloatArray:
    y, x = np.mgrid[:rows, :columns] - np.array([rows / 2.2, columns / 1.9])[:, None, None]
    return np.asarray(np.maximum(0.0, depth * (1.0 - (x * x + y * y) / radius**2)))


def _as_taxim(pressed: FloatArray, skirt: GelSkirt) -> FloatArray:
    surface, core = pressed.copy(), pressed > skirt.core * pressed.max()
    for width in skirt.kernels:
        surface = np.asarray(cv2.GaussianBlur(surface, (width, width), 0))
        surface[core] = pressed[core]
    return np.asarray(cv2.GaussianBlur(surface, (skirt.final, skirt.final), 0), dtype=np.float64)


@pytest.mark.parametrize(
    ("skirt", "shape"), [(R15_SKIRT, (120, 160)), (TAXIM_SKIRT, (480, 640))], ids=["R1.5", "Taxim"]
)
def test_the_exact_level_is_the_original_construction(skirt: GelSkirt, shape: tuple[int, int]) -> None:
    pressed = _ball(*shape, radius=shape[0] / 4, depth=1e-3)
    assert np.abs(deform(pressed[None], skirt)[0] - _as_taxim(pressed, skirt)).max() < 1e-15


def test_the_fast_level_is_within_four_micrometres_of_it() -> None:
    step = np.zeros((480, 640))
    step[100:300, 200:500] = 1e-3
    for pressed in (step, _ball(480, 640, 130.0, 1e-3)):
        exact, fast = deform(pressed[None], TAXIM_SKIRT), deform(pressed[None], TAXIM_SKIRT, "fast")
        assert np.abs(exact - fast).max() < 4e-6


def test_an_untouched_gel_stays_untouched_to_the_bit() -> None:
    contacts = np.stack([np.zeros((40, 50)), _ball(40, 50, 10, 1e-3)])
    deformed = deform(contacts, R15_SKIRT)
    assert not deformed[0].any()
    assert deformed[1].any()


@settings(max_examples=25, deadline=None)
@given(scale=st.floats(0.1, 10.0), seed=st.integers(0, 2**32 - 1))
def test_twice_the_press_is_twice_the_gel_and_a_mirror_mirrors_it(scale: float, seed: int) -> None:
    pressed = np.maximum(0.0, np.random.default_rng(seed).normal(0, 1e-3, (1, 30, 37)))
    gel = deform(pressed, R15_SKIRT)
    assert np.allclose(deform(pressed * scale, R15_SKIRT), gel * scale, rtol=1e-9, atol=1e-18)
    assert np.allclose(deform(pressed[:, ::-1], R15_SKIRT), gel[:, ::-1], rtol=1e-9, atol=1e-18)
    assert np.allclose(deform(pressed.swapaxes(1, 2), R15_SKIRT), gel.swapaxes(1, 2), rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("width", [3, 5, 11, 21, 201])
def test_a_kernel_sums_to_one_as_opencvs(width: int) -> None:
    half = half_kernel(width)
    assert 2 * half.sum() - half[0] == pytest.approx(1.0, abs=1e-15)
    assert half == pytest.approx(cv2.getGaussianKernel(width, 0)[width // 2 :, 0], abs=1e-15)


def test_presses_beyond_the_gel_are_held_and_said() -> None:
    deep = np.stack([_ball(20, 20, 5, 3e-3), _ball(20, 20, 5, 1e-3)])
    held, beyond = over_range(deep, GELSIGHT_R15)
    assert held.max() == GELSIGHT_R15.gel_thickness
    assert beyond == pytest.approx([deep[0].max() - 2.5e-3, 0.0])


def test_what_is_no_penetration_is_refused() -> None:
    for bad in (-1e-9, np.nan, np.inf):
        with pytest.raises(OutOfDomain, match="penetration"):
            deform(np.full((1, 5, 5), bad), R15_SKIRT)
    with pytest.raises(OutOfDomain, match="odd"):
        half_kernel(4)


def test_a_skirt_keeps_its_metres_on_another_sensor() -> None:
    assert skirt_for(GELSIGHT_R15) == R15_SKIRT
