"""Render the tactile image of a press on a mesh, on a height map or on an ObjectFile."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.mesh import Mesh
from harness.basics.npz_file import write_array
from harness.basics.result import HIDDEN, JSON_ONLY, Result
from harness.basics.toml_file import validate
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.scene_objectfile import find_objectfile, holds_objectfile, objectfile_folder
from harness.effects.accuracy import Level
from harness.effects.explain import ExplainedPlan
from harness.effects.explain import as_json as plan_json
from harness.effects.quantities import Quantities
from harness.effects.scene_object import known_object
from harness.effects.touch_press import Press, press_gel, press_heights
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch.level import require_gel
from harness.objectfile.touch.touch import ObjectTouch, ReferenceMaps, TouchLevel, open_touch
from harness.objects.builtin import BUILTIN
from harness.picture.image_file import read_image, write_png
from harness.picture.image_metrics import mean_square, psnr
from harness.picture.square_pixels import made_square
from harness.sim.gel.contact_force import read_force_table
from harness.sim.gel.elastic import GelElastic
from harness.sim.gel.height_file import Heights, read_heights
from harness.sim.gel.height_map import RasterMesh, rest_surface
from harness.sim.gel.markers import read_markers
from harness.sim.gel.press_pose import ContactPlace, Presses, contact_place, gel_from_object
from harness.sim.optics.known_gel import Gel, known_gel
from harness.sim.optics.optics import colour_error, filled_share
from harness.tasks.depth import UsedCalibration
from harness.tasks.press_force import FORCE_LEVEL, PressForce, force_of_press, force_sentence


@dataclass(frozen=True)
class TouchFlags:
    """Reasons not to trust a picture of a press, with the affected fractions."""

    no_contact: bool
    touches_border: bool  #: the contact reaches the edge of the picture.
    fills_window: bool  #: the contact is all of the picture that has heights.
    missing_heights: int  #: number of pixels without a height.
    saturated_values: int  #: number of values clipped to black or white.
    out_of_domain_share: float | None  #: pixels steeper than any press of the calibration.
    filled_bins_share: float | None  #: fraction of the sloped pixels whose table bin no press reached.
    shadow_out_of_table_share: float | None  #: fraction of the contact's rim; None without shadows.


@dataclass(frozen=True)
class MeshDifference:
    """Difference of an ObjectFile's press from the rasteriser's press of its mesh."""

    rms_m: float  #: rms difference of the gel's surface.
    p99_m: float
    most_m: float
    image_rms_grey: float
    image_psnr_db: float  #: infinite for equal pictures.
    force_n: float | None  #: None if no force was computed.


@dataclass(frozen=True)
class TouchError:
    """Errors of a picture of a press."""

    held_out_db: float | None  #: PSNR of the calibration on held-out presses; None if not stated.
    held_out_table_db: float | None
    residual_rms_grey: float  #: rms residual of the calibration; NaN if not stated.
    colours_residual_rms_grey: float  #: rms residual of the calibration's colours; NaN if not stated.
    table_colour_grey: float | None
    maps_measured: Mapping[str, float] | None  #: errors of an ObjectFile's network; None without one.
    from_mesh: MeshDifference | None  #: None unless an ObjectFile's network gave the surface.


@dataclass(frozen=True)
class PictureAgreement:
    """Agreement of a live picture with another one."""

    psnr_db: float  #: infinite for equal pictures.
    psnr_contact_db: float | None  #: None without contact.
    identical: bool

    @property
    def texts(self) -> tuple[str, str]:
        """Format the value over the frame and the value over the contact."""
        frame, contact = (
            "no pixel" if value is None else f"{value:.2f} dB" if math.isfinite(value) else "identical"
            for value in (self.psnr_db, self.psnr_contact_db)
        )
        return frame, contact


@dataclass(frozen=True)
class LivePress:
    """A live picture, compared with the simulated one and with the untouched gel."""

    contact_pixels: int
    simulated: PictureAgreement
    background: PictureAgreement


@dataclass(frozen=True, eq=False)
class RenderedTouch(Result):
    """The picture of a press, and the press."""

    folder: Path | None  #: folder of the ObjectFile that gave the gel's surface; None without one.
    object: str | None  #: name of that ObjectFile's object.
    level: str | None  #: source of that surface: ``"codes"`` or ``"reference"``.
    image: Path | None
    picture: Path | None
    height_out: Path | None
    source: str = field(metadata=JSON_ONLY)  #: mesh, ObjectFile or height map.
    heights_of: str = field(metadata=JSON_ONLY)  #: ``"object"`` or ``"gel"``.
    sensor: str
    calibration: UsedCalibration = field(metadata=JSON_ONLY)
    rows: int
    columns: int
    pitch_m: float  #: size of a pixel.
    depth_m: float | None = field(metadata=JSON_ONLY)  #: None for a height map, as are pose and point.
    tilt_rad: float | None = field(metadata=JSON_ONLY)
    azimuth_rad: float | None = field(metadata=JSON_ONLY)
    yaw_rad: float | None = field(metadata=JSON_ONLY)
    point_m: FloatArray | None = field(metadata=JSON_ONLY)  #: ``(3,)`` pressed point in the object's frame.
    normal: FloatArray | None = field(metadata=JSON_ONLY)  #: ``(3,)`` outward unit normal.
    moved_m: float | None = field(metadata=JSON_ONLY)  #: distance from the given point to the surface.
    gel_from_object: FloatArray | None = field(metadata=JSON_ONLY)  #: ``(4, 4)``.
    contact: bool = field(metadata=JSON_ONLY)  #: whether the object touches the gel.
    contact_pixels: int = field(metadata=JSON_ONLY)
    contact_area_m2: float
    deepest_m: float = field(metadata=JSON_ONLY)
    force_n: float | None = field(metadata=JSON_ONLY)
    force_uncertainty_n: float | None = field(metadata=JSON_ONLY)
    force: PressForce | None = field(metadata=JSON_ONLY)
    flags: TouchFlags = field(metadata=JSON_ONLY)
    error_estimate: TouchError = field(metadata=JSON_ONLY)
    live: LivePress | None = field(metadata=JSON_ONLY)
    levels: Mapping[str, Level]  #: levels of the knobs.
    effects: ExplainedPlan = field(metadata=JSON_ONLY)
    seconds: Mapping[str, float]  #: wall time by stage.
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    press: Press = field(metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        """State the pressed object, the pose and the depth of the contact."""
        lines = [] if self.point_m is None else [self.title]
        lines.append(
            f"{self.contact_pixels} pixels in contact, {1e3 * self.deepest_m:.3f} mm at the deepest"
            if self.contact
            else "no contact"
        )
        if self.force_n is not None and self.force_uncertainty_n is not None:
            lines.append(force_sentence(self.force_n, self.force_uncertainty_n))
        if self.live is not None:
            for name, agreement in (("simulated", self.live.simulated), ("background", self.live.background)):
                frame, contact = agreement.texts
                lines.append(f"live against {name}: {frame} over the frame, {contact} over the contact")
        return (*lines, *([self.difference] if self.level is not None else []))

    @property
    def title(self) -> str:
        """State the pressed object and the pose of the press."""
        point = () if self.point_m is None else self.point_m
        x, y, z = (round(1e3 * float(value), 2) + 0.0 for value in point)
        tilt, towards, yaw = (
            math.degrees(angle or 0.0) for angle in (self.tilt_rad, self.azimuth_rad, self.yaw_rad)
        )
        return (
            f"{self.object or self.source} pressed at ({x:g}, {y:g}, {z:g}) mm, "
            f"{1e3 * (self.depth_m or 0.0):g} mm deep, tilted {tilt:.3g} deg towards {towards:.3g} deg, "
            f"rotated {yaw:.3g} deg{f'; {self.level}' if self.level else ''}"
        )

    @property
    def difference(self) -> str:
        """State the difference of an ObjectFile's press from the rasteriser's."""
        found = self.error_estimate.from_mesh
        if found is None:
            return "by the rasteriser, which the other levels are measured against"
        decibels = found.image_psnr_db
        picture = f"{decibels:.1f} dB of the picture" if math.isfinite(decibels) else "the same picture"
        return (
            f"from the rasteriser on the mesh: {1e6 * found.rms_m:.3g} um rms, {1e6 * found.p99_m:.3g} um in "
            f"99 of 100 pixels, {picture}"
        )


@dataclass(frozen=True, eq=False)
class _Pressed:
    """A press with its source."""

    press: Press
    source: str  #: mesh, ObjectFile or height map.
    seconds: Mapping[str, float]  #: wall time by stage.
    place: ContactPlace | None = None
    gel_from_object: FloatArray | None = None  #: ``(4, 4)``.
    notes: tuple[str, ...] = ()  #: notes of the mesh's intake.
    of: ObjectFile | None = None
    touch: ObjectTouch | None = None  #: touch of the ObjectFile ``of`` at a level.
    reference: Press | None = None  #: press by the rasteriser; None if the level is the rasteriser.


_Pose = tuple[float, float, float, float]
"""Depth in m; tilt, azimuth and yaw in rad."""


def render_touch(
    mesh: str | Path | None = None,
    contact: Sequence[float] | None = None,
    vertex: int | None = None,
    depth: float = 1e-3,
    tilt: float = 0.0,
    azimuth: float = 0.0,
    yaw: float = 0.0,
    level: str | None = None,
    height: Path | None = None,
    heights_of: str = "object",
    reached: Path | None = None,
    units: str | None = None,
    up_axis: str | None = None,
    objectfile: Path | None = None,
    sensor: str | None = None,
    calibration: str | None = None,
    pitch: float | None = None,
    thickness: float | None = None,
    background: Path | None = None,
    shadow: bool | None = None,
    markers: Path | None = None,
    noise: float = 0.0,
    seed: int = 0,
    accuracy: Sequence[str] = (),
    gel: GelElastic | None = None,
    force_table: Path | None = None,
    live: Path | None = None,
    out: Path | None = None,
    height_out: Path | None = None,
    pressure_out: Path | None = None,
    picture: Path | None = None,
) -> RenderedTouch:
    """Render the image by the camera behind a gel of a press onto an object, or of a height map.

    Args:
        mesh: file, ``"builtin:mug"``, or folder or name of an ObjectFile; None with ``height``.
        contact: x, y, z in m in the object's frame, on its surface or within 2 mm.
        vertex: number of the pressed vertex, counted from 0, instead of ``contact``.
        depth: distance in m that the centre of the gel is pressed on.
        tilt: angle in rad between the gel's axis and the surface normal.
        azimuth: direction in rad of the tilt, from the gel's x axis at no yaw.
        yaw: rotation in rad of the sensor about its own axis.
        level: source of the gel's surface in an ObjectFile: ``"codes"``, or ``"reference"`` for the
            rasteriser on its mesh; None to simulate the press.
        height: NPY file of a height map: ``(rows, columns)`` metres of indentation, positive into the gel.
        heights_of: subject of ``height``: ``"object"``, or ``"gel"`` for the surface of the gel itself.
        reached: NPY file of the object's indentation under the gel's surface in m, for shadows.
        units: unit of the mesh file's coordinates; None to detect it.
        up_axis: axis of the mesh file that points up; None for the one that it declares, else z.
        objectfile: folder of the mesh's networks, for ``accuracy=["touch.shapes=network"]``.
        sensor: shipped name or sensor file; that of the calibration, else ``"gelsight-r1.5"``, if None.
        calibration: file, shipped name, or folder of Taxim's or ObjectFolder's; the sensor's own if None.
        pitch: size of a pixel in m, for a published calibration that does not state it.
        thickness: thickness of the gel in m; the sensor's if None.
        background: picture of the untouched gel; the calibration's if None.
        shadow: whether shadows are rendered; None to render them if the calibration has a table of them and
            the contact is known.
        markers: file of the dots on this gel, as ``calibrate markers`` writes it.
        noise: standard deviation of the camera's noise in grey levels.
        seed: random seed of the noise.
        accuracy: levels of the knobs, e.g. ``"touch.optics=exact"``.
        gel: stiffness of the gel, to compute the force; None for no force.
        force_table: file of forces that were measured on this gel, to interpolate the force from.
        live: picture by a real camera, to compare with.
        out: PNG file to write: the picture, 8-bit RGB.
        height_out: NPY file to write: the height map in m, NaN where it is missing.
        pressure_out: NPY file to write: pressure in Pa of every pixel.
        picture: PNG file to write: heights, colours and differences side by side.

    Raises:
        WrongUse: options that conflict, or an unknown sensor, knob or level.
        OutOfDomain: the contact is off the surface, or the press too deep for the gel or the networks.
        CalibrationRefused: there is no calibration for this sensor, or it lacks a level.
        DataRefused: a file that is damaged, or pictures of other sizes.
    """
    if (mesh is None) == (height is None):
        raise WrongUse("state what is pressed: either a MESH with --contact X Y Z, or --height FILE.npy")
    if not math.isfinite(noise):
        raise WrongUse(f"--noise of {noise} grey levels cannot be rendered; use a finite number")
    begun = time.perf_counter()
    # Without the object's own indentation there is nothing that casts a shadow.
    bare = level is not None or (heights_of == "gel" and reached is None)
    used = known_gel(
        sensor,
        calibration,
        pitch=pitch,
        thickness=thickness,
        background=None if background is None else read_image(background),
        shadow=False if shadow is None and bare else shadow,
    )
    used = replace(used, noise=noise, seed=seed)
    if markers is not None:
        used = used.with_dots(read_markers(markers))
    if gel is not None:
        used = replace(used, elastic=gel)
    levels = list(accuracy)
    if force_table is not None:
        used = replace(used, forces=read_force_table(force_table))
        if not any(text.partition("=")[0].strip() == FORCE_LEVEL for text in levels):
            levels.append(f"{FORCE_LEVEL}=table")
    seconds, pose = {"calibration": time.perf_counter() - begun}, (depth, tilt, azimuth, yaw)
    pressing = _Pressing(used, pose, levels, gel is not None or force_table is not None)
    if height is not None:
        pressed = pressing.heights(height, heights_of, reached)
    elif (contact is None and vertex is None) or heights_of != "object" or reached is not None:
        raise WrongUse(
            "a mesh needs --contact X Y Z or --vertex N, and --heights-of and --reached are of --height"
        )
    elif level is not None:
        pressed, seconds = pressing.objectfile(find_objectfile(str(mesh)), level, contact, vertex), {}
    else:
        pressed = pressing.mesh(str(mesh), contact, vertex, (units, up_axis), objectfile)
    press = pressed.press
    seconds |= pressed.seconds if level is not None else {**pressed.seconds, **press.evaluation.seconds}
    seen = None if live is None else made_square(read_image(live), press.gel.aspect)
    agreement = None if seen is None else _compare_live(press, seen)
    if pressure_out is not None:
        if press.force is None:
            raise WrongUse("--pressure-out needs a force; add --force, or omit --pressure-out")
        if press.plan.levels[FORCE_LEVEL] == "table":
            raise WrongUse(
                "a table of forces has no distribution of pressure; omit --pressure-out or --force-table"
            )
        write_array(pressure_out, press.force.pressure[0])
    if out is not None:
        write_png(out, press.image)
    if height_out is not None:
        heights = press.heights if press.missing is None else np.where(press.missing, np.nan, press.heights)
        write_array(height_out, heights)
    result = _describe(pressed, pose, agreement, seconds, (out, picture, height_out))
    if picture is not None:
        begun = time.perf_counter()
        _draw(result, seen, pressed.reference, picture)
        seconds["picture"] = time.perf_counter() - begun
    return result


@dataclass(frozen=True, eq=False)
class _Pressing:
    """The sensor, levels and options of a press."""

    gel: Gel
    pose: _Pose
    levels: Sequence[str]  #: levels of the knobs.
    force: bool  #: whether the force is computed.

    def heights(self, path: Path, of: str, under: Path | None) -> _Pressed:
        """Press a height map; ``under`` is the object's depth below a gel's surface."""
        if of not in ("object", "gel"):
            raise WrongUse(f"--heights-of {of} is no kind of height map; kinds are object and gel")
        kind: Heights = "object" if of == "object" else "gel"
        begun = time.perf_counter()
        given = read_heights(path, self.gel.sensor, kind)
        if under is not None and kind == "object":
            raise WrongUse(
                "--reached needs the surface of a gel; an object's --height includes the indentation"
            )
        reached = None if under is None else read_heights(under, self.gel.sensor)
        seconds = {"read": time.perf_counter() - begun}
        missing = given.missing if reached is None else given.missing | reached.missing
        touched = None if reached is None else reached.heights
        scene = self._scene(str(path))
        press = press_heights(given.heights, kind, self.gel, scene, self.levels, touched, missing, self.force)
        return _Pressed(press, str(path), seconds)

    def mesh(
        self,
        mesh: str,
        contact: Sequence[float] | None,
        vertex: int | None,
        file: tuple[str | None, str | None],
        objectfile: Path | None,
    ) -> _Pressed:
        """Simulate the press of a mesh; ``file`` is the unit of its coordinates and its upward axis."""
        begun = time.perf_counter()
        stated = mesh.startswith(BUILTIN) or holds_objectfile(objectfile_folder(mesh, Path.cwd()))
        scene = scene_from_options(
            mesh,
            None if stated else "steel",
            file[0],
            objectfile=None if objectfile is None else str(objectfile),
            up_axis=file[1],
        )
        scene = self._with_noise(scene)
        known = known_object(scene)
        place = find_place(known.mesh, contact, vertex)
        at = gel_from_object(place, *self.pose, self.gel.sensor.gel_thickness)
        seconds = {"mesh": time.perf_counter() - begun}
        sources: Quantities = {
            "object_mesh": known.mesh,
            "contact_gel_from_object": at[None],
            "contact_presses": Presses.one(place.point, place.normal, *self.pose),
        }
        press = press_gel(sources, self.gel, scene, self.levels, self.force)
        return _Pressed(press, mesh, seconds, place, at, (*known.read, *known.warnings))

    def objectfile(
        self, folder: Path, text: str, contact: Sequence[float] | None, vertex: int | None
    ) -> _Pressed:
        """Press an object with the gel's surface from its ObjectFile at a level."""
        begun = time.perf_counter()
        of, level = ObjectFile.open(folder), _touch_level(text)
        touch = open_touch(of, level)
        require_gel(of, touch.entry.gel, self.gel.sensor, self.gel.calibration.header.skirt)
        place = find_place(of.mesh, contact, vertex)
        presses = Presses.one(place.point, place.normal, *self.pose)
        scene = self._scene(str(of.folder / of.description.mesh.file))

        def pressed(touch: ObjectTouch) -> Press:
            surface = touch.at(presses)[0]
            return press_heights(surface, "gel", self.gel, scene, self.levels, force=self.force)

        # The first press loads compiled loops.
        pressed(touch)
        seconds = {"load": time.perf_counter() - begun}
        begun = time.perf_counter()
        press = pressed(touch)
        seconds["render"] = time.perf_counter() - begun
        maps = ReferenceMaps(RasterMesh(of.mesh), touch.entry.gel)
        maps.require_clear(presses)
        reference = None
        if level != "reference":
            begun = time.perf_counter()
            reference = pressed(replace(touch, level="reference", maps=maps))
            seconds["reference"] = time.perf_counter() - begun
        at = gel_from_object(place, *self.pose, self.gel.sensor.gel_thickness)
        return _Pressed(press, str(folder), seconds, place, at, of=of, touch=touch, reference=reference)

    def _scene(self, file: str) -> SceneFile:
        """Return a scene of the touched object alone; its material has no effect."""
        tree = {"schema": 1, "object": {"mesh": file, "material": "steel"}}
        return self._with_noise(validate(tree, SceneFile, "the options"))

    def _with_noise(self, scene: SceneFile) -> SceneFile:
        sensors = scene.sensors.model_copy(update={"noise": self.gel.noise > 0.0})
        return scene.model_copy(update={"sensors": sensors})


