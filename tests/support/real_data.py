"""Find the real data."""

from pathlib import Path

from harness.experiment.subjects import find_data_folder

WHY_NOT = "real data not found: run `make data`, or name its folder in TOUCHSTONE_DATA"


def find_shared_data() -> Path | None:
    """Return the folder of real data; None if it is absent or its fetching did not end."""
    folder = find_data_folder()
    return folder if (folder / "MANIFEST.md").exists() else None
