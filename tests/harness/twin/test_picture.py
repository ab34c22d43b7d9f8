"""A picture where the machine can draw one, else the reason; never neither."""

import numpy as np
import pytest

from harness.basics.geometry import translation
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.twin import picture as drawing
from harness.twin.bench import TwinBench
from harness.twin.picture import View, picture

HOME = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])


@pytest.fixture(scope="module")
def bench() -> TwinBench:
    pose = translation(np.array([-0.42, 0.0, 0.25]))
    return TwinBench("ur5e", translation(np.array([0, 0, 0.12])), GELSIGHT_R15, build("mug", 6e-3), pose)


def test_the_red_object_is_in_the_picture_or_the_reason_is_given(bench: TwinBench) -> None:
    drawn = picture(bench, HOME, View(width=320, height=180))
    if drawn.image is None:
        pytest.skip(drawn.reason)
    assert drawn.image.shape == (180, 320, 3)
    red, green, _ = np.moveaxis(drawn.image.astype(int), -1, 0)
    assert (red - green > 60).sum() > 50


def test_a_machine_that_cannot_draw_says_what_to_install(
    bench: TwinBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drawing, "BACKENDS", ("no-such-backend",))
    drawn = picture(bench, HOME, View(width=64, height=48))
    assert drawn.image is None
    assert "no-such-backend" in drawn.reason
    assert "libegl1" in drawn.reason
