"""Where everything of a build lies in its folder."""

from dataclasses import dataclass
from pathlib import Path

from harness.objectfile.entries import Modality


@dataclass(frozen=True)
class BuildFolder:
    """The folder of a build.

    Attributes:
        folder: that all workers see under the same path.
        shared_stages: folder of stages that several builds share; None for one of this build's own.
    """

    folder: Path
    shared_stages: Path | None = None

    @property
    def stages(self) -> Path:
        """Results by the hash of what they were computed from."""
        return self.shared_stages or self.folder / "stages"

    @property
    def arrays(self) -> Path:
        """Tetrahedra and modes."""
        return self.stages / "arrays"

    @property
    def aside(self) -> Path:
        """What is being written; on the same file system as ``stages`` and ``folder`` must be."""
        return self.folder / "aside"

    @property
    def lock(self) -> Path:
        """Held by the program that builds."""
        return self.folder / "build.lock"

    @property
    def settings(self) -> Path:
        """The settings of the last build, for status and page."""
        return self.folder / "build.json"

    def stage(self, sense: Modality, key: str) -> Path:
        """The folder of one sense of one object."""
        return self.stages / sense / key[:2] / key

    def object(self, name: str) -> Path:
        """An ObjectFile."""
        return self.folder / "objects" / name

    def record(self, name: str) -> Path:
        """How an object was built."""
        return self.folder / "records" / f"{name}.json"

    def log(self, name: str) -> Path:
        """What programs printed while an object was built."""
        return self.folder / "logs" / f"{name}.txt"

    def failed(self, name: str) -> Path:
        """The record and the log of an object that could not be built."""
        return self.folder / "failed" / name

    def prepare(self) -> None:
        """Make the folders that must be there."""
        for name in ("objects", "records", "logs", "failed", "aside"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        self.arrays.mkdir(parents=True, exist_ok=True)
