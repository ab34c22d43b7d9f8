"""Query files answered by an imported object: sounds, touches and pictures as files."""

from pathlib import Path
from typing import TYPE_CHECKING

from harness.basics.errors import WrongUse
from harness.commands.object.published.files import AUDIO, TOUCH, VISION, AnsweredQueries, QueryFiles

if TYPE_CHECKING:
    from harness.basics.arrays import FloatArray
    from harness.objectfile.published.entries import (
        PublishedColoursEntry,
        PublishedDepthEntry,
        PublishedGainsEntry,
        PublishedSpectrumEntry,
    )
    from harness.objectfile.published.folder import PublishedObject

_MOST_SAMPLES = 2**28
"""Of all sounds together, 2 GB: they are written with one full scale."""

_CENTRE = 0.5
"""Pixels from the corner of a pixel to its centre."""


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


def touches_written(
    of: "PublishedObject", rows: "tuple[FloatArray, ...]", given: QueryFiles, out: Path, into: AnsweredQueries
) -> None:
    """Write ``1.npy`` and ``1.png`` and so on; ``rows`` are vertices and, of 2.0, presses."""
    depth, colours = of.description.touch_depth, of.description.touch_colours
    if depth is not None:
        into.files[TOUCH] = _maps(of, depth, rows, given, out, into)
    else:
        assert colours is not None
        into.files[TOUCH] = _pictures(of, colours, rows[0], given, out, into)


def _maps(
    of: "PublishedObject",
    entry: "PublishedDepthEntry",
    rows: "tuple[FloatArray, ...]",
    given: QueryFiles,
    out: Path,
    into: AnsweredQueries,
) -> list[Path]:

    from harness.basics.npz_file import write_array
    from harness.objectfile.published.taxim_picture import TaximPicture
    from harness.objectfile.published.touch import open_depths
    from harness.picture.image_file import write_png

    vertices, gel = rows
    size = (entry.rows, entry.columns)
    optics = None if given.calibration is None else TaximPicture.open(given.calibration, size)
    if optics is None:
        into.notes.append(
            "maps alone, metres from the gel's camera: for pictures give --calibration, the folder `calibs` "
            "that "
            "ObjectFolder 2.0 publishes"
        )
    written = []
    for number, (depth, press) in enumerate(
        zip(open_depths(of, entry).maps(vertices, gel), gel, strict=True), start=1
    ):
        written.append(out / f"{number}.npy")
        write_array(written[-1], depth)
        if optics is not None:
            draw = optics.compat_image if given.compat else optics.image
            written.append(out / f"{number}.png")
            write_png(written[-1], draw(depth, float(press[2])))
    return written


def _pictures(
    of: "PublishedObject",
    entry: "PublishedColoursEntry",
    vertices: "FloatArray",
    given: QueryFiles,
    out: Path,
    into: AnsweredQueries,
) -> list[Path]:
    from harness.objectfile.published.touch import open_colours
    from harness.picture.image_file import write_png

    if given.compat:
        into.notes.append(
            "coordinates were normalised by the least and greatest of these vertices, as the program of "
            "ObjectFolder 1.0 does: a vertex looks otherwise in other company"
        )
    written = []
    for number, image in enumerate(open_colours(of, entry).images(vertices, given.compat), start=1):
        written.append(out / f"{number}.png")
        write_png(written[-1], image)
    return written


def views_written(
    of: "PublishedObject", rows: "tuple[FloatArray, ...]", given: QueryFiles, out: Path, into: AnsweredQueries
) -> None:
    """Write ``000.png`` and so on; ``rows`` are cameras and lights."""
    import numpy as np

    from harness.objectfile.published.camera import views_of
    from harness.objectfile.published.look import open_look
    from harness.picture.image_file import write_png

    entry = of.description.vision
    assert entry is not None
    cube = None if entry.cells is None else np.array([entry.cells.low, entry.cells.high])
    reach = entry.near if cube is None else float(np.linalg.norm(np.abs(cube).max(axis=0)))
    views, look, written = views_of(rows[0], reach, given.compat), open_look(of, entry), []
    for number, view in enumerate(views):
        picture = look.picture(view, given.size, 0.0 if given.compat else _CENTRE)
        written.append(out / f"{number:03d}.png")
        write_png(written[-1], picture.truncated() if given.compat else picture.rounded())
    into.files[VISION] = written
