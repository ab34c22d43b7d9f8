"""Query files answered by an object that was built from its mesh, in its own quantities."""

from pathlib import Path
from typing import TYPE_CHECKING

from harness.basics.errors import WrongUse
from harness.commands.object.published.files import AUDIO, TOUCH, VISION, AnsweredQueries, QueryFiles
from harness.commands.object.published.imported import require_room, write_alike, write_float

if TYPE_CHECKING:
    from harness.basics.arrays import FloatArray
    from harness.objectfile.audio.audio import ObjectAudio
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.published.camera import PublishedView
    from harness.objectfile.touch.touch import ObjectTouch
    from harness.picture.pinhole import Pinhole


def require_built(given: QueryFiles) -> None:
    """Refuse what an object built from its mesh cannot be queried by, with ``WrongUse``."""
    if given.touch_vertices is not None and given.touch_gelinfo is None:
        raise WrongUse("--touch-vertices needs --touch-gelinfo: tilt, azimuth and depth of each press")
    if (given.vision is None) != (given.metres_per_unit is None):
        raise WrongUse(
            "--vision and --metres-per-unit go together for an object built from its mesh: cameras stand "
            "about the middle of its box, and nobody publishes how large a unit of the vision frame is"
        )


def built_sounds(
    of: "ObjectFile", rows: "tuple[FloatArray, ...]", given: QueryFiles, out: Path, into: AnsweredQueries
) -> None:
    """Write ``1.wav`` and so on: instantaneous blows, N s, at places near the surface.

    Raises:
        DataRefused: the object has no sound.
        OutOfDomain: a place that is not near its surface, or a force of zero.
    """
    from harness.objectfile.audio.audio import open_audio
    from harness.objectfile.published.sound import COMPAT_RATE

    vertices, forces = rows
    described = of.description.audio
    table = described is not None and described.network is None
    audio = open_audio(of, "table" if table else "network")
    paths = [out / f"{number}.wav" for number in range(1, len(vertices) + 1)]
    if given.compat:
        write_float(paths, _compat(audio, vertices, forces), COMPAT_RATE)
    else:
        require_room(len(vertices), given)
        into.full_scale = write_alike(paths, _struck(audio, vertices, forces, given, into), given.rate)
    into.files[AUDIO] = paths


def _struck(
    audio: "ObjectAudio",
    vertices: "FloatArray",
    forces: "FloatArray",
    given: QueryFiles,
    into: AnsweredQueries,
) -> "FloatArray":
    import numpy as np

    from harness.objectfile.audio.blow import HammerBlow
    from harness.objectfile.audio.strike import place_near, strike

    sounds = []
    for vertex, force in zip(vertices, forces, strict=True):
        place = place_near(audio.surface, vertex, audio.most)
        made = strike(audio, place, HammerBlow.instant(force), given.seconds, given.rate)
        sounds.append(made.sound)
    if made.left_out.any():
        into.notes.append(
            f"{int(made.left_out.sum())} modes are at or above half of {given.rate:g} Hz and were left out"
        )
    return np.stack(sounds)


def _compat(audio: "ObjectAudio", vertices: "FloatArray", forces: "FloatArray") -> "FloatArray":
    import numpy as np

    from harness.objectfile.published.sound import compat_sounds

    amplitudes = np.einsum("nmd,nd->nm", audio.at(vertices), forces)
    damped = np.sqrt(np.maximum(audio.frequencies**2 - (audio.dampings / (2.0 * np.pi)) ** 2, 0.0))
    return compat_sounds(amplitudes, damped, audio.dampings)


def built_touches(
    of: "ObjectFile", rows: "tuple[FloatArray, ...]", given: QueryFiles, out: Path, into: AnsweredQueries
) -> None:
    """Write ``1.npy``, metres of indentation, and ``1.png`` and so on; azimuths as of `object render touch`.

    Raises:
        DataRefused: the object has no touch.
        OutOfDomain: a press that its networks were not made for.
    """
    from harness.basics.npz_file import write_array
    from harness.objectfile.touch.level import require_gel
    from harness.objectfile.touch.touch import open_touch
    from harness.picture.image_file import write_png
    from harness.sim.optics.known_gel import known_gel
    from harness.sim.optics.optics import Optics

    described = of.description.touch
    coded = described is None or described.codes is not None
    touch = open_touch(of, "codes" if coded else "perceptron")
    calibration = None if given.calibration is None else str(given.calibration)
    gel = known_gel(None, calibration, shadow=False)
    require_gel(of, touch.entry.gel, gel.sensor, gel.calibration.header.skirt)
    vertices, gelinfo = rows
    heights = _pressed(of, touch, vertices, gelinfo)
    images = Optics(gel.calibration, "exact", gel.rest).render(heights).images
    into.notes.append("maps are metres of indentation, of the gel that the object's touch was built for")
    into.files[TOUCH] = []
    for number, (height, image) in enumerate(zip(heights, images, strict=True), start=1):
        write_array(out / f"{number}.npy", height)
        write_png(out / f"{number}.png", image)
        into.files[TOUCH] += [out / f"{number}.npy", out / f"{number}.png"]


def _pressed(
    of: "ObjectFile", touch: "ObjectTouch", vertices: "FloatArray", gel: "FloatArray"
) -> "FloatArray":
    import numpy as np

    from harness.sim.gel.press_pose import contact_place
    from harness.sim.gel.presses import Presses

    places = [contact_place(of.mesh, vertex) for vertex in vertices]
    points, normals = (np.stack([getattr(place, name) for place in places]) for name in ("point", "normal"))
    tilts, azimuths, depths = gel.T
    return touch.at(Presses(points, normals, depths, tilts, azimuths, np.zeros(len(gel))))


def built_views(
    of: "ObjectFile", rows: "tuple[FloatArray, ...]", given: QueryFiles, out: Path, into: AnsweredQueries
) -> None:
    """Write ``000.png`` and so on.

    Raises:
        DataRefused: the object has no look.
        OutOfDomain: a camera within it, or elsewhere than the published program takes it to be.
    """
    import numpy as np

    from harness.objectfile.published.camera import views_of
    from harness.objectfile.vision.render import open_vision
    from harness.picture.image_file import write_png
    from harness.picture.pinhole import DirectionalLight

    assert given.metres_per_unit is not None
    vision = open_vision(of, 1)
    low, high = of.mesh.bounds
    reach = float(np.linalg.norm(high - low)) / (2.0 * given.metres_per_unit)
    into.files[VISION] = []
    for number, view in enumerate(views_of(rows[0], reach, given.compat)):
        camera = _camera(view, 0.5 * (low + high), given)
        picture = vision.picture(camera, DirectionalLight(view.light))
        path = out / f"{number:03d}.png"
        write_png(path, picture.image.display())
        into.files[VISION].append(path)


def _camera(view: "PublishedView", middle: "FloatArray", given: QueryFiles) -> "Pinhole":
    """The camera in the object's frame: y down, z forward; the published one has y up and looks back."""
    import numpy as np

    from harness.basics.geometry import transform
    from harness.objectfile.published.camera import FOCAL, SIZE
    from harness.picture.pinhole import Pinhole

    assert given.metres_per_unit is not None
    # A compatible ray goes through the corner of its pixel.
    centre = 0.5 * given.size + (0.5 if given.compat else 0.0)
    pose = transform(view.rotation * np.array([1.0, -1.0, -1.0]), middle + given.metres_per_unit * view.eye)
    return Pinhole(given.size, given.size, FOCAL * given.size / SIZE, (centre, centre), pose)
