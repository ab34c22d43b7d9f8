"""Every command that reads a file, given files that nothing can be made of: one sentence, one JSON object.

A sample of commands x files runs with every change; all of them with ``make slow``.
"""

import json
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import cv2
import numpy as np
import pytest

from harness.basics.materials import MATERIALS
from harness.bench.scene import scene_from_options
from harness.cli import SYSTEM, UNFORESEEN, invoke
from harness.effects.scene_object import known_object
from harness.objectfile.audio.part import with_audio
from harness.objectfile.entries import Provenance
from harness.objectfile.file import create_object
from tests.samples.object_bench import egg_part
from tests.support.hostile_files import NAMES, make_hostile_files

STEEL = ("--material", "steel", "--units", "mm")

PLACE = ("--contact", "0.04", "0", "0.05", "--depth", "1mm")
CAMERA = ("--camera", "0.3", "0", "0.1")

USES: dict[str, tuple[str, ...]] = {
    "run --scene": ("run", "--scene", "FILE"),
    "run --object": ("run", "--object", "FILE", *STEEL),
    "run --resume": ("run", "--resume", "FILE"),
    "run --station": ("run", "--object", "builtin:mug", "--station", "FILE"),
    "run --gap": ("run", "--object", "builtin:mug", "--gap", "FILE"),
    "replay": ("replay", "FILE"),
    "explain": ("explain", "FILE"),
    "check --station": ("check", "--station", "FILE"),
    "mock-lab --scene": ("mock-lab", "--scene", "FILE"),
    "mock-lab --object": ("mock-lab", "--object", "FILE", *STEEL),
    "depth": ("depth", "FILE", "--calibration", "gelsight_r15_bench", "--out", "OUT.npz"),
    "depth --background": (
        *("depth", "GREY.png", "--background", "FILE", "--calibration", "gelsight_r15_bench"),
        *("--out", "OUT.npz"),
    ),
    "depth --calibration": ("depth", "GREY.png", "--calibration", "FILE", "--out", "OUT.npz"),
    "cost vision": ("cost vision", "FILE", "--units", "mm", "--out", "OUT"),
    "cost --scene": ("cost contact-localization", "--scene", "FILE", "--out", "OUT"),
    "object build": ("object build", "FILE", *STEEL, "--out", "OUT"),
    "object build touch --sensor": (
        *(
            "object build",
            "builtin:mug",
            "--only",
            "touch",
            "--material",
            "steel",
            "--sensor",
            "FILE",
            "--out",
            "OUT",
        ),
    ),
    "object info": ("object info", "FILE"),
    "object verify": ("object verify", "FILE"),
    "object import": ("object import", "FILE", "--out", "OUT"),
    "object view": ("object view", "FILE"),
    "object render audio": ("object render audio", "FILE", "--out", "OUT.wav"),
    "object render touch": ("object render touch", "FILE", *PLACE, "--out", "OUT.png"),
    "object render vision": ("object render vision", "FILE", "--out", "OUT.png"),
    "object render queries": (
        *("object render queries", "OBJECT", "--audio-vertices", "FILE", "--audio-forces", "FILE"),
        *("--out", "OUT"),
    ),
    "object compare vision": (
        "object compare vision",
        "FILE",
        "--live",
        "GREY.png",
        *CAMERA,
        "--out",
        "OUT.png",
    ),
    "calibrate taxim": ("calibrate taxim", "FILE", "--ball-radius", "2 mm", "--out", "OUT.npz"),
    "calibrate taxim --scene": (
        *("calibrate taxim", "--scene", "FILE", "--station", "mock", "--ball-radius", "2 mm"),
    ),
    "calibrate markers": ("calibrate markers", "FILE", "--out", "OUT.json"),
    "sim modes": ("sim modes", "FILE", *STEEL),
    "sim touch": ("sim touch", "FILE", "--units", "mm", *PLACE, "--out", "OUT.png"),
    "sim touch --height": ("sim touch", "--height", "FILE", "--out", "OUT.png"),
    "sim touch --sensor": ("sim touch", "builtin:mug", "--sensor", "FILE", "--out", "OUT.png"),
    "sim touch --calibration": ("sim touch", "builtin:mug", "--calibration", "FILE", "--out", "OUT.png"),
    "sim touch --markers": ("sim touch", "builtin:mug", "--markers", "FILE", "--out", "OUT.png"),
    "sim touch --force-table": (
        *("sim touch", "builtin:mug", *PLACE, "--force", "--force-table", "FILE", "--out", "OUT.png"),
    ),
}

