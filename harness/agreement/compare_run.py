"""A run's readings against its object's ObjectFile, the reference simulation and the twin."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from time import process_time
from typing import ParamSpec

from harness.agreement.agreement import Agreement, Sense, SenseResiduals, Source, judge_residuals
from harness.agreement.arm import compare_with_twin
from harness.agreement.camera import compare_camera
from harness.agreement.sound import compare_sound
from harness.agreement.subject import PressedContact, Subject, contacts_of, own_subject
from harness.agreement.touch import compare_touch
from harness.basics.errors import WrongUse
from harness.recording.run_folder import RunFiles

HIDDEN = "the size of the object is what this run measures"
"""Why nothing is compared where the scene hides the object's size."""

NAME_ONE = "name an ObjectFile of it, at the pose that the scene states, with --objectfile"

_NOTHING: tuple[tuple[Sense, Source], ...] = (
    ("arm", "twin"),
    ("touch", "reference"),
    ("sound", "reference"),
    ("camera", "reference"),
)

P = ParamSpec("P")


def agreement_of(
    run: RunFiles, subject: Subject | None = None, reference: bool = False, measured: str = ""
) -> Agreement:
    """Compare a recording with an object at the pose that its scene states.

    Args:
        run: recording of any experiment.
        subject: object to compare with; None for the run's own.
        reference: whether the reference simulation is compared too if a network replaces it.
        measured: sentence on the quantities that the run measures and its scene does not state; empty if
            scene or subject state all.

    Raises:
        RecordingDamaged: the recording or a file in it cannot be read.
    """
    subject = subject or own_subject(run)
    name = subject.scene.object.name
    unknown = measured or (HIDDEN if subject.scene.object.is_hidden else "")
    if unknown:
        why = f"{unknown}; {NAME_ONE}"
        return judge_residuals(name, [SenseResiduals(sense, source, (), why) for sense, source in _NOTHING])
    return judge_residuals(name, list(_compared(subject, contacts_of(run), reference)))


def _compared(
    subject: Subject, contacts: tuple[PressedContact, ...], reference: bool
) -> Iterator[SenseResiduals]:
    used, most = subject.scene.sensors, None if reference else 1
    try:
        yield _timed(compare_with_twin, subject, contacts)
    except WrongUse as refusal:  # another object may not fit where the scene's stands
        yield SenseResiduals("arm", "twin", (), str(refusal))
    for source in subject.sources_of("touch")[:most]:
        yield _timed(compare_touch, subject, source, contacts) if used.touch else _unused("touch", source)
    for source in subject.sources_of("audio")[:most]:
        yield _timed(compare_sound, subject, source, contacts) if used.sound else _unused("sound", source)
    yield _timed(compare_camera, subject) if used.camera else _unused("camera", "reference")


def _unused(sense: Sense, source: Source) -> SenseResiduals:
    return SenseResiduals(sense, source, (), f"the scene uses no {sense}")


def _timed(compare: Callable[P, SenseResiduals], *args: P.args, **kwargs: P.kwargs) -> SenseResiduals:
    began = process_time()
    found = compare(*args, **kwargs)
    return replace(found, seconds=process_time() - began)
