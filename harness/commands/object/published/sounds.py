"""Sounds of an imported object as files: ours, which compare with one another, or the published program's."""

from pathlib import Path
from typing import TYPE_CHECKING

from harness.basics.errors import WrongUse
from harness.commands.object.published.files import AUDIO, AnsweredQueries, QueryFiles

if TYPE_CHECKING:
    from harness.basics.arrays import FloatArray
    from harness.objectfile.published.entries import PublishedGainsEntry, PublishedSpectrumEntry
    from harness.objectfile.published.folder import PublishedObject

_MOST_SAMPLES = 2**28
"""Of all sounds together, 2 GB: they are written with one full scale."""


def sounds_written(
    of: "PublishedObject", rows: "tuple[FloatArray, ...]", given: QueryFiles, out: Path, into: AnsweredQueries
) -> None:
    """Write ``1.wav`` and so on; ``rows`` are vertices and forces, errors as ``answer_queries``."""
    gains, spectrum = of.description.audio_gains, of.description.audio_spectrum
    if gains is not None:
        sounds, rate = _of_modes(of, gains, rows, given, into)
    else:
        assert spectrum is not None
        sounds, rate = _of_spectra(of, spectrum, rows, given, into)
    paths = [out / f"{number}.wav" for number in range(1, len(sounds) + 1)]
    if given.compat:
        write_float(paths, sounds, rate)
    else:
        into.full_scale = write_alike(paths, sounds, rate)
    into.files[AUDIO] = paths


def _of_modes(
    of: "PublishedObject",
    entry: "PublishedGainsEntry",
    rows: "tuple[FloatArray, ...]",
    given: QueryFiles,
    into: AnsweredQueries,
) -> "tuple[FloatArray, float]":
    from harness.objectfile.published.sound import COMPAT_RATE, compat_sounds, open_gains, rung
    from harness.sim.sound.modal_sound import check_rate

    sound, (vertices, forces) = open_gains(of, entry), rows
    amplitudes = sound.amplitudes(vertices, forces)
    if given.compat:
        return compat_sounds(amplitudes, sound.frequencies, sound.dampings), COMPAT_RATE
    check_rate(given.rate)
    heard = sound.audible(given.rate)
    if not heard.all():
        into.notes.append(
            f"{int((~heard).sum())} of {len(heard)} modes are at or above half of {given.rate:g} Hz and "
            "were left out"
        )
    samples = require_room(len(vertices), given)
    sounds = rung(amplitudes[:, heard], sound.frequencies[heard], sound.dampings[heard], samples, given.rate)
    return sounds, given.rate


def _of_spectra(
    of: "PublishedObject",
    entry: "PublishedSpectrumEntry",
    rows: "tuple[FloatArray, ...]",
    given: QueryFiles,
    into: AnsweredQueries,
) -> "tuple[FloatArray, float]":
    import numpy as np

    from harness.objectfile.published.sound import open_spectra, peak_normalised

    sound, (vertices, forces) = open_spectra(of, entry), rows
    into.notes.append(
        f"a sound of ObjectFolder 1.0 has {entry.samples} samples at {entry.rate_hz:g} Hz, whatever is "
        "asked for"
    )
    if given.compat:
        into.notes.append(
            "the first vertex alone, and bounds of its own voxels, as the program of ObjectFolder 1.0 does"
        )
        vertices, forces = vertices[:1], forces[:1]
    pairs = zip(vertices, forces, strict=True)
    sounds = np.stack([sound.sound(vertex, force, given.compat) for vertex, force in pairs])
    return peak_normalised(sounds) if given.compat else sounds, entry.rate_hz


def require_room(count: int, given: QueryFiles) -> int:
    """Samples of each of so many sounds; ``WrongUse`` where all together are too many."""
    samples = round(given.seconds * given.rate)
    if samples * count > _MOST_SAMPLES:
        raise WrongUse(
            f"{count} sounds of {samples} samples are more than {_MOST_SAMPLES} together; give fewer rows "
            "at once, "
            "or shorter sounds"
        )
    return samples


def write_alike(paths: list[Path], sounds: "FloatArray", rate: float) -> float:
    """24 bits with one full scale for all: what is louder in the sound is louder in the file."""
    import numpy as np

    from harness.objectfile.audio.sound_wav import HEADROOM, wav_rate, write_wav

    wav_rate(rate)
    scale = HEADROOM * float(np.abs(sounds).max())
    for path, sound in zip(paths, sounds, strict=True):
        write_wav(path, sound, rate, scale)
    return scale


def write_float(paths: list[Path], sounds: "FloatArray", rate: float) -> None:
    """Single precision, as the published programs write them."""
    import numpy as np
    from scipy.io import wavfile

    for path, sound in zip(paths, sounds, strict=True):
        wavfile.write(path, round(rate), sound.astype(np.float32))
