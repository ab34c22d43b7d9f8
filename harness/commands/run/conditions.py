"""What a table or a cost curve varies, from options."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import typer

WhereOption = Annotated[
    list[str] | None,
    typer.Option(
        help="Only this level of a condition, as spacing=close; may be given again.", metavar="NAME=LEVEL"
    ),
]


def levels_of(
    conditions: Sequence[Any],
    given: Mapping[str, Sequence[str] | None],
    where: Sequence[str],
    tabled: bool = False,
) -> dict[str, list[str]]:
    """The levels of every condition that are to be measured; the usual ones of those that nobody named.

    Args:
        conditions: all that an experiment has.
        given: levels by name, from options of their own; None where nothing was said.
        where: ``NAME=LEVEL`` each.
        tabled: whether a table is measured, not a cost curve.

    Raises:
        WrongUse: a condition that the experiment does not have, or a level that is not one.
    """
    from harness.basics.errors import WrongUse
    from harness.basics.files.named_file import nearest

    known = {condition.name: condition for condition in conditions}
    asked: dict[str, list[str]] = {name: list(levels) for name, levels in given.items() if levels}
    for text in where:
        name, equals, level = text.partition("=")
        if not equals:
            raise WrongUse(f"--where {text}: write NAME=LEVEL, as spacing=close")
        asked.setdefault(name, []).append(level)
    for name, levels in asked.items():
        if name not in known:
            raise WrongUse(f"--{name}: not a condition of this experiment; {nearest(name, known)}")
        for level in levels:
            if level not in known[name].levels:
                raise WrongUse(f"--{name} {level!r} is not known; {nearest(level, known[name].levels)}")
    return {
        name: asked.get(name, list((condition.tabled if tabled else ()) or condition.usual))
        for name, condition in known.items()
    }
