"""The page that turns an object, in a real browser where one is installed."""

from collections.abc import Iterator

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.live_view.server import LiveFrames
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.render import open_vision
from tests.samples.look_bench import box_file, told_look
from tests.support import browser
from tests.support.served_look import served

pytestmark = pytest.mark.skipif(browser.found() is None, reason="no Chromium or Chrome is installed")

MIDDLE = (300, 300)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[browser.Page]:
    folder = box_file(tmp_path_factory.mktemp("objects") / "box", told_look()).folder
    frames = LiveFrames("box", open_vision(ObjectFile.open(folder), 1))
    with served(frames) as server, browser.shown(server.url) as shown:
        yield shown


@pytest.fixture(autouse=True)
def begun_again(page: browser.Page) -> None:
    page.wait("start")
    page.tell("reset()")
    still(page)


def still(page: browser.Page) -> None:
    """Until what was asked for is shown."""
    page.wait("by('samples').textContent && !busy && view.complete")
    assert page.tell("by('error').textContent") == ""


def numbers(page: browser.Page, name: str) -> FloatArray:
    """``(3,)`` as the page says them."""
    return np.array([float(each) for each in page.tell(f"by('{name}').textContent").split(",")])


def test_it_shows_the_object_when_it_is_opened(page: browser.Page) -> None:
    assert page.tell("document.title") == "box"
    assert page.tell("view.naturalWidth") == 256


def test_a_drag_turns_the_eye_about_the_object_and_keeps_it_as_far(page: browser.Page) -> None:
    before, lamp = numbers(page, "camera"), numbers(page, "light")
    page.drag(MIDDLE, (100, 0), 10)
    still(page)
    after, centre = numbers(page, "camera"), 1e3 * np.array(page.tell("start.look_at"))
    one, other = before - centre, after - centre
    # A hundredth of a radian a pixel, about the object's z.
    turned = np.arctan2(one[0] * other[1] - one[1] * other[0], one[:2] @ other[:2])
    assert turned == pytest.approx(-1.0, abs=0.02)
    assert np.linalg.norm(other) == pytest.approx(np.linalg.norm(one), abs=1.5)
    assert after[2] == pytest.approx(before[2], abs=1.0)
    np.testing.assert_array_equal(numbers(page, "light"), lamp)


def test_a_drag_with_shift_turns_the_light_alone(page: browser.Page) -> None:
    before, lamp = numbers(page, "camera"), numbers(page, "light")
    page.drag(MIDDLE, (60, 0), 6, browser.SHIFT)
    still(page)
    np.testing.assert_array_equal(numbers(page, "camera"), before)
    turned = numbers(page, "light")
    assert np.linalg.norm(turned) == pytest.approx(1.0, abs=0.02)
    assert lamp[:2] @ turned[:2] / np.linalg.norm(lamp[:2]) ** 2 == pytest.approx(np.cos(0.6), abs=0.06)


def test_the_wheel_comes_nearer_along_the_same_line(page: browser.Page) -> None:
    before, centre = numbers(page, "camera"), 1e3 * np.array(page.tell("start.look_at"))
    x, y = MIDDLE
    said = page.tell("by('camera').textContent")
    page.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-200)
    page.wait(f"by('camera').textContent !== '{said}'")
    still(page)
    after = numbers(page, "camera")
    np.testing.assert_allclose(after - centre, np.exp(-0.2) * (before - centre), atol=1.5)


def test_a_size_is_drawn_when_it_is_chosen(page: browser.Page) -> None:
    page.tell("by('size').value = '128'; ask()")
    still(page)
    assert page.tell("view.naturalWidth") == 128


def test_what_is_refused_is_said_on_the_page(page: browser.Page) -> None:
    page.tell("eye.away = -1; start.field_of_view = 1000; ask()")
    page.wait("!busy")
    assert "field" in page.tell("by('error').textContent")
    page.tell("location.reload()")
