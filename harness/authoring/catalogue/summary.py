"""What a folder of a build holds: every object with its outcome, its modes and its quality."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from types import MappingProxyType

from harness.authoring.catalogue.layout import BuildFolder, ObjectRecord, read_record, read_settings, stands
from harness.basics.errors import TouchstoneError
from harness.basics.result import HIDDEN, JSON_ONLY
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

    name: str  #: name of the object.
    outcome: str  #: ``"built"``, ``"waiting"``, or the reason why not.
    reason: str = field(metadata=JSON_ONLY)  #: reason why the object is not built.
    record: ObjectRecord | None = field(metadata=HIDDEN)  #: the last attempt; None if there was none.
    object: ObjectFile | None = field(metadata=HIDDEN)
    """an ObjectFile that stands, of this key or of an earlier one; None where there is none."""
    attempts: int
    seconds: float | None  #: duration of the last attempt; None if there was none.
    modes: int | None  #: number of modes; None without sound.
    quality: Mapping[str, float] = field(default_factory=dict)
    """by the keys of ``QUALITY``, those that there are, in the units of their headings."""


def summaries(of: BuildFolder) -> list[ObjectSummary]:
    """Every object of the last build, in the catalogue's order.

    Raises:
        WrongUse: nothing was built into the folder.
    """
    return [_summary(of, name) for name in read_settings(of).names]


def _summary(of: BuildFolder, name: str) -> ObjectSummary:
    record, there = read_record(of, name), None
    with suppress(TouchstoneError):
        there = ObjectFile.open(of.object(name))
    outcome, reason, quality = "waiting", "not built yet", dict[str, float]()
    if record is not None and record.built and not stands(of, record, record.key):
        outcome, reason, there = "damaged", "its files are not those that were built; build again", None
    elif record is not None:
        outcome, reason = record.outcome, record.reason
        quality = {} if there is None else _quality(there.description)
    audio = None if there is None else there.description.audio
    return ObjectSummary(
        name=name,
        outcome=outcome,
        reason=reason,
        record=record,
        object=there,
        attempts=0 if record is None else record.attempts,
        seconds=None if record is None else record.seconds,
        modes=None if audio is None else len(audio.frequencies_hz),
        quality=quality,
    )


def _quality(description: Description) -> dict[str, float]:
    measured = {sense: entry.measured for sense, entry in description.networks.items()}
    return {
        key: factor * measured[sense][key]
        for key, (sense, _, factor) in QUALITY.items()
        if key in measured.get(sense, {})
    }
