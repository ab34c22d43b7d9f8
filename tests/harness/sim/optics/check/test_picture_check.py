"""A picture that is not what the calibration was made of: corrected, refused, or inside its stated error."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from calibration.taxim.pictures import read_pictures
from harness.basics.arrays import AnyArray, ByteArray, FloatArray, block_means
from harness.basics.errors import DataRefused, PictureRefused
from harness.bench.sensor import GELSIGHT_R15
from harness.picture.image_file import read_image
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.optics.check.light import match_light
from harness.sim.optics.check.picture_check import checked_picture, require_within_gel
from harness.sim.optics.depth_reading import read_press
from harness.sim.optics.inverse import DRIFTING, STEADY
from harness.sim.optics.optics import Optics
from harness.sim.optics.tactile_calibration import shipped_calibration

Pair = tuple[ByteArray, ByteArray]
Fault = Callable[[ByteArray], AnyArray]

SAMPLES = Path(__file__).parents[4] / "samples/tactile_light"
"""A 4 mm ball pressed 0.599 mm deep, in several lights."""

BENCH = shipped_calibration("gelsight_r15_bench")
REST = BENCH.background
PITCH = GELSIGHT_R15.pitch


def _surface(i: float = 60.0, j: float = 80.0, radius: float = 4e-3, depth: float = 0.6e-3) -> FloatArray:
    y, x = (np.mgrid[:120, :160] - np.array([i, j])[:, None, None]) * PITCH
    ball = depth - radius + np.sqrt(np.maximum(radius**2 - x * x - y * y, 0.0))
    return np.asarray(deform(np.maximum(ball, 0.0)[None], R15_SKIRT)[0])


SURFACE = _surface()


def _byte(values: AnyArray) -> ByteArray:
    return np.clip(np.rint(values), 0.0, 255.0).astype(np.uint8)


def _noisy(picture: AnyArray, seed: int, noise: float = 1.0) -> ByteArray:
    return _byte(picture + np.random.default_rng(seed).normal(0.0, noise, picture.shape))


def _drawn(surface: FloatArray) -> Pair:
    """Press and rest as a camera gives them, by the colours of presses that the bench never saw."""
    seen = Optics(shipped_calibration("gelsight_r15_world"), "exact").render(surface[None]).images[0]
    return _noisy(seen, 1), _noisy(REST, 2)


PRESS, UNTOUCHED = _drawn(SURFACE)


def _scores(press: ByteArray, rest: ByteArray | None, surface: FloatArray = SURFACE) -> float:
    """Errors over stated deviations, rms over the contact; ``PictureRefused`` passes."""
    detection = DRIFTING if rest is None else STEADY
    read = read_press(press[None], BENCH, detection, rest, GELSIGHT_R15.gel_thickness)
    true = surface > 0.2 * surface.max()
    apart = (read.height - surface)[true] / read.sigma[true]
    return float(np.sqrt(np.mean(apart**2)))


def _refused(press: ByteArray, rest: ByteArray | None) -> str:
    with pytest.raises(PictureRefused) as refusal:
        checked_picture(press, BENCH, rest)
    return str(refusal.value)


def _turned(fault: Fault) -> Pair:
    return np.ascontiguousarray(fault(PRESS)), np.ascontiguousarray(fault(UNTOUCHED))


TURNS: dict[str, Fault] = {
    "mirrored": lambda picture: picture[:, ::-1],
    "upside down": lambda picture: picture[::-1],
    "half a turn": lambda picture: picture[::-1, ::-1],
    **{
        f"channels {order}": lambda picture, order=order: picture[..., list(order)]  # type: ignore[misc]
        for order in permutations(range(3))
        if order != (0, 1, 2)
    },
}


def test_a_press_as_the_calibration_was_made_is_not_touched() -> None:
    for rest in (None, UNTOUCHED):
        checked = checked_picture(PRESS, BENCH, rest)
        assert np.array_equal(checked.image, PRESS)
        assert (checked.gain == 1.0).all()
        assert len(checked.notes) == (rest is None)
    assert "--background" in checked_picture(PRESS, BENCH).notes[0]
    assert _scores(PRESS, UNTOUCHED) < 2.0


@pytest.mark.parametrize("fault", TURNS.values(), ids=TURNS)
def test_another_order_of_channels_or_orientation_is_refused(fault: Fault) -> None:
    press, rest = _turned(fault)
    assert "channel order" in _refused(press, rest)
    assert "fits its resting gel only with" in _refused(press, None)
    assert "fits its resting gel only with" in _refused(press, UNTOUCHED)


@pytest.mark.parametrize("fault", TURNS.values(), ids=TURNS)
def test_the_same_is_seen_by_the_slopes_of_a_gel_without_a_pattern(fault: Fault) -> None:
    """Evenly lit, the resting picture says nothing of the orientation; the press's own colours do."""
    even = replace(BENCH, background=np.full_like(REST, 120))
    press = _noisy(np.clip(120.0 + PRESS - REST.astype(np.float64), 0.0, 255.0), 3)
    checked_picture(press, even)
    with pytest.raises(PictureRefused, match=r"only with|pulled out"):
        checked_picture(np.ascontiguousarray(fault(press)), even)


