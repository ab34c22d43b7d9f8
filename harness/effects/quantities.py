"""The type of every quantity of the simulation, given or computed.

A quantity's key is the name of the parameter that takes it: ``touch_gel`` is ``touch.gel`` for ``explain``,
JSON and the store. ``n`` is the batch axis of contacts.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypedDict

from harness.basics.arrays import AnyArray, ByteArray, FloatArray, IntArray
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.objectfile.file import ObjectFile
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.gel.contact_force import ContactForce, ForceTable
from harness.sim.gel.elastic import GelElastic
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.markers import MarkerFile
from harness.sim.gel.press_pose import Presses
from harness.sim.light.appearance import Appearance
from harness.sim.light.direct_image import DirectImage, LitObject, VisibleSurface
from harness.sim.optics.optics import TactileImages
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.tactile_calibration import Float32Array, TactileCalibration
from harness.sim.sound.modal_sound import Strikes
from harness.sim.sound.room import MicrophoneResponse, RoomField

if TYPE_CHECKING:  # networks are opened by those effects alone that use them
    from harness.objectfile.touch.touch import ObjectTouch
    from harness.objectfile.vision.render import ObjectVision, Rendered


class Quantities(TypedDict, total=False):
    """Sources and computed quantities by the names of parameters; each may be left out."""

    # Sources, which a caller gives.
    object_mesh: Mesh  #: m, in the object's frame.
    object_wall: float | None  #: m, of a hollow object; None for a mesh of the material itself.
    object_material: Material
    object_file: ObjectFile  #: the object's networks.
    object_appearance: Appearance  #: colours of the surface, in the object's frame.
    contact_gel_from_object: FloatArray  #: ``(n, 4, 4)`` rigid.
    sensor: TactileSensor
    sensor_calibration: TactileCalibration
    sensor_shadow_table: ShadowTable
    sensor_noise: float  #: grey levels, sigma of the camera's noise.
    sensor_elastic: GelElastic  #: stiffness of the gel.
    sensor_forces: ForceTable | None  #: measured on this gel.
    sensor_rest: FloatArray | None
    """``(rows, columns)`` m towards the camera, the untouched gel; None for the sensor's, flat or a dome."""
    sensor_dots: MarkerFile | None  #: measured on this gel; None for the sensor's grid.
    seed: int  #: of the noise.
    strike: Strikes
    room: RoomField
    microphone: MicrophoneResponse
    camera: Pinhole  #: in the object's frame.
    camera_lights: Sequence[DirectionalLight]  #: in the object's frame.

    # Touch.
    object_raster: RasterMesh
    touch_height_map: FloatArray  #: ``(n, rows, columns)`` m, 0 or more: the object in the undeformed gel.
    touch_force: ContactForce
    contact_presses: Presses
    object_touch_codes: "ObjectTouch"
    touch_gel: FloatArray  #: ``(n, rows, columns)`` m of indentation of the gel's surface.
    touch_drawn: TactileImages  #: without shadows, dots and noise.
    touch_colour: ByteArray  #: ``(n, rows, columns, 3)`` RGB, of ``touch_drawn``.
    touch_saturated: IntArray  #: ``(n,)`` values clipped to black or white.
    touch_extrapolated: IntArray  #: ``(n,)`` pixels steeper than any press of the calibration.
    touch_darkening: tuple[Float32Array, FloatArray]
    """``(n, rows, columns, 3)`` grey levels, and ``(n,)`` as ``touch_shadow_out_of_table``."""
    touch_shadow: ByteArray  #: ``(n, rows, columns, 3)`` with shadows.
    touch_shadow_out_of_table: FloatArray  #: ``(n,)`` share of the rim whose depth is not in the table.
    touch_marker_motion: FloatArray  #: ``(n, markers, 2)`` m, x and y in ``gel``.
    touch_markers: ByteArray  #: ``(n, rows, columns, 3)`` with dots.
    touch_noise: ByteArray | FloatArray  #: ``(n, rows, columns, 3)`` grey levels, rounded without noise.
    touch_image: ByteArray  #: ``(n, rows, columns, 3)`` RGB, as the sensor's camera gives it.

    # Sound.
    object_modes: Mapping[str, AnyArray]  #: as ``harness.sim.modal.modal.to_arrays`` writes them.
    object_sound: FloatArray  #: ``(k, t)`` Pa in the open, of each strike.
    room_reverberation: FloatArray  #: ``(k, t)`` Pa in the room.
    microphone_pressure: FloatArray  #: ``(k, t)`` Pa as the microphone reports them.

    # The scene camera.
    object_lit: LitObject
    camera_seen: VisibleSurface
    camera_falling: FloatArray  #: ``(samples, lights)`` irradiance with nothing in the light's way.
    camera_shadow: FloatArray  #: the same with the object in its own light's way.
    object_vision: "ObjectVision"
    camera_image: "DirectImage | Rendered"
