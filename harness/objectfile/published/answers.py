"""Answer ObjectFolder's own query files by an object, imported or built: sounds, maps and pictures as files.

The files are rows of numbers in ``.npy``, checked before anything is computed; what is written is named as
ObjectFolder names it. An imported object answers in its own quantities, as does one that was built from its
mesh: sounds of instantaneous blows in N s, maps of indentation in metres of the gel that it was built for.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.files.foreign_file import require_readable
from harness.basics.files.named_file import require_file
from harness.basics.geometry import transform
from harness.basics.npz_file import read_array, write_array
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.audio.blow import HammerBlow
from harness.objectfile.audio.sound_wav import HEADROOM, write_wav
from harness.objectfile.audio.strike import place_near, strike
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.entries import PublishedObject
from harness.objectfile.published.look import FOCAL, SIZE, PublishedLook, PublishedView, views_of
from harness.objectfile.published.sound import (
    COMPAT_RATE,
    compat_sounds,
    mode_gains,
    peak_normalised,
    spectrum_sounds,
    sum_modes,
)
from harness.objectfile.published.touch import TaximPicture, touch_images, touch_maps
from harness.objectfile.touch.level import require_gel
from harness.objectfile.touch.touch import open_touch
from harness.objectfile.vision.render import open_vision
from harness.picture.image_file import write_png
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.gel.press_pose import Presses, contact_place
from harness.sim.optics.known_gel import known_gel
from harness.sim.optics.optics import Optics
from harness.sim.sound.modal_sound import check_rate

MOST_ROWS = 1000
"""Maximum rows of a query file: a thousand compatible sounds are 1 GB while they are computed."""

_MOST_BYTES = 64 * 2**20

_MOST_SAMPLES = 2**28
"""Maximum samples of all sounds together, 2 GB: they are written with one full scale."""

Object = ObjectFile | PublishedObject
Rows = tuple[FloatArray, ...]

_COLUMNS = {
    "--audio-vertices": (3, "vertices x y z, m"),
    "--audio-forces": (3, "forces x y z"),
    "--touch-vertices": (3, "vertices x y z, m"),
    "--touch-gelinfo": (3, "tilt and azimuth, rad, and depth, m"),
    "--vision": (6, "camera x y z and light x y z"),
}
"""Columns of a row of each query file, and their meaning."""

_REASONS = {
    "--audio-vertices": "a vertex for each force",
    "--audio-forces": "a force for each vertex",
    "--touch-vertices": "a vertex for each press",
    "--touch-gelinfo": "tilt, azimuth and depth of each press; those of 1.0 are along the normal",
    "--vision": "cameras about the centre of the object's box",
    "--metres-per-unit": "the vision frame's unit of a built object; an imported one has no known size",
}
"""Reasons why an option is needed with others, or cannot be given."""


COMPAT_SIZE = 256
"""Width and height in pixels of the pictures of the published programs."""


@dataclass(frozen=True)
class QuerySettings:
    """Settings of the answers."""

    size: int  #: pixels a side of pictures.
    seconds: float  #: length of sounds.
    rate: float  #: samples per second.
    compat: bool  #: whether everything is as the published programs do it.
    calibration: Path | None  #: folder of the gel's colours; None for maps alone.
    metres_per_unit: float | None  #: unit of the vision frame, for an object built from its mesh.

    def __post_init__(self) -> None:
        if not 0.0 < self.seconds <= 60.0:
            raise WrongUse(f"--seconds {self.seconds:g}: sounds are above 0 and at most 60 s long")
        if self.compat and (self.size, self.seconds, self.rate) != (COMPAT_SIZE, 3.0, 44100.0):
            raise WrongUse(
                "--objectfolder-compat sets size, length and rate; leave --size, --seconds and --rate out"
            )


@dataclass(eq=False)
class AnsweredQueries:
    """Files written for a set of query files, and their cost."""

    files: dict[str, list[Path]] = field(default_factory=dict)  #: written files by sense, in query order.
    full_scale: float | None = None  #: of the sounds, in the sound's unit; None for each its own.
    notes: list[str] = field(default_factory=list)  #: what the operator should know.
    seconds: dict[str, float] = field(default_factory=dict)  #: on the clock, by sense.


def read_queries(of: Object, files: Mapping[str, Path | None], settings: QuerySettings) -> dict[str, Rows]:
    """Read the query files that were given.

    Args:
        of: object that answers them.
        files: paths by option; None if it was not given.
        settings: settings of the answers.

    Returns:
        Rows by sense, an array for each of its files.

    Raises:
        WrongUse: no file, some of the files that belong together, or a sense that the object does not have.
        DataRefused: a file that is no such query.
    """
    given = {name for name, path in files.items() if path is not None}
    if not given:
        raise WrongUse(
            "no query file was given; give --vision, --audio-vertices and --audio-forces, or --touch-vertices"
        )
    if settings.metres_per_unit is not None:
        given.add("--metres-per-unit")
    kind = f"an object of {of.description.format}" if isinstance(of, PublishedObject) else "a built object"
    needed = {
        "audio": ("--audio-vertices", "--audio-forces"),
        "touch": ("--touch-vertices",) if kind.endswith("1.0") else ("--touch-vertices", "--touch-gelinfo"),
        "vision": ("--vision", "--metres-per-unit") if isinstance(of, ObjectFile) else ("--vision",),
    }
    queries = {}
    for sense, options in needed.items():
        missing = [name for name in options if name not in given]
        if len(missing) == len(options):
            continue
        if missing:
            raise WrongUse(f"{' and '.join(options)} go together for {kind}: {_REASONS[missing[0]]}")
        if isinstance(of, PublishedObject) and sense not in of.description.networks:
            raise WrongUse(
                f"{of.folder} has no network of {sense}; its file had none, leave those queries out"
            )
        paths = {name: path for name in options if (path := files.get(name)) is not None}
        rows = [read_rows(path, *_COLUMNS[name]) for name, path in paths.items()]
        if len({len(each) for each in rows}) > 1:
            counts = " and ".join(str(len(each)) for each in rows)
            raise DataRefused(f"{counts} rows of {' and '.join(options)}; give one of each for each query")
        queries[sense] = tuple(rows)
        given -= set(options)
    for name in sorted(given):
        raise WrongUse(f"{name} is not for {kind}: {_REASONS[name]}; leave it out")
    return queries


def read_rows(path: Path, columns: int, meaning: str) -> FloatArray:
    """Read a query file; nothing in it is run.

    Args:
        path: path of the ``.npy`` file; one row may be written without its axis.
        columns: numbers of a row.
        meaning: meaning of the columns for messages: "vertices x y z, m".

    Returns:
        ``(n, columns)`` float64.

    Raises:
        WrongUse: there is no such file.
        DataRefused: it holds something else, or numbers that are not finite.
    """
    require_file(path, "query file", "give a .npy file as ObjectFolder's")
    require_readable(path, "a query file", _MOST_BYTES)
    found = read_array(path, "queries")
    if found.ndim == 1 and found.size == columns:
        found = found[None]
    if found.dtype.kind not in "fiu" or found.ndim != 2 or found.shape[1] != columns:
        raise DataRefused(f"{path} holds {found.dtype} {found.shape}, not rows of {columns}: {meaning}")
    if not 1 <= len(found) <= MOST_ROWS:
        raise DataRefused(f"{path} has {len(found)} rows; give 1 to {MOST_ROWS}")
    rows = found.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    if len(bad):
        raise DataRefused(f"{path}: row {bad[0]} is {found[bad[0]].tolist()}, not finite; write it again")
    return read_only(rows)


def answer_queries(
    of: Object, queries: Mapping[str, Rows], settings: QuerySettings, out: Path
) -> AnsweredQueries:
    """Answer query files, one folder per sense in ``out``; ``OutOfDomain`` outside the training domain."""
    answered = AnsweredQueries()
    writers = {"audio": _write_sounds, "touch": _write_touches, "vision": _write_views}
    for sense, rows in queries.items():
        begun, folder = time.perf_counter(), out / sense
        folder.mkdir(parents=True, exist_ok=True)
        answered.files[sense] = writers[sense](of, rows, settings, folder, answered)
        answered.seconds[sense] = time.perf_counter() - begun
    return answered


def _write_sounds(
    of: Object, rows: Rows, settings: QuerySettings, folder: Path, answered: AnsweredQueries
) -> list[Path]:
    """Write ``1.wav`` and so on: of compatible sounds float32, of others 24 bits with one full scale."""
    (vertices, forces), rate = rows, COMPAT_RATE if settings.compat else settings.rate
    silent = np.flatnonzero(~forces.any(axis=1))
    if len(silent):
        raise OutOfDomain(
            f"force {silent[0]} is zero, which makes no sound; give another or leave the row out"
        )
    samples = round(settings.seconds * settings.rate)
    if samples * len(vertices) > _MOST_SAMPLES:
        raise WrongUse(
            f"{len(vertices)} sounds of {samples} samples are more than {_MOST_SAMPLES} together; give fewer "
            "rows at once, or shorter sounds"
        )
    if isinstance(of, ObjectFile):
        sounds = _strike_built(of, vertices, forces, settings, answered.notes)
    elif (entry := of.description.audio_gains) is not None:
        amplitudes = np.einsum("nmd,nd->nm", mode_gains(of, entry, vertices), forces)
        frequencies, dampings = np.array(entry.frequencies_hz), np.abs(entry.dampings_per_s)
        if settings.compat:
            sounds = compat_sounds(amplitudes, frequencies, dampings)
        else:
            check_rate(rate)
            kept = np.abs(frequencies) < 0.5 * rate
            _note_left_out(int((~kept).sum()), rate, answered.notes)
            sounds = sum_modes(amplitudes[:, kept], frequencies[kept], dampings[kept], samples, rate)
    else:
        spectrum = of.description.audio_spectrum
        assert spectrum is not None
        rate = spectrum.rate_hz
        answered.notes.append(
            f"a sound of ObjectFolder 1.0 has {spectrum.samples} samples at {rate:g} Hz, whatever is set"
        )
        if settings.compat:
            answered.notes.append(
                "the first vertex alone, and bounds of its own voxels, as ObjectFolder 1.0's program does"
            )
            vertices, forces = vertices[:1], forces[:1]
        sounds = spectrum_sounds(of, spectrum, vertices, forces, settings.compat)
        sounds = peak_normalised(sounds) if settings.compat else sounds
    paths = [folder / f"{number}.wav" for number in range(1, len(sounds) + 1)]
    if not settings.compat:
        answered.full_scale = HEADROOM * float(np.abs(sounds).max())
    for path, sound in zip(paths, sounds, strict=True):
        if answered.full_scale is None:
            wavfile.write(path, round(rate), sound.astype(np.float32))
        else:
            write_wav(path, sound, rate, answered.full_scale)
    return paths


def _strike_built(
    of: ObjectFile, vertices: FloatArray, forces: FloatArray, settings: QuerySettings, notes: list[str]
) -> FloatArray:
    """Compute sounds of instantaneous blows, N s, at places near the surface."""
    described = of.description.audio
    audio = open_audio(of, "table" if described is not None and described.network is None else "network")
    if settings.compat:
        amplitudes = np.einsum("nmd,nd->nm", audio.at(vertices), forces)
        damped = np.sqrt(np.maximum(audio.frequencies**2 - (audio.dampings / (2.0 * np.pi)) ** 2, 0.0))
        return compat_sounds(amplitudes, damped, audio.dampings)
    sounds = []
    for vertex, force in zip(vertices, forces, strict=True):
        place = place_near(audio.surface, vertex, audio.most)
        struck = strike(audio, place, HammerBlow.instant(force), settings.seconds, settings.rate)
        sounds.append(struck.sound)
    _note_left_out(int(struck.left_out.sum()), settings.rate, notes)
    return np.stack(sounds)


def _note_left_out(modes: int, rate: float, notes: list[str]) -> None:
    if modes:
        notes.append(f"{modes} modes are at or above half of {rate:g} Hz and were left out")


def _write_touches(
    of: Object, rows: Rows, settings: QuerySettings, folder: Path, answered: AnsweredQueries
) -> list[Path]:
    """Write ``1.npy``, a map in metres, and ``1.png`` and so on, those that there are."""
    maps: FloatArray = np.empty(0)
    images: ByteArray = np.empty(0, np.uint8)
    if isinstance(of, ObjectFile):
        maps, images = _press_built(of, rows, settings)
        answered.notes.append(
            "maps are metres of indentation, of the gel that the object's touch was built for"
        )
    elif (entry := of.description.touch_depth) is not None:
        shape, calibration = (entry.rows, entry.columns), settings.calibration
        optics = None if calibration is None else TaximPicture.open(calibration, shape)
        maps = touch_maps(of, entry, *rows)
        if optics is None:
            answered.notes.append(
                "maps alone, metres from the gel's camera: for pictures give --calibration, the folder "
                "`calibs` that ObjectFolder 2.0 publishes"
            )
        else:
            draw = optics.compat_image if settings.compat else optics.image
            images = np.stack([draw(*each) for each in zip(maps, rows[1][:, 2], strict=True)])
    else:
        colours = of.description.touch_colours
        assert colours is not None
        images = touch_images(of, colours, rows[0], settings.compat)
        if settings.compat:
            answered.notes.append(
                "coordinates were normalised by the least and greatest of these vertices, as the program of "
                "ObjectFolder 1.0 does: a vertex looks otherwise in other company"
            )
    written = []
    for number in range(len(rows[0])):
        if len(maps):
            written.append(folder / f"{number + 1}.npy")
            write_array(written[-1], maps[number])
        if len(images):
            written.append(folder / f"{number + 1}.png")
            write_png(written[-1], images[number])
    return written


def _press_built(of: ObjectFile, rows: Rows, settings: QuerySettings) -> tuple[FloatArray, ByteArray]:
    """Compute maps of indentation and their images; azimuths as of ``object render touch``."""
    vertices, gelinfo = rows
    touch = open_touch(of)
    calibration = None if settings.calibration is None else str(settings.calibration)
    gel = known_gel(None, calibration, shadow=False)
    require_gel(of, touch.entry.gel, gel.sensor, gel.calibration.header.skirt)
    places = [contact_place(of.mesh, vertex) for vertex in vertices]
    points, normals = (np.stack([getattr(place, name) for place in places]) for name in ("point", "normal"))
    tilts, azimuths, depths = gelinfo.T
    maps = touch.at(Presses(points, normals, depths, tilts, azimuths, np.zeros(len(gelinfo))))
    return maps, Optics(gel.calibration, "exact", gel.rest).render(maps).images


def _write_views(
    of: Object, rows: Rows, settings: QuerySettings, folder: Path, _answered: AnsweredQueries
) -> list[Path]:
    """Write ``000.png`` and so on."""
    if isinstance(of, ObjectFile):
        reach, draw = _look_at_built(of, settings)
    else:
        entry = of.description.vision
        assert entry is not None
        look, offset = PublishedLook.open(of, entry), 0.0 if settings.compat else 0.5
        corner = None if entry.cells is None else np.abs([entry.cells.low, entry.cells.high]).max(axis=0)
        reach = entry.near if corner is None else float(np.linalg.norm(corner))

        def draw(view: PublishedView) -> ByteArray:
            return grey_levels(look.picture(view, settings.size, offset), settings.compat)

    written = []
    for number, view in enumerate(views_of(rows[0], reach, settings.compat)):
        written.append(folder / f"{number:03d}.png")
        write_png(written[-1], draw(view))
    return written


def grey_levels(colour: FloatArray, compat: bool) -> ByteArray:
    """Round colours of 0 to 1 to 256 grey levels; compatible ones are cut off to the grey below."""
    levels = 255.0 * np.clip(colour, 0.0, 1.0)
    return (levels if compat else np.rint(levels)).astype(np.uint8)


def _look_at_built(
    of: ObjectFile, settings: QuerySettings
) -> tuple[float, Callable[[PublishedView], ByteArray]]:
    """Return the extent of the object in the vision frame's unit, and the renderer of a view."""
    assert settings.metres_per_unit is not None
    vision, unit = open_vision(of, 1), settings.metres_per_unit
    low, high = of.mesh.bounds
    size = settings.size
    # A compatible ray goes through the corner of its pixel.
    centre = 0.5 * size + (0.5 if settings.compat else 0.0)

    def draw(view: PublishedView) -> ByteArray:
        # Here the camera has y down and z forward; the published one has y up and looks back.
        rotation = view.rotation * np.array([1.0, -1.0, -1.0])
        pose = transform(rotation, 0.5 * (low + high) + unit * view.eye)
        camera = Pinhole(size, size, FOCAL * size / SIZE, (centre, centre), pose)
        return vision.picture(camera, DirectionalLight(view.light)).image.display()

    return float(np.linalg.norm(high - low)) / (2.0 * unit), draw