def find_place(mesh: Mesh, contact: Sequence[float] | None, vertex: int | None) -> ContactPlace:
    """Find the point of a surface nearest to a point in m, or at a vertex.

    Raises:
        WrongUse: neither or both are given, or a coordinate is not finite.
        OutOfDomain: the point is off the surface, or there is no such vertex.
    """
    if contact is not None and vertex is None:
        return contact_place(mesh, np.asarray(contact, dtype=np.float64))
    if vertex is not None and contact is None:
        count = len(mesh.vertices)
        if not 0 <= vertex < count:
            raise OutOfDomain(f"there is no vertex {vertex}; the mesh has {count}, say 0 to {count - 1}")
        return contact_place(mesh, mesh.vertices[vertex])
    raise WrongUse("say where it is pressed: either --contact X Y Z, or --vertex N")


def _touch_level(text: str) -> TouchLevel:
    match text:
        case "codes" | "reference":
            return text
        case "perceptron":
            raise WrongUse("touch no longer has the level 'perceptron'; take --level codes")
    raise WrongUse(f"no level {text!r} of a touch; --level takes codes, or reference for the mesh's")


def _compare_live(press: Press, live: ByteArray) -> LivePress:
    """Compare a live picture with the simulated one, and with the untouched gel alone.

    Raises:
        DataRefused: the picture has another size.
    """
    image, contact = press.image, press.contact
    if live.shape != image.shape:
        raise DataRefused(
            f"--live is {live.shape[0]} x {live.shape[1]} pixels and the simulated picture "
            f"{image.shape[0]} x {image.shape[1]}; give the sensor's own picture, not cropped"
        )

    def agreement(drawn: ByteArray) -> PictureAgreement:
        frame = psnr(live, drawn)
        return PictureAgreement(
            frame, psnr(live, drawn, contact) if contact.any() else None, math.isinf(frame)
        )

    background = press.gel.calibration.background
    return LivePress(int(contact.sum()), agreement(image), agreement(background))


