"""Pictures of an object by the networks of its ObjectFile, alone and compared with a camera's picture."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.npz_file import write_array
from harness.basics.result import HIDDEN, JSON_ONLY, Result
from harness.bench.scene import load_scene
from harness.bench.scene_camera import Lamp, scene_frame, scene_lamps, scene_pinhole
from harness.bench.scene_objectfile import find_objectfile
from harness.bench.station_file import load_station, station_path
from harness.effects.scene_object import known_object
from harness.objectfile.file import ObjectFile
from harness.objectfile.same_object import require_same_shape
from harness.objectfile.vision.render import ObjectVision, Rendered, RenderSettings, open_vision
from harness.objectfile.vision.view import camera_for, light_for, require_size, turned
from harness.picture.exposure_fit import exposure_kind
from harness.picture.image_file import read_image, write_png
from harness.picture.linear_image import LinearImage
from harness.picture.live_picture import LiveComparison, PictureDifference, compare_live
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.solid.walls import walled

Three = tuple[float, float, float]

_MAX_SHEET_PIXELS = 2**24
"""Pixels of all pictures of a turntable together."""

_WARM_UP_COLUMNS = 256
"""Largest width of the first picture, which is discarded: it loads the compiled loops."""

_WHITE = 255

_LEVEL = "one_sample"
"""Name of the one renderer in results: one sample of the networks per ray."""

_FIELD_OF_VIEW = math.radians(40.0)

_MIN_OVERLAP = 0.8
"""Overlap of the masks (IoU) below which the object is hardly where it is simulated."""

_MAX_OUTLIERS = 0.25


@dataclass(frozen=True, eq=False)
class CameraPose:
    """The camera of a picture, in the object's frame."""

    position_m: FloatArray  #: ``(3,)``.
    forward: FloatArray  #: ``(3,)`` of unit length.
    object_from_camera: FloatArray  #: ``(4, 4)``.
    focal_px: float
    centre_px: tuple[float, float]  #: column and row of the optical axis.
    field_of_view_rad: float  #: across the width.

    @classmethod
    def of(cls, camera: Pinhole) -> "CameraPose":
        """Describe a pinhole camera."""
        return cls(
            camera.eye,
            camera.forward,
            camera.object_from_camera,
            camera.focal_px,
            camera.centre_px,
            camera.field_of_view,
        )


@dataclass(frozen=True, eq=False)
class RenderedLight:
    """The lamp of a picture."""

    direction: FloatArray  #: ``(3,)`` towards the lamp.
    irradiance: float


@dataclass(frozen=True)
class Turntable:
    """Pictures of an object that is turned about its z axis, on one sheet."""

    pictures: int
    step_rad: float
    sheet_rows: int
    sheet_columns: int
    seconds_a_picture: tuple[float, ...]


@dataclass(frozen=True)
class VisionError:
    """Errors of a rendered picture."""

    networks_measured: Mapping[str, float]  #: as measured when the ObjectFile was built.


