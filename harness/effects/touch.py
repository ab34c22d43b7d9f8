"""The effects of touch: from an object and a pose to the picture behind the gel.

The gel's surface comes from the rasteriser on the mesh or from the codes of an ObjectFile. The codes model
the gel, not how deep the object itself reaches: shadows and printed dots start from ``touch.height_map``,
which is the rasteriser's at every level.
"""

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, IntArray, read_only
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.effects.accuracy import Knob
from harness.objectfile.file import ObjectFile
from harness.sim.gel.gel import GelLevel, deform, over_range
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration, rest_surface
from harness.sim.gel.markers import INK, MarkerFile, draw_markers, marker_displacements
from harness.sim.gel.press_pose import Presses, presses_of
from harness.sim.optics.optics import Optics, OpticsLevel, TactileImages, with_camera_noise
from harness.sim.optics.shadow import ShadowTable, darkened, darkening
from harness.sim.optics.tactile_calibration import Float32Array, TactileCalibration
from harness.sim.solid.walls import walled

if TYPE_CHECKING:
    from harness.objectfile.touch.touch import ObjectTouch

SUPERSAMPLING = Knob("touch.supersampling", (1, 2, 3), "rays a side", "number", 1, "rays a pixel, each way")
SHAPES = Knob(
    "touch.shapes",
    ("network", "reference"),
    "",
    "method",
    "reference",
    "the ObjectFile's network of codes, or the rasteriser on the mesh",
    removed={"perceptron": "network"},
)
GEL: Knob[GelLevel] = Knob(
    "touch.gel", ("fast", "exact"), "", "method", "exact", "how wide blurs of the gel are done"
)
OPTICS: Knob[OpticsLevel] = Knob(
    "touch.optics", ("smooth", "fast", "exact"), "", "method", "fast", "slope to colour"
)
MARKER_NODES = Knob("touch.marker_motion", (2, 4, 8), "nodes", "number", 4, "loads to one gel thickness")


def rasterize_object(object_mesh: Mesh) -> RasterMesh:
    """Sort the faces of the object for height maps."""
    return RasterMesh(object_mesh)


