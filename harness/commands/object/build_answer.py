"""Building one part of an object and saying what came of it: the same for sound, touch and look."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

from harness.commands.output import emit, share_progress, warn


class Built(Protocol):
    """What a builder gives back."""

    @property
    def said(self) -> tuple[str, ...]:
        """What was done to the mesh and what to look at, a sentence each."""


Part = TypeVar("Part", bound=Built)


def build_and_say(
    builder: Callable[[Callable[[str, float], None]], Part],
    as_json: Callable[[Part], Mapping[str, Any]],
    show: Callable[[Part], None],
    json: bool,
) -> int:
    """Build under a bar of progress, say what to look at, and answer.

    Args:
        builder: of the part; handed what it is to tell of its progress.
        as_json: the answer for scripts.
        show: the answer for people.
        json: whether the answer is for scripts.
    """
    with share_progress(quiet=json) as report:
        built = builder(report)
    for sentence in built.said:
        warn(sentence)
    if json:
        emit(as_json(built))
    else:
        show(built)
    return 0
