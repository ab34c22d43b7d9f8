"""What a folder of a build holds: every object with its outcome, its modes and its quality."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from types import MappingProxyType

from harness.authoring.catalogue.layout import BuildFolder, ObjectRecord, read_record, read_settings, stands
from harness.basics.errors import TouchstoneError
from harness.objectfile.description import Description
from harness.objectfile.file import ObjectFile

QUALITY: Mapping[str, tuple[str, str, float]] = MappingProxyType({
    "gain_error_median": ("audio", "gain error, %", 1e2),
    "unseen_places_psnr_db_median": ("touch", "touch PSNR, dB", 1.0),
    "psnr_db": ("vision", "picture PSNR, dB", 1.0),
})  # fmt: skip
"""Of each sense the one number of its network's model card that stands for it: sense, heading, factor."""


@dataclass(frozen=True, eq=False)
class ObjectSummary:
    """One object of a build."""

    name: str  #: of the object.
    outcome: str  #: ``"built"``, ``"waiting"``, or why not.
    reason: str  #: where it is not built.
    record: ObjectRecord | None  #: of the last attempt; None where there was none.
    object: ObjectFile | None
    """an ObjectFile that stands, of this key or of an earlier one; None where there is none."""
    quality: Mapping[str, float] = field(default_factory=dict)
    """by the keys of ``QUALITY``, those that there are, in the units of their headings."""


def summaries(of: BuildFolder) -> list[ObjectSummary]:
    """Every object of the last build, in the catalogue's order.

    Raises:
        WrongUse: nothing was built into the folder.
    """
    return [_summary(of, name) for name in read_settings(of).names]


def _summary(of: BuildFolder, name: str) -> ObjectSummary:
    record = read_record(of, name)
    there: ObjectFile | None = None
    with suppress(TouchstoneError):
        there = ObjectFile.open(of.object(name))
    if record is None:
        return ObjectSummary(name, "waiting", "not built yet", None, there)
    if record.built and not stands(of, record, record.key):
        reason = "its files are not those that were built; build again"
        return ObjectSummary(name, "damaged", reason, record, None)
    quality = {} if there is None else _quality(there.description)
    return ObjectSummary(name, record.outcome, record.reason, record, there, quality)


def _quality(description: Description) -> dict[str, float]:
    measured = {sense: entry.measured for sense, entry in description.networks.items()}
    return {
        key: factor * measured[sense][key]
        for key, (sense, _, factor) in QUALITY.items()
        if key in measured.get(sense, {})
    }