def _describe(
    pressed: _Pressed,
    pose: _Pose,
    live: LivePress | None,
    seconds: Mapping[str, float],
    files: tuple[Path | None, Path | None, Path | None],
) -> RenderedTouch:
    press, place = pressed.press, pressed.place
    depth, tilt, azimuth, yaw = (None, None, None, None) if place is None else pose
    sensor, calibration = press.gel.sensor, press.gel.calibration
    header, pixels = calibration.header, int(press.contact.sum())
    missing = 0 if press.missing is None else int(press.missing.sum())
    newtons, uncertainty, force, force_notes = force_of_press(press)
    camera = press.surface + (-rest_surface(sensor) if press.gel.rest is None else press.gel.rest)
    flags = TouchFlags(
        no_contact=pixels == 0,
        touches_border=press.touches_border,
        fills_window=0 < pixels == press.contact.size - missing,
        missing_heights=missing,
        saturated_values=press.saturated,
        out_of_domain_share=press.out_of_domain,
        filled_bins_share=filled_share(camera, calibration),
        shadow_out_of_table_share=press.shadow_out_of_table,
    )
    error = TouchError(
        # A published calibration states no error, which its header writes as 0 dB.
        held_out_db=header.held_out_db if header.held_out_db > 0.0 else None,
        held_out_table_db=header.held_out_table_db if header.held_out_table_db > 0.0 else None,
        residual_rms_grey=header.residual_rms,
        colours_residual_rms_grey=header.residual_rms,
        table_colour_grey=colour_error(camera, calibration),
        maps_measured=press.maps_measured if pressed.touch is None else dict(pressed.touch.measured),
        from_mesh=None if pressed.reference is None else _compare_presses(press, pressed.reference),
    )
    return RenderedTouch(
        folder=None if pressed.of is None else pressed.of.folder,
        object=None if pressed.of is None else pressed.of.description.name,
        level=None if pressed.touch is None else pressed.touch.level,
        image=files[0],
        picture=files[1],
        height_out=files[2],
        source=pressed.source,
        heights_of=press.of,
        sensor=sensor.name if pressed.touch is None else pressed.touch.entry.gel.name,
        calibration=UsedCalibration(header.made_from, calibration.sha256),
        rows=sensor.rows,
        columns=sensor.columns,
        pitch_m=sensor.pitch,
        depth_m=depth,
        tilt_rad=tilt,
        azimuth_rad=azimuth,
        yaw_rad=yaw,
        point_m=None if place is None else place.point,
        normal=None if place is None else place.normal,
        moved_m=None if place is None else place.moved,
        gel_from_object=pressed.gel_from_object,
        contact=pixels > 0,
        contact_pixels=pixels,
        contact_area_m2=pixels * sensor.pitch**2,
        deepest_m=press.deepest,
        force_n=newtons,
        force_uncertainty_n=uncertainty,
        force=force,
        flags=flags,
        error_estimate=error,
        live=live,
        levels=press.plan.levels,
        effects=plan_json(press.plan),
        seconds=seconds,
        notes=(*pressed.notes, *_notes(flags, press.contact.size, place), *force_notes),
        press=press,
    )


