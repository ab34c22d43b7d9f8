"""Published calibrations: read as one of ours, the channels turned once, nothing guessed."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import ByteArray
from harness.basics.errors import CalibrationRefused, DataRefused, WrongUse
from harness.bench.sensor import described_sensor
from harness.sim.gel.gel import R15_SKIRT, TAXIM_SKIRT
from harness.sim.optics.known_gel import known_gel
from harness.sim.optics.optics import Optics
from harness.sim.optics.published_pack import PublishedPack, is_published, read_published

BINS, PITCH = 16, 0.1e-3


def blue_first() -> ByteArray:
    """An untouched gel of which each channel says its name, as ``cv2.imread`` would give it."""
    frame = np.empty((24, 32, 3), np.uint8)
    frame[..., 0], frame[..., 1], frame[..., 2] = 30, 20, 10
    return frame


def write_pack(folder: Path, **more: Any) -> Path:
    """A pack whose slopes add 3, 2 and 1 grey levels to blue, green and red."""
    folder.mkdir(exist_ok=True)
    table = np.zeros((BINS, BINS, 6))
    table[1:, :, 5] = 1.0
    np.savez(folder / "polycalib.npz", bins=BINS, grad_r=3 * table, grad_g=2 * table, grad_b=table)
    np.savez(folder / "dataPack.npz", f0=blue_first(), imgs=np.zeros((1, 2, 2, 3)))
    for name, array in more.items():
        np.save(folder / f"{name}.npy", array)
    return folder


def wedge() -> Any:
    return np.repeat(np.arange(32.0)[None], 24, axis=0)[None] * PITCH


def test_blue_first_is_turned_once(tmp_path: Path) -> None:
    pack = read_published(write_pack(tmp_path / "pack"), PITCH)
    assert (pack.calibration.background == [10, 20, 30]).all()
    drawn = Optics(pack.calibration, "exact").render(wedge()).images[0]
    assert (drawn == [11, 22, 33]).all()
    assert pack.rest is None
    assert pack.shadow is None


def test_it_claims_nothing_of_its_quality(tmp_path: Path) -> None:
    header = read_published(write_pack(tmp_path / "pack"), PITCH).calibration.header
    assert (header.pitch, header.held_out_db, header.held_out_table_db) == (PITCH, 0.0, 0.0)
    assert header.residual_rms == header.condition == np.inf
    assert header.slope_limit == 1.0


def test_a_background_of_ones_own_takes_the_place_of_the_packs(tmp_path: Path) -> None:
    folder = write_pack(tmp_path / "pack")
    fresh = np.full((24, 32, 3), 7, np.uint8)
    assert (read_published(folder, PITCH, fresh).calibration.background == 7).all()
    (folder / "dataPack.npz").unlink()
    assert (read_published(folder / "polycalib.npz", PITCH, fresh).calibration.background == 7).all()
    with pytest.raises(CalibrationRefused, match="--background"):
        read_published(folder, PITCH)


@pytest.mark.parametrize("shape", ["gelmap5", "depth_bg"])
def test_an_untouched_dome_is_the_background_to_the_bit(tmp_path: Path, shape: str) -> None:
    y, x = np.mgrid[:24, :32] - np.array([11.5, 15.5])[:, None, None]
    dome = np.sqrt(60.0**2 - x * x - y * y).astype(np.float32)
    pack = read_published(write_pack(tmp_path / "pack", **{shape: dome}), PITCH)
    assert pack.rest is not None
    towards = pack.rest[12, 16] > pack.rest[0, 0]
    assert towards == (shape == "depth_bg")  # Taxim's map grows the other way
    for level in ("exact", "fast"):
        optics = Optics(pack.calibration, level, pack.rest)
        assert np.array_equal(optics.render(np.zeros((1, 24, 32))).images[0], pack.calibration.background)


def test_a_flat_face_pressed_into_a_measured_dome_is_flat(tmp_path: Path) -> None:
    # What is left of its slope is rounding, and may not choose a direction of the table.
    folder = write_pack(tmp_path / "pack")
    table = np.zeros((BINS, BINS, 6))
    table[..., 5] = np.arange(BINS)
    np.savez(folder / "polycalib.npz", bins=BINS, grad_r=table, grad_g=table, grad_b=table)
    dome = np.random.default_rng(0).normal(100.0, 3.0, (24, 32))
    pack = PublishedPack(read_published(folder, PITCH).calibration, -dome * PITCH, None)
    assert pack.rest is not None
    pressed = (240.0 * PITCH - pack.rest - 33e-3)[None]
    drawn = Optics(pack.calibration, "exact", pack.rest).render(pressed).images[0].astype(int)
    flat = Optics(pack.calibration, "exact").render(np.zeros((1, 24, 32))).images[0]
    slope = Optics(pack.calibration, "exact", pack.rest)._base - Optics(pack.calibration, "exact")._base
    assert np.array_equal(drawn, np.clip(flat + np.rint(slope), 0, 255))


def test_objectfolders_background_is_the_untouched_gel_less_its_dome(shared_data: Path) -> None:
    """``real_bg.npy``, to which the paper's program adds the table's colours."""
    folder = shared_data / "tactile/objectfolder_calibs"
    pack = read_published(folder, 0.1245e-3)
    assert pack.rest is not None
    added_to = Optics(pack.calibration, "exact", pack.rest)._base[..., ::-1]
    assert np.abs(added_to - np.load(folder / "real_bg.npy")).max() < 1e-4  # the table in single precision


def test_what_the_files_do_not_say_is_asked_for(tmp_path: Path) -> None:
    folder = str(write_pack(tmp_path / "pack"))
    with pytest.raises(WrongUse, match=r"--pitch 0\.0295mm"):
        known_gel(None, folder)
    with pytest.raises(WrongUse, match=r"24 x 32 pixels of 0.1 mm.*--thickness"):
        known_gel(None, folder, pitch=PITCH)
    gel = known_gel(None, folder, pitch=PITCH, thickness=2e-3)
    assert (gel.sensor.rows, gel.sensor.columns, gel.sensor.pitch) == (24, 32, PITCH)
    assert (gel.sensor.gel_thickness, gel.sensor.casts_shadow) == (2e-3, False)
    with pytest.raises(WrongUse, match=r"0\.1245 mm.*0\.1 mm"):
        known_gel("gelsight-r1.5", folder, pitch=PITCH)
    with pytest.raises(DataRefused, match=r"24 x 32 pixels.*GelSight R1\.5"):
        known_gel("gelsight-r1.5", folder)


def test_taxims_and_objectfolders_folders_are_their_own_sensors(shared_data: Path) -> None:
    lab = shared_data / "tactile/taxim/gelsight_lab"
    black = np.zeros((480, 640, 3), np.uint8)
    taxim = known_gel(None, str(lab), pitch=0.0295e-3, background=black)
    assert taxim.sensor == replace(described_sensor("taxim-gelsight").sensor, casts_shadow=True)
    assert taxim.calibration.header.skirt == TAXIM_SKIRT
    assert not known_gel("taxim-gelsight", str(lab), background=black, shadow=False).sensor.casts_shadow
    paper = known_gel(None, str(shared_data / "tactile/objectfolder_calibs"), pitch=0.1245e-3)
    assert paper.sensor == described_sensor("gelsight-r1.5").sensor
    assert paper.calibration.header.skirt == R15_SKIRT
    assert paper.rest is not None


def test_what_is_no_pack_is_refused(tmp_path: Path) -> None:
    folder = write_pack(tmp_path / "pack")
    assert is_published(folder)
    assert is_published(folder / "polycalib.npz")
    assert not is_published(tmp_path)
    with pytest.raises(CalibrationRefused, match="pitch"):
        read_published(folder, 0.0)
    np.save(folder / "gelmap5.npy", np.zeros((5, 5)))
    with pytest.raises(CalibrationRefused, match=r"gelmap5\.npy"):
        read_published(folder, PITCH)
    (folder / "gelmap5.npy").unlink()
    cases: list[tuple[str, dict[str, Any]]] = [
        ("has no", {"bins": BINS}),
        (r"\(3, 3, 6\)", dict.fromkeys(("grad_r", "grad_g", "grad_b"), np.zeros((3, 3, 6))) | {"bins": BINS}),
        (
            "polycalib.npz .*finite",
            dict.fromkeys(("grad_r", "grad_g", "grad_b"), np.full((2, 2, 6), np.nan)) | {"bins": 2},
        ),
    ]
    for words, arrays in cases:
        np.savez(folder / "polycalib.npz", **arrays)
        with pytest.raises(CalibrationRefused, match=words):
            read_published(folder, PITCH)
    write_pack(folder)
    np.savez(folder / "dataPack.npz", f0=np.zeros((24, 32)))
    with pytest.raises(CalibrationRefused, match=r"dataPack\.npz: f0"):
        read_published(folder, PITCH)
    np.save(folder / "array.npy", np.zeros(3))
    for content in (b"no archive", (folder / "array.npy").read_bytes()):
        (folder / "dataPack.npz").write_bytes(content)
        with pytest.raises(CalibrationRefused, match=r"dataPack\.npz"):
            read_published(folder, PITCH)
