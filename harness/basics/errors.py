"""The failures an operator can meet, each with the exit code a script sees.

Messages say what was asked, the value, the limit with its unit, and what to do next.
"""

import re


class TouchstoneError(Exception):
    """A failure with a name; its text is the one line shown to the operator."""

    exit_code = 1

    @classmethod
    def kind(cls) -> str:
        """The class's name in words, by which a program tells failures apart: ``"recording damaged"``.

        A private class is of the kind of the public one that it refines.
        """
        public = next(each for each in cls.__mro__ if not each.__name__.startswith("_"))
        return re.sub(r"(?<!^)(?=[A-Z])", " ", public.__name__).lower()


class WrongUse(TouchstoneError):
    """The command, the scene or the station asks for something that does not exist."""

    exit_code = 2


class BenchFault(TouchstoneError):
    """An instrument did not do what it was asked."""


class MotionEnded(BenchFault):
    """Another instrument failed while the arm moved: the arm was stopped, is well and may move away."""


class NotTouched(BenchFault):
    """The gel travelled its whole approach and met nothing."""


class DataRefused(TouchstoneError):
    """A file or a reading that cannot be used, with the reason."""


class MeshRefused(DataRefused):
    """A mesh that cannot stand for an object."""


class RecordingDamaged(DataRefused):
    """A run folder that does not read back as it was written."""


class CalibrationRefused(DataRefused):
    """A calibration artefact that is missing, foreign or badly fitted."""


class PictureRefused(DataRefused):
    """A tactile picture that its calibration was not made for, or that no pressed gel shows."""


class OutOfDomain(DataRefused):
    """A query outside what a model was made for."""


class FitRefused(DataRefused):
    """Readings that no place on this object explains."""


class SafetyStop(TouchstoneError):
    """Stopped, or never started, because of a safety limit."""

    exit_code = 3


class LimitExceeded(SafetyStop):
    """A command outside the limits of the station; nothing was sent."""


class MotionRefused(SafetyStop):
    """The rehearsal in the twin found a step that must not be performed."""


class ProtectiveStop(SafetyStop):
    """The controller stopped the arm; only the operator may release it."""
