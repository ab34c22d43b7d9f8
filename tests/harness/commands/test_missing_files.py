"""A file or folder that is not there is wrong use, whichever command is told of it: exit code 2."""

from pathlib import Path

import pytest

from harness.cli import invoke

MUG = ("builtin:mug", "--contact", "-0.04", "0", "0.05", "--out", "t.png")
COMMANDS = (
    ("run", "--object", "absent.obj", "--material", "steel"),
    ("run", "--object", "builtin:mug", "--station", "absent.toml"),
    ("run", "--object", "builtin:mug", "--gap", "absent.toml"),
    ("run", "--object", "builtin:mug", "--objectfile", "absent"),
    ("run", "--resume", "absent"),
    ("replay", "absent"),
    ("explain", "absent.toml"),
    ("check", "--station", "absent.toml"),
    ("tables", "contact-localization", "--gap", "absent.toml"),
    ("depth", "absent.png", "--calibration", "gelsight_r15_bench", "--out", "d.npz"),
    ("depth", "absent.png", "--calibration", "absent.npz", "--out", "d.npz"),
    ("object", "build", "absent.obj", "--material", "steel", "--out", "o"),
    ("object", "build", "absent.obj", "--material", "steel", "--only", "touch", "--out", "o"),
    ("object", "build", "absent.obj", "--material", "steel", "--only", "vision", "--out", "o"),
    ("object", "info", "absent"),
    ("object", "verify", "absent"),
    ("object", "view", "absent"),
    ("object", "render", "audio", "absent", "--vertex", "1", "--out", "a.wav"),
    ("object", "render", "touch", "absent", "--contact", "0", "0", "0", "--out", "a.png"),
    ("object", "render", "vision", "absent", "--camera", "1", "0", "0", "--out", "a.png"),
    ("calibrate", "markers", "absent.png", "--out", "m.json"),
    ("calibrate", "taxim", "absent", "--ball-radius", "2mm", "--pitch", "0.03mm", "--out", "c.npz"),
    ("sim", "modes", "absent.obj", "--material", "steel"),
    ("sim", "modes", "absent.inp", "--material", "steel"),
    ("sim", "touch", "absent.obj", "--contact", "0", "0", "0", "--out", "t.png"),
    ("sim", "touch", "--height", "absent.npy", "--out", "t.png"),
    ("sim", "touch", *MUG, "--calibration", "absent.npz"),
    ("sim", "touch", *MUG, "--background", "absent.png"),
    ("sim", "touch", *MUG, "--markers", "absent.json"),
    ("sim", "touch", *MUG, "--objectfile", "absent"),
    ("cost", "vision", "absent.obj"),
)


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_what_is_not_there_is_wrong_use(
    words: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert invoke(list(words)) == 2
    assert "absent" in capsys.readouterr().err
