"""Where the real data is."""

import os
from pathlib import Path

BESIDE = Path(__file__).parents[3] / "shared" / "data"
WHY_NOT = "real data not found: put it at ../shared/data or name its folder in TOUCHSTONE_DATA"


def find_shared_data() -> Path | None:
    """The folder of real data, from TOUCHSTONE_DATA or beside the checkout; None where absent."""
    named = os.environ.get("TOUCHSTONE_DATA")
    folder = Path(named) if named else BESIDE
    return folder if (folder / "MANIFEST.md").exists() else None