@dataclass(frozen=True, eq=False)
class RenderedVision(Result):
    """One picture of an object, or the pictures of a turntable."""

    folder: Path  #: of the ObjectFile.
    object: str  #: name of the object.
    level: str  #: renderer.
    networks: str  #: kind of networks.
    image: Path | None  #: picture before white, 8-bit sRGB; None if not written.
    depth_out: Path | None
    alpha_out: Path | None
    rows: int
    columns: int
    camera: CameraPose = field(metadata=JSON_ONLY)
    light: RenderedLight = field(metadata=JSON_ONLY)
    samples: int  #: evaluations of the networks.
    rays: int
    covered_share: float  #: of the first picture's area.
    turntable: Turntable | None
    error_estimate: VisionError
    seconds: Mapping[str, float]  #: wall time by stage.
    seconds_by_part: Mapping[str, float]  #: of the first picture.
    pictures: tuple[Rendered, ...] = field(metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        """State the position of the camera."""
        x, y, z = (f"{each * 1e3:.4g}" for each in self.camera.position_m)
        a, b, c = (f"{each:.3g}" for each in self.light.direction)
        return (
            f"{self.object} from ({x}, {y}, {z}) mm, light towards ({a}, {b}, {c}), {self.columns} x "
            f"{self.rows} pixels",
        )


def render_vision(
    folder: str | Path,
    camera: Three | None = None,
    look_at: Three | None = None,
    up: Three | None = None,
    field_of_view: float = _FIELD_OF_VIEW,
    light: Three | None = None,
    size: tuple[int, int] = (256, 256),
    rays: int = 1,
    turntable: int | None = None,
    threads: int | None = None,
    out: Path | None = None,
    depth_out: Path | None = None,
    alpha_out: Path | None = None,
) -> RenderedVision:
    """Render an object from any side in any light, by the networks of its ObjectFile.

    Args:
        folder: of the ObjectFile, or its name.
        camera: position in m, in the object's frame; None for one that shows the whole object.
        look_at: point in m at the centre of the picture; the centre of the object if None.
        up: direction that is up in the picture; the object's z if None.
        field_of_view: angle in rad across the width.
        light: direction towards the lamp; over the camera's left shoulder if None.
        size: columns and rows in pixels.
        rays: per pixel along each side; 2 are four rays, which resolve edges within a pixel.
        turntable: number of pictures, of the object turned about its z; None for one picture.
        threads: that share the work; as many as cores if None.
        out: PNG file to write: the picture, or the sheet of pictures, before white.
        depth_out: NPY file to write: float32 depth in m along the camera's axis, inf next to the object.
        alpha_out: NPY file to write: float32 fraction of each pixel that is covered.

    Raises:
        WrongUse: a camera within the object, a light without a direction, or too many pixels.
        DataRefused: the ObjectFile has no vision, or a file of it is damaged.
    """
    settings = RenderSettings(rays=rays)
    width, height = size
    require_size(width, height)
    most = _MAX_SHEET_PIXELS // (width * height)
    if turntable is not None and not 1 <= turntable <= most:
        raise WrongUse(
            f"--turntable {turntable} of {width} x {height} pixels each; say 1 to {most} pictures of that "
            "size, or smaller ones"
        )
    begun = time.perf_counter()
    objectfile = ObjectFile.open(find_objectfile(folder))
    vision = open_vision(objectfile, threads)
    views = _views(vision, size, (camera, look_at, up), field_of_view, light, turntable or 1)
    eye, lamp = views[0]
    columns = min(width, _WARM_UP_COLUMNS)
    vision.picture(eye.resized(columns, max(1, round(height * columns / width))), lamp, settings)
    seconds = {"load": time.perf_counter() - begun}
    begun = time.perf_counter()
    pictures = tuple(vision.picture(*view, settings) for view in views)
    seconds["render"] = time.perf_counter() - begun
    across = math.ceil(math.sqrt(len(pictures)))
    down = math.ceil(len(pictures) / across)
    if out is not None:
        write_png(out, _sheet(pictures, down, across))
    if depth_out is not None:
        _write_arrays(depth_out, [picture.image.depth for picture in pictures])
    if alpha_out is not None:
        _write_arrays(alpha_out, [picture.image.alpha for picture in pictures])
    each = tuple(picture.seconds["render"] for picture in pictures)
    many = len(pictures) > 1
    return RenderedVision(
        folder=objectfile.folder,
        object=objectfile.description.name,
        level=_LEVEL,
        networks=vision.entry.level,
        image=out,
        depth_out=depth_out,
        alpha_out=alpha_out,
        rows=height,
        columns=width,
        camera=CameraPose.of(eye),
        light=RenderedLight(lamp.direction, lamp.irradiance),
        samples=sum(picture.samples for picture in pictures),
        rays=sum(picture.rays for picture in pictures),
        covered_share=float(pictures[0].image.alpha.mean()),
        turntable=Turntable(len(each), 2.0 * math.pi / len(each), down, across, each) if many else None,
        error_estimate=VisionError(vision.entry.network.measured),
        seconds=seconds,
        seconds_by_part=pictures[0].seconds,
        pictures=pictures,
    )


def _views(
    vision: ObjectVision,
    size: tuple[int, int],
    pose: tuple[Three | None, Three | None, Three | None],
    field_of_view: float,
    light: Three | None,
    count: int,
) -> tuple[tuple[Pinhole, DirectionalLight], ...]:
    """Return a camera and a lamp for each picture; both are turned about the object, which stands still."""
    mesh, target = vision.surface, pose[1]
    camera = camera_for(mesh, *size, *pose, field_of_view)
    lamp = light_for(camera) if light is None else DirectionalLight(np.array(light))
    if count == 1:
        return ((camera, lamp),)
    axis = mesh.bounds.mean(axis=0) if target is None else np.array(target)
    return tuple(turned(camera, lamp, axis, -2.0 * np.pi * k / count) for k in range(count))


def _sheet(pictures: tuple[Rendered, ...], down: int, across: int) -> ByteArray:
    shown = [picture.image.display() for picture in pictures]
    rows, columns = shown[0].shape[:2]
    whole = np.full((down * rows, across * columns, 3), _WHITE, np.uint8)
    for index, picture in enumerate(shown):
        i, j = divmod(index, across)
        whole[i * rows : (i + 1) * rows, j * columns : (j + 1) * columns] = picture
    return whole


def _write_arrays(path: Path, arrays: list[FloatArray]) -> None:
    write_array(path, (arrays[0] if len(arrays) == 1 else np.stack(arrays)).astype(np.float32))


@dataclass(frozen=True, eq=False)
class ComparedLight:
    """A lamp of the simulated picture."""

    direction: FloatArray  #: ``(3,)`` towards the lamp.
    colour: FloatArray  #: ``(3,)`` irradiance of red, green and blue.


@dataclass(frozen=True, eq=False)
class FittedExposure:
    """Exposure and white balance that bring the simulated picture to the live one; by channel."""

    fit: str  #: ``"gain-offset"``, ``"gain"`` or ``"none"``.
    gain: FloatArray
    gain_error: FloatArray  #: standard error.
    attenuation: FloatArray
    offset: FloatArray  #: of linear light.
    offset_error: FloatArray
    stops: float
    white_balance: FloatArray
    white_balance_error: FloatArray
    scatter: FloatArray
    pixels: FloatArray  #: that were fitted.
    saturated: FloatArray  #: pixels that are black or white.
    outlier_share: FloatArray


@dataclass(frozen=True)
class OutlineMatch:
    """The outline of the object in the live picture, against the simulated one."""

    by: str  #: ``"background"`` or ``"colour"``.
    pixels: int
    simulated_pixels: int
    overlap: float  #: intersection over union.


@dataclass(frozen=True, eq=False)
class ComparedVision(Result):
    """A camera's picture of an object, compared with the simulated one."""

    folder: Path  #: of the ObjectFile.
    object: str  #: name of the object.
    level: str  #: renderer.
    networks: str  #: kind of networks.
    live: Path | None  #: None for a picture that the station's camera just took.
    background: Path | None
    image: Path | None  #: live, simulated and their difference, side by side; None if not drawn.
    rows: int
    columns: int
    camera: CameraPose = field(metadata=JSON_ONLY)
    lights: tuple[ComparedLight, ...] = field(metadata=JSON_ONLY)
    light_assumed: bool  #: whether the direction of the light was not given.
    exposure: FittedExposure = field(metadata=JSON_ONLY)
    mask: OutlineMatch
    difference: PictureDifference = field(metadata=JSON_ONLY)
    difference_before_fit: PictureDifference = field(metadata=JSON_ONLY)
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    seconds: Mapping[str, float]  #: wall time by stage.
    comparison: LiveComparison = field(metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        """State the difference and the fitted exposure of every channel."""
        fit = self.exposure
        x, y, z = (f"{each * 1e3:.4g}" for each in self.camera.position_m)
        channels = zip(
            ("red", "green", "blue"), fit.gain, fit.gain_error, fit.offset, fit.offset_error, strict=True
        )
        return (
            f"{self.object} from ({x}, {y}, {z}) mm, {self.columns} x {self.rows} pixels",
            f"over the object: {self.difference}",
            f"before the fit: {self.difference_before_fit}",
            *(
                f"{name}: gain {gain:.4f} +- {gain_error:.4f}, offset {offset:+.4f} +- {offset_error:.4f} of "
                "linear light"
                for name, gain, gain_error, offset, offset_error in channels
            ),
            f"outlines overlap by {self.mask.overlap:.1%}",
        )


@dataclass(frozen=True, eq=False)
class _Photo:
    """A live picture with the camera and the lamps that it is simulated with."""

    live: ByteArray
    camera: Pinhole
    lamps: tuple[Lamp, ...]
    light_assumed: bool


def compare_vision(
    folder: str | Path,
    live: Path | None = None,
    background: Path | None = None,
    camera: Three | None = None,
    look_at: Three | None = None,
    up: Three | None = None,
    field_of_view: float | None = None,
    light: Three | None = None,
    station: str | None = None,
    scene: Path | None = None,
    seed: int = 0,
    fit: str = "gain-offset",
    threads: int | None = None,
    out: Path | None = None,
) -> ComparedVision:
    """Compare a camera's picture of an object with the simulated one, once both are exposed alike.

    Args:
        folder: of the ObjectFile, or its name.
        live: picture of a camera; None for what the camera of ``station`` sees now.
        background: picture of the bench without the object, by the same camera; None to find the object by
            its colours.
        camera: position of the camera in m, in the object's frame; needs ``live``.
        look_at: as for ``render_vision``.
        up: as for ``render_vision``.
        field_of_view: angle in rad across the width; 40 degrees if None.
        light: direction towards the lamp; the lamps of the scene if None, else over the left shoulder.
        station: bench with the scene camera, in place of ``camera``.
        scene: scene file that states where the object stands; needs ``station``.
        seed: of a mocked bench.
        fit: of each channel: ``"gain-offset"``, ``"gain"`` or ``"none"``.
        threads: that share the work; as many as cores if None.
        out: PNG file to write: live, simulated and their difference.

    Raises:
        WrongUse: neither or both ways to give a camera, or an unknown fit.
        DataRefused: the ObjectFile has no vision, or a picture cannot be read.
    """
    kind = exposure_kind(fit)
    pose = camera, look_at, up
    _require_one_camera(station, scene, live, camera, (*pose, field_of_view))
    begun = time.perf_counter()
    objectfile = ObjectFile.open(find_objectfile(folder))
    vision = open_vision(objectfile, threads)
    seconds = {"load": time.perf_counter() - begun}
    begun = time.perf_counter()
    if station is not None and scene is not None:
        photo = _station_photo(objectfile, station, scene, live, light, seed)
    else:
        seen = read_image(Path(live or ""))
        rows, columns = seen.shape[:2]
        eye = camera_for(vision.surface, columns, rows, *pose, field_of_view or _FIELD_OF_VIEW)
        photo = _lit_photo(seen, eye, light, ())
    behind = None if background is None else read_image(background)
    seconds["live"] = time.perf_counter() - begun
    begun = time.perf_counter()
    # Light of all lamps, each in its colour.
    pictures = [vision.picture(photo.camera, lamp.light).image for lamp in photo.lamps]
    parts = [picture.colour * lamp.colour for picture, lamp in zip(pictures, photo.lamps, strict=True)]
    image = LinearImage(np.sum(parts, axis=0), pictures[0].alpha, pictures[0].depth)
    seconds["render"] = time.perf_counter() - begun
    found = compare_live(photo.live, image, behind, kind)
    if out is not None:
        begun = time.perf_counter()
        _draw(found, out)
        seconds["draw"] = time.perf_counter() - begun
    exposure = found.exposure
    rows, columns = found.mask.shape
    return ComparedVision(
        folder=objectfile.folder,
        object=objectfile.description.name,
        level=_LEVEL,
        networks=vision.entry.level,
        live=live,
        background=background,
        image=out,
        rows=rows,
        columns=columns,
        camera=CameraPose.of(photo.camera),
        lights=tuple(ComparedLight(lamp.light.direction, lamp.colour) for lamp in photo.lamps),
        light_assumed=photo.light_assumed,
        exposure=FittedExposure(
            fit=exposure.kind,
            gain=exposure.gain,
            gain_error=exposure.gain_error,
            attenuation=exposure.attenuation,
            offset=exposure.offset,
            offset_error=exposure.offset_error,
            stops=exposure.stops,
            white_balance=exposure.balance,
            white_balance_error=exposure.balance * exposure.balance_error,
            scatter=exposure.scatter,
            pixels=exposure.pixels,
            saturated=exposure.saturated,
            outlier_share=exposure.outliers,
        ),
        mask=OutlineMatch(found.masked_by, int(found.mask.sum()), int(found.silhouette.sum()), found.overlap),
        difference=found.fitted,
        difference_before_fit=found.unfitted,
        notes=_notes(found, photo.light_assumed),
        seconds={**seconds, **found.seconds},
        comparison=found,
    )


def _require_one_camera(
    station: str | None,
    scene: Path | None,
    live: Path | None,
    camera: Three | None,
    own: tuple[Three | float | None, ...],
) -> None:
    if station is None:
        if scene is not None:
            raise WrongUse("--scene says where the object stands on a bench; say which with --station NAME")
        if live is None or camera is None:
            raise WrongUse(
                "say what a camera saw and from where: --live IMAGE with --camera X Y Z, or --station NAME "
                "with --scene FILE"
            )
    elif scene is None or any(given is not None for given in own):
        raise WrongUse(
            "--station knows its camera and needs --scene FILE, where the object stands; --camera, "
            "--look-at, --up and --field-of-view are of a camera without a station"
        )


def _station_photo(
    objectfile: ObjectFile, station: str, file: Path, live: Path | None, light: Three | None, seed: int
) -> _Photo:
    bench, scene = load_station(station_path(station)), load_scene(file)
    mesh = known_object(scene).mesh
    require_same_shape(objectfile, walled(mesh, scene.object.wall), "the --scene of this object")
    camera, lamps = scene_pinhole(bench, scene, mesh), scene_lamps(scene, mesh)
    seen = scene_frame(bench, scene, mesh, seed) if live is None else read_image(live)
    return _lit_photo(seen, camera, light, lamps)


def _lit_photo(live: ByteArray, camera: Pinhole, light: Three | None, known: tuple[Lamp, ...]) -> _Photo:
    if light is not None:
        return _Photo(live, camera, (Lamp(DirectionalLight(np.array(light)), np.ones(3)),), False)
    return _Photo(live, camera, known or (Lamp(light_for(camera), np.ones(3)),), not known)


def _notes(found: LiveComparison, light_assumed: bool) -> tuple[str, ...]:
    notes = []
    if light_assumed:
        notes.append(
            "the direction of the light is not given: a lamp over the left shoulder is assumed; say --light"
        )
    if found.overlap < _MIN_OVERLAP:
        notes.append(
            f"the object covers {found.overlap:.0%} of what simulation and picture cover together: it stands "
            "elsewhere, is another, or its outline was not found; give --background, or look at the sheet"
        )
    if found.exposure.outliers.max() > _MAX_OUTLIERS:
        notes.append(
            f"{found.exposure.outliers.max():.0%} of the pixels follow no exposure: highlights, shadows, "
            "another light, or another object"
        )
    return tuple(notes)


def _draw(found: LiveComparison, out: Path) -> None:
    # Plotting takes a second to import.
    from harness.report.figures.figures import Album
    from harness.report.figures.tiles import live_figure

    fit = found.exposure
    gains = ", ".join(f"{g:.3f}±{e:.3f}" for g, e in zip(fit.gain, fit.gain_error, strict=True))
    offsets = ", ".join(f"{o:+.3f}±{e:.3f}" for o, e in zip(fit.offset, fit.offset_error, strict=True))
    words = (
        f"object found by {found.masked_by} (orange), simulated (blue)\noverlap {found.overlap:.1%}",
        f"red, green, blue:\ngain {gains}\noffset {offsets}",
        f"over the object: {found.fitted}\nbefore the fit: {found.unfitted}",
    )
    Album(out.parent).photograph(out.stem, live_figure(found, words))
