"""Results of commands on ObjectFiles with published networks of third parties."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from harness.basics.result import HIDDEN, JSON_ONLY, Result
from harness.objectfile.published.answers import AnsweredQueries
from harness.objectfile.published.entries import PublishedObject
from harness.tasks.objects import describe_object


@dataclass(frozen=True)
class NetworkFile:
    """The file of a network."""

    file: str
    bytes: int


@dataclass(frozen=True)
class ImportedObject(Result):
    """A published object, imported into a folder."""

    folder: Path
    object: str = field(metadata=JSON_ONLY)  #: name of the object.
    format: str = field(metadata=JSON_ONLY)
    sha256: str | None = field(metadata=JSON_ONLY)  #: SHA-256 of the published file.
    licence: str = field(metadata=JSON_ONLY)
    networks: Mapping[str, NetworkFile] = field(metadata=JSON_ONLY)  #: networks by sense.
    missing: tuple[str, ...] = field(metadata=JSON_ONLY)  #: missing contents of the file, one sentence each.
    dropped: Mapping[str, int] = field(metadata=JSON_ONLY)  #: number of unused weights by layer.
    lines: tuple[str, ...] = field(metadata=HIDDEN)

    @classmethod
    def of(cls, made: PublishedObject) -> "ImportedObject":
        """Describe an imported object."""
        known = made.description
        return cls(
            folder=made.folder,
            object=known.name,
            format=known.format,
            sha256=known.provenance.sources[0].sha256,
            licence=known.provenance.licence,
            networks={sense: NetworkFile(entry.file, entry.bytes) for sense, entry in known.networks.items()},
            missing=known.missing,
            dropped=known.dropped,
            lines=tuple(describe_object(known)),
        )

    def summary(self) -> tuple[str, ...]:
        """List the source, and the missing contents of the file."""
        return self.lines


@dataclass(frozen=True)
class RenderedQueries(Result):
    """The answers to ObjectFolder's query files."""

    folder: Path  #: folder of the ObjectFile.
    object: str  #: name of the object.
    objectfolder_compat: bool
    files: Mapping[str, tuple[Path, ...]] = field(metadata=JSON_ONLY)  #: written files by sense.
    full_scale: float | None  #: full scale of the sounds; None if each has its own.
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    seconds: Mapping[str, float]

    @classmethod
    def of(cls, folder: Path, name: str, compat: bool, found: AnsweredQueries) -> "RenderedQueries":
        """Describe the answers of an object."""
        files = {sense: tuple(paths) for sense, paths in found.files.items()}
        return cls(folder, name, compat, files, found.full_scale, tuple(found.notes), found.seconds)

    def summary(self) -> tuple[str, ...]:
        """List the files of each sense."""
        return tuple(
            f"{sense}: {len(paths)} files, {paths[0]} and so on" for sense, paths in self.files.items()
        )
