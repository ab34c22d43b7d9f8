"""What a killed program leaves in the temporary folder is removed at the next start; what lives is left."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivers.ur.session import lock_path, remove_ownerless, take_arm
from harness.basics.errors import BenchFault
from harness.basics.files import lock_file
from harness.bench.mock_lab import OwnedFolder

ADDRESS = "127.9.8.7"
OWNER = """
import sys, time
from pathlib import Path
from drivers.ur.session import take_arm
from harness.bench.mock_lab import OwnedFolder
parent = Path(sys.argv[1])
folder = OwnedFolder("touchstone-lab-", parent)
(folder.path / "lab.log").write_text("ready")
lock = take_arm(sys.argv[2], parent)
print(folder.path, flush=True)
time.sleep(600)
"""

Kill = Callable[[], None]


@pytest.fixture
def owner(tmp_path: Path) -> Iterator[tuple[Path, Kill]]:
    """A program with a folder and an arm: the folder, and what kills it with -9."""
    process = subprocess.Popen(
        [sys.executable, "-c", OWNER, str(tmp_path), ADDRESS],
        stdout=subprocess.PIPE,
        text=True,
    )

    def kill() -> None:
        process.kill()
        process.wait()

    assert process.stdout is not None
    yield Path(process.stdout.readline().strip()), kill
    kill()
    process.stdout.close()


def test_the_folder_of_a_killed_program_is_removed_at_the_next_start(
    owner: tuple[Path, Kill], tmp_path: Path
) -> None:
    folder, kill = owner
    kill()
    assert (folder / "lab.log").exists()
    mine = OwnedFolder("touchstone-lab-", tmp_path)
    assert not folder.exists()
    assert mine.path.is_dir()
    mine.close()
    mine.close()
    assert not mine.path.exists()


def test_the_folder_of_a_living_program_stays(owner: tuple[Path, Kill], tmp_path: Path) -> None:
    OwnedFolder("touchstone-lab-", tmp_path).close()
    assert (owner[0] / "lab.log").read_text() == "ready"


def test_what_is_not_a_held_folder_stays(tmp_path: Path) -> None:
    """One that is just being made, one of another kind, a file, a link to elsewhere."""
    being_made = tmp_path / "touchstone-lab-new"
    other = tmp_path / "touchstone-other"
    elsewhere = tmp_path / "elsewhere"
    for folder in (being_made, other, elsewhere):
        folder.mkdir()
    for folder in (other, elsewhere):
        (folder / "owner.lock").touch()
    (tmp_path / "touchstone-lab-file").touch()
    (tmp_path / "touchstone-lab-link").symlink_to(elsewhere)
    before = sorted(tmp_path.rglob("*"))
    OwnedFolder("touchstone-lab-", tmp_path).close()
    assert sorted(tmp_path.rglob("*")) == before


def test_a_lock_keeps_others_out_until_its_owner_is_killed(owner: tuple[Path, Kill], tmp_path: Path) -> None:
    _, kill = owner
    with pytest.raises(BenchFault, match=r"process \d+, .*127\.9\.8\.7"):
        take_arm(ADDRESS, tmp_path)
    kill()
    descriptor = take_arm(ADDRESS, tmp_path)
    with pytest.raises(BenchFault, match=r"lock .*127\.9\.8\.7"):
        take_arm(ADDRESS, tmp_path)
    os.close(descriptor)
    os.close(take_arm(ADDRESS, tmp_path))


def test_lock_files_of_the_dead_are_removed_and_those_of_the_living_stay(
    owner: tuple[Path, Kill], tmp_path: Path
) -> None:
    _, kill = owner
    remove_ownerless(tmp_path)
    assert lock_path(ADDRESS, tmp_path).exists()
    kill()
    assert lock_path(ADDRESS, tmp_path).exists()
    other = lock_path("127.9.8.6", tmp_path)
    descriptor = take_arm("127.9.8.6", tmp_path)
    os.close(descriptor)
    assert sorted(tmp_path.glob("*.lock")) == [other]


def test_a_lock_taken_while_its_file_is_removed_is_taken_on_the_new_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = lock_path(ADDRESS, tmp_path)
    locked, left = lock_file._lock, [path]

    def locked_once_removed(descriptor: int) -> bool:
        if left:
            left.pop().unlink()
        return locked(descriptor)

    monkeypatch.setattr(lock_file, "_lock", locked_once_removed)
    descriptor = take_arm(ADDRESS, tmp_path)
    with pytest.raises(BenchFault, match=r"lock .*127\.9\.8\.7"):
        take_arm(ADDRESS, tmp_path)
    os.close(descriptor)
