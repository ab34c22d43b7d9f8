"""``touchstone sim touch`` on the pictures that Taxim publishes with their height maps."""

from pathlib import Path

import numpy as np
import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.picture.image_file import read_image, write_png
from harness.sim.optics.kernels import change_exactly
from harness.sim.optics.published_pack import read_published, read_table
from tests.support.touch_command import answered, saved

TAXIM_PITCH = 0.0295e-3


@pytest.mark.parametrize(("known", "wanted"), [("cylinder6", "square"), ("square", "cylinder6")])
def test_one_published_picture_predicts_the_other(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], known: str, wanted: str
) -> None:
    """Taxim's pictures, on an untouched gel that the other one gives; JPEG allows about 49 dB."""
    lab, results = (shared_data / "tactile/taxim" / name for name in ("gelsight_lab", "published_results"))
    rest = measured_dome(lab)
    write_png(tmp_path / "untouched.png", untouched(lab, results, known, rest))
    words = (
        *("--height", saved(tmp_path, pressed(results, wanted, rest)), "--heights-of", "gel"),
        *("--sensor", "taxim-gelsight", "--calibration", lab, "--background", tmp_path / "untouched.png"),
        *("--no-shadow", "--level", "touch.optics=exact", "--live", results / f"{wanted}_sim.jpg"),
    )
    answer = answered(capsys, tmp_path, *words)
    assert answer["live"]["simulated"]["psnr_db"] >= 47.5
    assert answer["live"]["background"]["psnr_db"] < 31.0
    assert answer["deepest_m"] == pytest.approx(1e-3)
    assert answer["flags"]["out_of_domain_share"] is None  # the published table does not say


def measured_dome(lab: Path) -> FloatArray:
    rest = read_published(lab, TAXIM_PITCH, np.zeros((480, 640, 3), np.uint8)).rest
    assert rest is not None
    return rest


def pressed(results: Path, name: str, rest: FloatArray) -> FloatArray:
    """Metres of indentation: the published pixels less the untouched gel, 1 mm at the deepest."""
    above = np.load(results / f"{name}_height.npy").astype(np.float64) * TAXIM_PITCH - rest
    return np.asarray(above - above.max() + 1e-3)


def untouched(lab: Path, results: Path, name: str, rest: FloatArray) -> ByteArray:
    """A published picture less what its surface adds, and with what the untouched dome does."""
    table, grid = read_table(lab / "polycalib.npz"), 2.0**20
    dome, surface = np.empty((480, 640, 3)), np.empty((480, 640, 3))
    change_exactly(np.rint(rest / TAXIM_PITCH * grid) / grid, table, dome)
    change_exactly(np.load(results / f"{name}_height.npy").astype(np.float64), table, surface)
    seen = read_image(results / f"{name}_sim.jpg").astype(np.float64)
    return np.asarray(np.clip(np.rint(seen - surface + dome), 0, 255), dtype=np.uint8)


@pytest.mark.parametrize("name", ["cylinder6", "square"])
def test_shadows_bring_a_picture_nearer_to_the_published_one(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    """The published program blurs colours too, and drops most of the rim; ours does neither."""
    lab, results = (shared_data / "tactile/taxim" / part for part in ("gelsight_lab", "published_results"))
    rest = measured_dome(lab)
    write_png(tmp_path / "untouched.png", untouched(lab, results, name, rest))
    surface = pressed(results, name, rest)
    words = (
        *("--height", saved(tmp_path, surface), "--heights-of", "gel", "--level", "touch.optics=exact"),
        *("--reached", saved(tmp_path, np.where(surface > 0.88e-3, surface, 0.0), "reached.npy")),
        *("--sensor", "taxim-gelsight", "--calibration", lab, "--background", tmp_path / "untouched.png"),
        *("--live", results / f"{name}_shadow.jpg"),
    )
    with_them, without = (answered(capsys, tmp_path, *words, *more) for more in ((), ("--no-shadow",)))
    assert with_them["live"]["simulated"]["psnr_db"] > 45.0
    assert with_them["live"]["simulated"]["psnr_db"] > without["live"]["simulated"]["psnr_db"] + 2.0
    assert with_them["flags"]["shadow_out_of_table_share"] > 0.5
    assert without["flags"]["shadow_out_of_table_share"] is None
