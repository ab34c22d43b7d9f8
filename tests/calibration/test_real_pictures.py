"""Real presses beside what is drawn of them by a calibration that has not seen them."""

from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest

from harness.sim.optics.optics import Optics
from tests.samples.real_press import R15, drawing, fitted, held_out_presses, judged, set_of


@pytest.mark.slow  # measured data that do not change
def test_presses_of_the_papers_sensor_are_drawn_over_the_whole_frame(shared_data: Path) -> None:
    """One fold of eight; all of them by ``tests/benchmarks/touch/real_pictures.py``. Over a frame most of
    which is never touched, drawing nothing scores 24 dB; within the contact it scores 14."""
    pictures = set_of(shared_data, "r15")
    first: list[object] = []

    def of_one_fold(press: object) -> bool:
        first.append(press.model)  # type: ignore[attr-defined]
        return first[0] is first[-1]

    frame, contact, nothing = [], [], []
    for press in takewhile(of_one_fold, held_out_presses(pictures, R15)):
        skirt = press.calibration.header.skirt
        drawn = fitted(press, drawing(Optics(press.calibration, "smooth"), skirt), skirt)
        frame.append(drawn.frame)
        contact.append(drawn.contact)
        nothing.append(judged(press, pictures.background.astype(float), drawn.pose).frame)
    assert len(frame) == 7
    assert np.median(frame) >= 33.0
    assert np.median(contact) >= 31.0
    assert np.median(nothing) < 25.0