_PYTHONS_OWN = re.compile(
    r"Error\b|Exception|Traceback|Errno|NoneType|No module named|codec can|out of range|out of bounds|has no "
    r"attribute|Expecting|could not convert|invalid literal|cannot reshape|to unpack|allow_pickle|recursion|"
    r"division by zero|[Ii]nput should|lxml|charset|QH\d|cv2|error: \(-|dtype\(|buffer|unpack requires|"
    r"object is not|indices must be|subscriptable|not supported between|argument|magic|zipfile|"
    r"line \d+ column|\bchar \d+"
)
"""What only a programmer, or a library's own message, says."""

MOST_SECONDS = 30.0
MOST_BYTES = 2**30

EACH = 3
"""Files that the sample gives to a command."""


class TooSlow(BaseException):
    """Past every ``except Exception``."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Hostile files under ``hostile/``, and beside it what the commands need besides."""
    made = tmp_path_factory.mktemp("walk")
    make_hostile_files(made / "hostile")
    grey = np.random.default_rng(0).integers(100, 130, (120, 160, 3), dtype=np.uint8)
    cv2.imwrite(str(made / "GREY.png"), grey)
    mug = known_object(scene_from_options("builtin:mug")).mesh
    of = create_object(made / "OBJECT", "mug", mug, MATERIALS["ceramic"], Provenance(licence="CC0-1.0"))
    with_audio(of, egg_part(mug))
    return made


@contextmanager
def bounded() -> Iterator[None]:
    """Ends what takes more than ``MOST_SECONDS``, and fails where ``MOST_BYTES`` more were held at once."""

    def end(_signal: int, _frame: FrameType | None) -> None:
        raise TooSlow

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, MOST_SECONDS)
    Path("/proc/self/clear_refs").write_text("5")
    held = _peak()
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert _peak() - held < MOST_BYTES


def _peak() -> int:
    """Bytes of the greatest resident memory since it was last forgotten."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if "VmHWM" in line)
    return 1024 * int(line.split()[1])


Walk = Callable[[str, str], None]


@pytest.fixture
def walk(folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Walk:
    """One command with one file, held to what every command owes."""
    monkeypatch.chdir(folder)

    def step(use: str, name: str) -> None:
        words = [word for part in USES[use] for word in (part.split() if part[0].islower() else [part])]
        arguments = [str(Path("hostile") / name) if word == "FILE" else word for word in words]
        link = (folder / "hostile" / name).is_symlink()
        before = set(folder.rglob("*"))
        with bounded():
            code = invoke([*arguments, "--json"])
        captured = capfd.readouterr()
        answer = json.loads(captured.out)
        assert captured.out.count("\n") == 1
        assert "Traceback" not in captured.err
        assert code in ((2,) if name.startswith("absent") else (1, 2)), answer
        assert answer["exit_code"] == code
        assert answer["kind"] != UNFORESEEN
        named = (name.partition("\n")[0], str((folder / "hostile" / name).readlink()) if link else name)
        assert any(each in answer["error"] for each in (*named, "extra `author`")), answer["error"]
        assert not _PYTHONS_OWN.search(answer["error"]), answer["error"]
        assert set(folder.rglob("*")) == before, "a refused command leaves nothing behind"

    return step


def test_a_sample_of_commands_with_hostile_files(walk: Walk) -> None:
    for number, use in enumerate(USES):
        for place in range(EACH):
            walk(use, NAMES[(number * EACH + place) % len(NAMES)])


@pytest.mark.slow
@pytest.mark.parametrize("use", USES)
def test_a_command_with_every_hostile_file(walk: Walk, use: str) -> None:
    for name in NAMES:
        walk(use, name)


def test_there_are_enough_of_both() -> None:
    assert len(USES) >= 25
    assert len(NAMES) >= 20


def test_a_disk_that_is_full_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    heights = np.zeros((120, 160))
    heights[50:70, 70:90] = 5e-4
    np.save(tmp_path / "press.npy", heights)
    monkeypatch.chdir(tmp_path)
    for name in ("full.png", "full.npy"):
        (tmp_path / name).symlink_to("/dev/full")
    for outputs in (("--out", "full.png"), ("--out", "some.png", "--height-out", "full.npy")):
        code = invoke(["sim", "touch", "--height", "press.npy", *outputs, "--json"])
        answer = json.loads(capfd.readouterr().out)
        assert (code, answer["kind"]) == (1, SYSTEM)
        assert answer["error"] == "/dev/full: No space left on device"