def _compare_presses(press: Press, reference: Press) -> MeshDifference:
    gap = np.abs(press.surface - reference.surface)
    forces = None
    if press.force is not None and reference.force is not None:
        forces = float(press.force.newtons[0] - reference.force.newtons[0])
    return MeshDifference(
        rms_m=float(np.sqrt((gap**2).mean())),
        p99_m=float(np.quantile(gap, 0.99)),
        most_m=float(gap.max()),
        image_rms_grey=math.sqrt(mean_square(press.image, reference.image)),
        image_psnr_db=psnr(press.image, reference.image),
        force_n=forces,
    )


def _notes(flags: TouchFlags, pixels: int, place: ContactPlace | None) -> list[str]:
    notes = []
    if place is not None and place.moved > 0.0:
        notes.append(f"the contact was moved {place.moved * 1e3:.3g} mm onto the surface")
    if flags.no_contact:
        notes.append("no contact: the picture is the untouched gel's")
    if flags.missing_heights:
        notes.append(
            f"{flags.missing_heights} of {pixels} heights are missing (not finite, or no height): the gel "
            "is interpolated over them, and picture and contact are unknown there"
        )
    if flags.fills_window:
        notes.append("the contact fills the window: a flat face then looks like the untouched gel")
    if flags.touches_border:
        notes.append("the contact reaches the edge of the window; part of it is outside the picture")
    if (flags.out_of_domain_share or 0.0) > 0.0:
        notes.append(
            f"{flags.out_of_domain_share:.2%} of the pixels are steeper than any press of the calibration "
            "and rendered as its steepest"
        )
    if flags.saturated_values:
        notes.append(f"{flags.saturated_values} values of the picture were clipped to black or white")
    return notes


