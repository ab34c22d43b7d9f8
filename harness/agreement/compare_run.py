"""A run's readings against its object's ObjectFile, the reference simulation and the twin."""

from collections.abc import Callable

from harness.agreement.agreement import Agreement, Sense, SenseResiduals, Source, judged
from harness.agreement.arm import compare_with_twin
from harness.agreement.readings import PressedContact, contacts_of
from harness.agreement.sound import compare_sound
from harness.agreement.subject import Subject, own_subject
from harness.agreement.touch import compare_touch
from harness.objectfile.entries import Modality
from harness.recording.run_folder import RunFiles

HIDDEN = (
    "the size of the object is what this run measures; name an ObjectFile of its true size with --objectfile"
)
"""Why nothing is compared where the scene hides the object's size."""


def agreement_of(run: RunFiles, subject: Subject | None = None, reference: bool = False) -> Agreement:
    """Hold a recording against an object at the place that its scene states.

    Args:
        run: of any experiment.
        subject: the object; None for the run's own.
        reference: whether the reference simulation is compared too where a network stands for it.

    Raises:
        RecordingDamaged: the recording, or what it carries, cannot be read.
    """
    subject = subject or own_subject(run)
    name = subject.scene.object.name
    if subject.scene.object.is_hidden:
        nothing: tuple[tuple[Sense, Source], ...] = (
            ("arm", "twin"),
            ("touch", "reference"),
            ("sound", "reference"),
        )
        return judged(name, [SenseResiduals(sense, source, (), HIDDEN) for sense, source in nothing])
    contacts = contacts_of(run)
    senses = [compare_with_twin(subject, contacts)]
    senses += _by(subject, "touch", reference, contacts, compare_touch, run.scene.sensors.touch)
    senses += _by(subject, "audio", reference, contacts, compare_sound, run.scene.sensors.sound)
    return judged(name, senses)


_Compare = Callable[[Subject, Source, tuple[PressedContact, ...]], SenseResiduals]


def _by(
    subject: Subject,
    modality: Modality,
    reference: bool,
    contacts: tuple[PressedContact, ...],
    compare: _Compare,
    called_for: bool,
) -> list[SenseResiduals]:
    sense: Sense = "touch" if modality == "touch" else "sound"
    sources = subject.sources_of(modality)
    if not called_for:
        return [SenseResiduals(sense, sources[0], (), f"the scene called for no {sense}")]
    return [compare(subject, source, contacts) for source in (sources if reference else sources[:1])]