WIDE: dict[str, dict[str, float]] = {
    "a ball that fills the window": {"radius": 40e-3, "depth": 1.0e-3},
    "the flank of a large ball": {"i": -10.0, "j": 60.0, "radius": 20e-3, "depth": 1.8e-3},
    "a deep ball": {"radius": 8e-3, "depth": 1.8e-3},
}


@pytest.mark.parametrize("surface", WIDE.values(), ids=WIDE)
def test_a_contact_that_fills_the_window_is_no_other_light_and_no_other_orientation(
    surface: dict[str, float],
) -> None:
    press, _ = _drawn(_surface(**surface))
    assert np.array_equal(checked_picture(press, BENCH).image, press)
    with suppress(PictureRefused):
        dim = checked_picture(_byte(0.7 * press.astype(np.float64)), BENCH)
        assert dim.gain == pytest.approx(np.full(3, 0.7), abs=0.03)
    for fault in TURNS.values():
        assert "fits its resting gel only with" in _refused(np.ascontiguousarray(fault(press)), None)


def test_press_and_rest_exchanged_are_refused() -> None:
    assert "pulled out" in _refused(UNTOUCHED, PRESS)


@pytest.mark.parametrize("gain", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("fresh", [True, False])
def test_a_dimmer_exposure_is_corrected(gain: float, fresh: bool) -> None:
    press, rest = _byte(gain * PRESS.astype(np.float64)), _byte(gain * UNTOUCHED.astype(np.float64))
    assert _scores(press, rest if fresh else None) < 2.0


@pytest.mark.parametrize("gain", [1.1, 1.2, 1.3, 1.5])
@pytest.mark.parametrize("fresh", [True, False])
def test_a_brighter_exposure_is_corrected_or_refused(gain: float, fresh: bool) -> None:
    press, rest = _byte(gain * PRESS.astype(np.float64)), _byte(gain * UNTOUCHED.astype(np.float64))
    with suppress(PictureRefused):
        assert _scores(press, rest if fresh else None) < 2.0
        return
    assert "255" in _refused(press, rest if fresh else None)


@pytest.mark.parametrize("gains", [(0.8, 1.0, 1.0), (1.0, 1.15, 0.8), (0.6, 0.9, 0.7)])
def test_another_white_balance_is_corrected(gains: tuple[float, float, float]) -> None:
    press, rest = (_byte(np.array(gains) * one.astype(np.float64)) for one in (PRESS, UNTOUCHED))
    for background in (rest, None):
        checked = checked_picture(press, BENCH, background)
        assert np.abs(checked.gain / gains - 1.0).max() < 0.05
        assert "corrected for it" in checked.notes[0]
    assert _scores(press, rest) < 2.0


@pytest.mark.parametrize("offset", [-20.0, -5.0, 5.0, 15.0])
def test_light_that_adds_is_no_gain(offset: float) -> None:
    press, rest = _byte(PRESS + offset), _byte(UNTOUCHED + offset)
    for background in (rest, None):
        assert _scores(press, background) < 2.0


SIDES: dict[str, tuple[slice, slice]] = {
    "top": (slice(0, 60), slice(None)),
    "bottom": (slice(60, None), slice(None)),
    "left": (slice(None), slice(0, 80)),
    "right": (slice(None), slice(80, None)),
    "a corner": (slice(0, 40), slice(0, 40)),
}


@pytest.mark.parametrize("side", SIDES.values(), ids=SIDES)
@pytest.mark.parametrize("left", [0.0, 0.3, 0.5])
def test_a_part_without_light_is_refused(side: tuple[slice, slice], left: float) -> None:
    dark = np.ones((120, 160, 1))
    dark[side] = left
    press, rest = _byte(PRESS * dark), _byte(UNTOUCHED * dark)
    for pair in ((press, UNTOUCHED), (press, None), (press, rest)):
        try:
            checked = checked_picture(*pair[:1], BENCH, pair[1])
        except PictureRefused:
            continue
        # A corner dark in both is small enough to be left alone: it is read as untouched.
        assert pair[1] is rest
        assert (checked.gain == 1.0).all()


@pytest.mark.parametrize("grey", [0, 60, 128, 255])
def test_a_frame_cut_short_is_refused(grey: int) -> None:
    cut = PRESS.copy()
    cut[90:] = grey
    for rest in (None, UNTOUCHED):
        _refused(cut, rest)


def test_no_light_and_no_picture_are_refused() -> None:
    black = np.zeros_like(PRESS)
    for pair in ((black, UNTOUCHED), (black, black), (black, None)):
        assert "lights are off" in _refused(*pair)
    noise = np.random.default_rng(0).integers(0, 256, PRESS.shape).astype(np.uint8)
    for rest in (None, UNTOUCHED):
        assert "noise" in _refused(noise, rest)
    _refused(np.full_like(PRESS, 255), None)


@pytest.mark.parametrize("pixels", [1.0, 2.0])
def test_out_of_focus_the_stated_deviations_hold(pixels: float) -> None:
    soft = _byte(gaussian_filter(PRESS.astype(np.float64), (pixels, pixels, 0.0)))
    assert _scores(soft, UNTOUCHED) < 2.0


def test_a_reading_deeper_than_its_gel_is_refused() -> None:
    deep = np.zeros((4, 5))
    deep[1, 2] = 2.9e-3
    require_within_gel(deep, np.full_like(deep, 0.45e-3), 2.5e-3)
    with pytest.raises(PictureRefused, match=r"2\.90 mm.* 2\.50 mm"):
        require_within_gel(deep, np.full_like(deep, 0.1e-3), 2.5e-3)


@pytest.mark.parametrize(("radius", "depth"), [(4e-3, 2.6e-3), (4e-3, 4e-3), (8e-3, 3.5e-3)])
def test_a_press_deeper_than_the_gel_is_refused_or_inside_its_error(radius: float, depth: float) -> None:
    surface = _surface(radius=radius, depth=depth)
    press, rest = _drawn(surface)
    with suppress(PictureRefused):
        assert _scores(press, rest, surface) < 2.0


def test_pictures_of_another_shape_are_refused() -> None:
    with pytest.raises(DataRefused, match=r"\(112, 160, 3\).*\(120, 160, 3\)"):
        checked_picture(PRESS[:-8], BENCH)
    with pytest.raises(DataRefused, match=r"\b152\b"):
        checked_picture(PRESS, BENCH, UNTOUCHED[:, :-8])


def _known_and_pressed() -> tuple[FloatArray, FloatArray]:
    known = block_means(REST, 4)
    change = np.zeros_like(known)
    change[8:20, 10:25] = 40.0
    return known, change


@pytest.mark.parametrize("gain", [0.8, 1.02, 1.3])
def test_a_gain_is_found_beside_a_contact(gain: float) -> None:
    known, change = _known_and_pressed()
    light = match_light(gain * known + change, known)
    assert light.name == "gain"
    assert light.is_known
    assert light.slope[0] == pytest.approx(np.full(3, gain), abs=1e-3)


def test_an_offset_a_gradient_and_no_change_of_the_light_are_told_apart() -> None:
    known, change = _known_and_pressed()
    right = np.linspace(-1.0, 1.0, 2 * known.shape[1] + 1)[1::2][None, :, None]
    assert match_light(known + change, known).name == "same"
    assert match_light(known + change + 5.0, known).offset == pytest.approx(np.full(3, 5.0), abs=0.01)
    uneven = match_light(known * (1.0 + 0.04 * right) + change, known)
    assert uneven.slope[1] == pytest.approx(np.full(3, 0.04), abs=1e-3)


@pytest.mark.parametrize(
    ("press", "rest", "says"),
    [
        ("press_bgr", "rest_bgr", "blue, green, red"),
        ("press_half", "rest", "frame was lost"),
        ("black", "rest", "lights are off"),
        ("rest", "press", "pulled out"),
    ],
)
def test_the_pictures_that_were_once_read_are_refused(press: str, rest: str, says: str) -> None:
    assert says in _refused(_case(press), _case(rest))


def _case(name: str) -> ByteArray:
    return read_image(SAMPLES / f"{name}.png")


def _depth(press: ByteArray, rest: ByteArray | None) -> float:
    """Return the deepest reading in m."""
    read = read_press(press[None], BENCH, DRIFTING if rest is None else STEADY, rest, 2.5e-3)
    return float(read.height.max())


@pytest.mark.parametrize("suffix", ["", "_dim", "_tv", "_ae2"])
@pytest.mark.parametrize("fresh", [True, False])
def test_a_ball_pressed_by_a_known_depth_is_read_in_any_light(suffix: str, fresh: bool) -> None:
    rest = _case(f"rest{suffix}") if fresh else None
    assert _depth(_case(f"press{suffix}"), rest) == pytest.approx(0.599e-3, abs=0.05e-3)


def _right(picture: FloatArray) -> FloatArray:
    return np.linspace(-0.5, 0.5, picture.shape[1])[None, :, None]


LIGHTS: dict[str, Callable[[FloatArray], AnyArray]] = {
    **{
        f"gain {gain}": lambda picture, gain=gain: gain * picture  # type: ignore[misc]
        for gain in (0.5, 0.98, 1.02, 1.05, 1.5)
    },
    **{
        f"white balance {gains}": lambda picture, gains=gains: picture * np.array(gains)  # type: ignore[misc]
        for gains in ((0.7, 1.1, 0.9), (1.02, 1.0, 1.0), (0.97, 1.0, 1.03))
    },
    **{
        f"offset {offset}": lambda picture, offset=offset: picture + offset  # type: ignore[misc]
        for offset in (-20.0, 5.0, 15.0)
    },
    **{
        f"gamma {gamma}": lambda picture, gamma=gamma: 255.0 * (picture / 255.0) ** gamma  # type: ignore[misc]
        for gamma in (0.45, 0.95, 1.1, 2.2)
    },
    "video levels": lambda picture: 16.0 + 219.0 / 255.0 * picture,
    **{
        f"gradient {share}": lambda picture, share=share: picture * (1.0 + share * _right(picture))  # type: ignore[misc]
        for share in (0.05, 0.1)
    },
    "vignette": lambda picture: picture * (1.0 - 0.2 * _right(picture) ** 2),
}


NAMED = ("255", "white balance", "gamma", "darker", "the light changed")
"""Words of refusals that name the light."""


COMMON = ("gain 0.5", "gain 0.98", "gain 1.02", "gain 1.05", "offset 5.0", "gradient 0.05")
"""Changes between the resting picture and the press that are corrected and never refused."""


@pytest.mark.parametrize("name", LIGHTS)
@pytest.mark.parametrize("both", [True, False])
def test_another_light_is_corrected_to_the_right_depth_or_refused(name: str, both: bool) -> None:
    light = LIGHTS[name]
    press, rest = (_case(name).astype(np.float64) for name in ("press", "rest"))
    seen, untouched = _byte(light(press)), _byte(light(rest) if both else rest)
    refused = ""
    try:
        assert _depth(seen, untouched) == pytest.approx(0.599e-3, abs=0.05e-3)
    except PictureRefused as refusal:
        refused = str(refusal)
    assert not refused or (any(word in refused for word in NAMED) and (both or name not in COMMON))


@pytest.mark.parametrize("gain", [0.7, 1.05, 1.2])
def test_another_light_is_no_contact(gain: float) -> None:
    rest = _case("rest")
    assert _depth(_byte(gain * rest.astype(np.float64)), rest) == 0.0


@pytest.mark.parametrize("gain", [1.02, 0.9])
@pytest.mark.parametrize(
    "ball",
    [
        {"depth": 0.05e-3},
        {"depth": 0.05e-3, "radius": 8e-3},
        {"i": 2.0, "depth": 0.5e-3},
        {"j": 158.0, "depth": 0.5e-3},
        {"radius": 15e-3, "depth": 1e-3},
        {"radius": 30e-3, "depth": 0.3e-3},
    ],
    ids=str,
)
def test_shallow_wide_and_border_contacts_are_read_in_another_exposure(
    ball: dict[str, float], gain: float
) -> None:
    surface = _surface(**ball)
    press, rest = _drawn(surface)
    assert _depth(_byte(gain * press.astype(np.float64)), rest) == pytest.approx(surface.max(), abs=0.05e-3)


@pytest.mark.parametrize("gain", [1.0, 1.03])
@pytest.mark.parametrize("tilt", [1.0, 3.0, 5.0, 7.0])
def test_a_tilted_plate_over_the_whole_view_is_refused(tilt: float, gain: float) -> None:
    surface = np.tan(np.radians(tilt)) * (np.mgrid[:120, :160][1] - 80.0) * PITCH + 1.2e-3
    press, rest = _drawn(surface)
    assert "white balance" in _refused(_byte(gain * press.astype(np.float64)), rest)


def test_a_wide_contact_is_read_in_the_same_light_where_its_shape_is_wanted_and_not_its_depth() -> None:
    """A ball of 60 mm whose contact fills the view: no gel at rest is left to tell the light by."""
    surface = _surface(radius=60e-3, depth=2.0e-3)
    press, rest = _drawn(surface)
    with pytest.raises(PictureRefused, match="white balance"):
        checked_picture(press, BENCH, rest)
    wide = checked_picture(press, BENCH, rest, allow_wide=True)
    np.testing.assert_array_equal(wide.gain, np.ones(3))
    assert any("the same light is assumed" in note for note in wide.notes)
    with pytest.raises(PictureRefused, match="white balance"):
        checked_picture(_byte(0.7 * press.astype(np.float64)), BENCH, rest, allow_wide=True)


@pytest.mark.parametrize("radius", [100e-3, 200e-3])
@pytest.mark.parametrize("gain", [1.0, 1.02, 0.9])
def test_a_flat_contact_over_the_whole_view_is_refused_or_within_its_deviation(
    radius: float, gain: float
) -> None:
    surface = _surface(radius=radius, depth=0.5e-3)
    press, rest = _drawn(surface)
    with suppress(PictureRefused):
        read = read_press(_byte(gain * press.astype(np.float64))[None], BENCH, STEADY, rest, 2.5e-3)
        at = read.deepest
        assert abs(read.height[at] - 0.5e-3) < 2.0 * read.sigma[at]
        assert read.sigma[at] > 0.1e-3


@pytest.fixture(scope="module")
def real_presses(shared_data: Path) -> ByteArray:
    """Every press that the calibration was made of."""
    return read_pictures(shared_data / "tactile/objectfolder_calibs").images


def test_no_real_press_is_refused(real_presses: ByteArray) -> None:
    for image in real_presses:
        assert np.array_equal(checked_picture(image, BENCH).image, image)
        checked_picture(image, BENCH, REST)


@pytest.mark.parametrize("fault", TURNS.values(), ids=TURNS)
def test_every_real_press_turned_is_refused(real_presses: ByteArray, fault: Fault) -> None:
    for image in real_presses[::24]:
        _refused(np.ascontiguousarray(fault(image)), None)