def compute_height_map(
    object_raster: RasterMesh,
    contact_gel_from_object: FloatArray,
    sensor: TactileSensor,
    sensor_rest: FloatArray | None = None,
    *,
    touch_supersampling: int,
) -> FloatArray:
    """Compute how deep an object reaches into an undeformed gel, the mean of the rays of each pixel.

    Raises:
        OutOfDomain: a pose that is not finite and rigid.
    """
    rays = touch_supersampling
    fine = replace(sensor, rows=sensor.rows * rays, columns=sensor.columns * rays, pitch=sensor.pitch / rays)
    gap = height_maps(object_raster, contact_gel_from_object, fine)
    if sensor_rest is None:
        deep = penetration(gap, fine)
    else:
        # The surface's z in the gel frame is 0 at the window's centre.
        rows, columns = (np.array([(size - 1) // 2, size // 2]) for size in sensor_rest.shape)
        surface: FloatArray = sensor_rest[np.ix_(rows, columns)].mean() - sensor_rest
        deep = np.maximum(0.0, surface.repeat(rays, axis=0).repeat(rays, axis=1) - gap)
    if rays == 1:
        return read_only(deep)
    blocks = deep.reshape(len(deep), sensor.rows, rays, sensor.columns, rays)
    return read_only(blocks.mean(axis=(2, 4)))


def find_presses(object_mesh: Mesh, contact_gel_from_object: FloatArray) -> Presses:
    """Find the place, depth and angles of each pose."""
    return presses_of(object_mesh, contact_gel_from_object)


def open_touch_codes(
    object_file: ObjectFile,
    object_mesh: Mesh,
    object_wall: float | None,
    sensor: TactileSensor,
    sensor_calibration: TactileCalibration,
) -> "ObjectTouch":
    """Open the touch of an ObjectFile.

    Raises:
        WrongUse: an ObjectFile of another object or another gel; the message names the difference.
        DataRefused: it has no touch, or a file of it is damaged.
    """
    # Loaded only where touch comes from an ObjectFile.
    from harness.objectfile.touch.level import require_own_touch
    from harness.objectfile.touch.touch import open_touch

    solid = walled(object_mesh, object_wall)
    require_own_touch(object_file, solid, sensor, sensor_calibration.header.skirt)
    return open_touch(object_file)


def deform_gel(
    touch_height_map: FloatArray,
    sensor: TactileSensor,
    sensor_calibration: TactileCalibration,
    *,
    touch_gel: GelLevel,
) -> FloatArray:
    """Deform the gel around the object.

    A press deeper than the gel is clamped to its thickness, because estimated contacts are simulated too;
    ``touch_press`` refuses such a press where a user requests it.
    """
    pressed, _ = over_range(touch_height_map, sensor)
    return deform(pressed, sensor_calibration.header.skirt, touch_gel)


def decode_gel(object_touch_codes: "ObjectTouch", contact_presses: Presses) -> FloatArray:
    """Evaluate the gel's surface from the codes of an ObjectFile."""
    return object_touch_codes.at(contact_presses)


def render_images(
    touch_gel: FloatArray,
    sensor: TactileSensor,
    sensor_calibration: TactileCalibration,
    sensor_rest: FloatArray | None = None,
    *,
    touch_optics: OpticsLevel,
) -> TactileImages:
    """Render the gel's colours, and count the values that they cannot show.

    Raises:
        CalibrationRefused: a level that the calibration does not have.
    """
    if sensor_rest is not None:
        return Optics(sensor_calibration, touch_optics, sensor_rest).render(touch_gel)
    return prepare_optics(sensor_calibration, touch_optics, sensor).render(touch_gel)


def render_colour(
    touch_gel: FloatArray,
    sensor: TactileSensor,
    sensor_calibration: TactileCalibration,
    *,
    touch_optics: OpticsLevel,
) -> ByteArray:
    """Render the gel's colours; raises as ``render_images``."""
    return render_images(touch_gel, sensor, sensor_calibration, touch_optics=touch_optics).images


def select_colour(touch_drawn: TactileImages) -> ByteArray:
    """Select the colours of rendered images."""
    return touch_drawn.images


def select_saturated(touch_drawn: TactileImages) -> IntArray:
    """Select the number of clipped values of rendered images."""
    return touch_drawn.saturated


def select_extrapolated(touch_drawn: TactileImages) -> IntArray:
    """Select the number of pixels that are too steep for the calibration."""
    return touch_drawn.extrapolated


def compute_darkening(
    touch_colour: ByteArray,
    touch_height_map: FloatArray,
    touch_gel: FloatArray,
    sensor: TactileSensor,
    sensor_calibration: TactileCalibration,
    sensor_shadow_table: ShadowTable,
    sensor_rest: FloatArray | None = None,
) -> tuple[Float32Array, FloatArray]:
    """Compute the darkening of each picture by shadows, as ``harness.sim.optics.shadow.darkening``."""
    calibration, table = sensor_calibration, sensor_shadow_table
    return darkening(touch_colour, touch_height_map, touch_gel, sensor, calibration, table, sensor_rest)


def cast_shadow(touch_colour: ByteArray, touch_darkening: tuple[Float32Array, FloatArray]) -> ByteArray:
    """Lay the shadows over the colours."""
    return darkened(touch_colour, touch_darkening[0])


def select_out_of_table(touch_darkening: tuple[Float32Array, FloatArray]) -> FloatArray:
    """Select the share of each contact's rim whose depth is not in the shadow table."""
    return touch_darkening[1]


def move_markers(
    touch_height_map: FloatArray,
    sensor: TactileSensor,
    sensor_dots: MarkerFile | None = None,
    *,
    touch_marker_motion: int,
) -> FloatArray:
    """Move the printed dots with the gel; deep presses are clamped as in ``deform_gel``."""
    pressed, _ = over_range(touch_height_map, sensor)
    rest = None if sensor_dots is None else sensor_dots.in_gel(sensor.pitch)
    return marker_displacements(pressed, sensor, touch_marker_motion, rest)


def print_markers(
    touch_shadow: ByteArray,
    touch_marker_motion: FloatArray,
    sensor: TactileSensor,
    sensor_dots: MarkerFile | None = None,
) -> ByteArray:
    """Print the dots over the pictures."""
    if sensor_dots is None:
        return draw_markers(touch_shadow, touch_marker_motion, sensor, INK)
    rest = sensor_dots.in_gel(sensor.pitch)
    return draw_markers(touch_shadow, touch_marker_motion, sensor, sensor_dots.ink, rest)


def add_noise(touch_markers: ByteArray, sensor_noise: float, seed: int) -> ByteArray | FloatArray:
    """Add the camera's noise to the pictures."""
    return with_camera_noise(touch_markers, sensor_noise, seed)


def quantize_image(touch_noise: ByteArray | FloatArray) -> ByteArray:
    """Round the pictures to grey levels of 8 bits."""
    if touch_noise.dtype == np.uint8:
        return touch_noise.astype(np.uint8, copy=False)
    return np.clip(np.rint(touch_noise), 0.0, 255.0).astype(np.uint8)


@lru_cache(maxsize=4)
def prepare_optics(calibration: TactileCalibration, level: OpticsLevel, sensor: TactileSensor) -> Optics:
    """Prepare a calibration to render a sensor's own untouched gel, flat or a dome.

    Raises:
        CalibrationRefused: a level that the calibration does not have.
    """
    return Optics(calibration, level, None if sensor.gel_radius is None else -rest_surface(sensor))