def _draw(result: RenderedTouch, live: ByteArray | None, reference: Press | None, path: Path) -> None:
    # Plotting takes a second to import.
    from harness.report.figures.figures import Album
    from harness.report.figures.touch import TouchPictures, touch_figure

    press, pixels = result.press, result.contact_pixels
    words = [
        f"{result.deepest_m * 1e3:.3f} mm deep, {pixels} px in contact" if pixels else "no contact",
        result.sensor,
        "",
    ]
    if result.live is not None:
        words.append("")
        for agreement in (result.live.simulated, result.live.background):
            frame, contact = agreement.texts
            words.append(f"PSNR {frame}, in contact {contact}")
    shown = TouchPictures(
        press.heights,
        press.image,
        press.gel.calibration.background,
        live,
        press.gel.sensor.pitch,
        tuple(words),
    )
    if result.level is not None:
        given = None if reference is None else (reference.surface, reference.image)
        caption = f"{result.title}\n{result.difference}"
        shown = replace(shown, name=result.level, reference=given, caption=caption)
    Album(path.parent).photograph(path.stem, touch_figure(shown))


def tactile_image(
    mesh: str | Path,
    contact: Sequence[float],
    depth: float = 1e-3,
    tilt: float = 0.0,
    units: str | None = None,
    sensor: str | None = None,
    calibration: str | None = None,
    up_axis: str | None = None,
) -> Press:
    """Render the tactile image of a press on a mesh; the arguments and errors are those of ``render_touch``.

    Returns:
        ``image`` ``(rows, columns, 3)`` RGB, ``surface`` of the gel in m, ``evaluation.seconds`` by effect.
    """
    return render_touch(
        mesh,
        contact,
        depth=depth,
        tilt=tilt,
        units=units,
        up_axis=up_axis,
        sensor=sensor,
        calibration=calibration,
    ).press
