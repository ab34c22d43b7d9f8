"""Pictures on disk are what was in memory, and pictures compared are compared where it is said."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.picture.image_file import read_image, write_png
from harness.picture.image_metrics import mean_square, psnr


def test_a_picture_reads_back_and_red_is_red(tmp_path: Path) -> None:
    image = np.random.default_rng(0).integers(0, 256, (7, 9, 3)).astype(np.uint8)
    write_png(tmp_path / "a.png", image)
    assert np.array_equal(read_image(tmp_path / "a.png"), image)
    red = np.zeros((4, 5, 3), np.uint8)
    red[..., 0] = 255
    write_png(tmp_path / "red.png", red)
    seen = cv2.imread(str(tmp_path / "red.png"))
    assert seen is not None
    assert (seen == [0, 0, 255]).all()  # OpenCV's own order is blue first


def test_what_is_no_picture_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    with pytest.raises(WrongUse, match=r"a\.png"):
        read_image(path)
    for content in (b"", b"not a picture"):
        path.write_bytes(content)
        with pytest.raises(DataRefused, match=r"\d+ bytes"):
            read_image(path)
    for other in (np.zeros((4, 5), np.uint8), np.zeros((4, 5, 4), np.uint8), np.zeros((4, 5, 3), np.uint16)):
        cv2.imwrite(str(path), other)
        with pytest.raises(DataRefused, match="8 bits"):
            read_image(path)


def test_psnr_is_of_the_pixels_that_count() -> None:
    black, grey = np.zeros((4, 6, 3), np.uint8), np.zeros((4, 6, 3), np.uint8)
    grey[:, :3] = 10
    left = np.zeros((4, 6), np.bool_)
    left[:, :3] = True
    assert mean_square(black, grey) == 50.0
    assert mean_square(black, grey, left) == 100.0
    assert psnr(black, grey, left) == pytest.approx(10 * np.log10(255**2 / 100))
    assert psnr(black, grey, ~left) == np.inf
    assert psnr(grey, black) == psnr(black, grey)


def test_pictures_that_cannot_be_compared_are_refused() -> None:
    picture = np.zeros((4, 6, 3), np.uint8)
    with pytest.raises(OutOfDomain, match=r"\(3, 6"):
        psnr(picture, picture[:3])
    with pytest.raises(OutOfDomain, match=r"\(4, 6, 3\) and \(4, 6, 3\)"):
        psnr(picture, picture, np.ones((3, 6), np.bool_))
    with pytest.raises(OutOfDomain, match="no pixel"):
        psnr(picture, picture, np.zeros((4, 6), np.bool_))
