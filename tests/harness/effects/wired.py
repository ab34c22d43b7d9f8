"""Every effect, called with the quantities that it takes; written by ``make reference``."""

import harness.effects.camera
import harness.effects.force
import harness.effects.sound
import harness.effects.touch
from harness.effects.accuracy import Accuracy
from harness.effects.quantities import Quantities


def wired(given: Quantities, computed: Quantities, accuracy: Accuracy) -> None:
    computed["object_raster"] = harness.effects.touch.rasterize_object(object_mesh=given["object_mesh"])
    computed["touch_height_map"] = harness.effects.touch.compute_height_map(
        object_raster=given["object_raster"],
        contact_gel_from_object=given["contact_gel_from_object"],
        sensor=given["sensor"],
        sensor_rest=given["sensor_rest"],
        touch_supersampling=accuracy.of(harness.effects.touch.SUPERSAMPLING),
    )
    computed["touch_force"] = harness.effects.force.press_layer(
        touch_height_map=given["touch_height_map"],
        sensor=given["sensor"],
        sensor_elastic=given["sensor_elastic"],
        touch_force_cells=accuracy.of(harness.effects.force.CELLS),
    )
    computed["touch_force"] = harness.effects.force.press_springs(
        touch_height_map=given["touch_height_map"],
        sensor=given["sensor"],
        sensor_elastic=given["sensor_elastic"],
    )
    computed["touch_force"] = harness.effects.force.look_up_force(
        touch_height_map=given["touch_height_map"],
        sensor=given["sensor"],
        sensor_forces=given["sensor_forces"],
    )
    computed["contact_presses"] = harness.effects.touch.find_presses(
        object_mesh=given["object_mesh"], contact_gel_from_object=given["contact_gel_from_object"]
    )
    computed["object_touch_codes"] = harness.effects.touch.open_touch_codes(
        object_file=given["object_file"],
        object_mesh=given["object_mesh"],
        object_wall=given["object_wall"],
        sensor=given["sensor"],
        sensor_calibration=given["sensor_calibration"],
    )
    computed["touch_gel"] = harness.effects.touch.deform_gel(
        touch_height_map=given["touch_height_map"],
        sensor=given["sensor"],
        sensor_calibration=given["sensor_calibration"],
        touch_gel=accuracy.of(harness.effects.touch.GEL),
    )
    computed["touch_gel"] = harness.effects.touch.decode_gel(
        object_touch_codes=given["object_touch_codes"], contact_presses=given["contact_presses"]
    )
    computed["touch_colour"] = harness.effects.touch.render_colour(
        touch_gel=given["touch_gel"],
        sensor=given["sensor"],
        sensor_calibration=given["sensor_calibration"],
        touch_optics=accuracy.of(harness.effects.touch.OPTICS),
    )
    computed["touch_darkening"] = harness.effects.touch.compute_darkening(
        touch_colour=given["touch_colour"],
        touch_height_map=given["touch_height_map"],
        touch_gel=given["touch_gel"],
        sensor=given["sensor"],
        sensor_calibration=given["sensor_calibration"],
        sensor_shadow_table=given["sensor_shadow_table"],
        sensor_rest=given["sensor_rest"],
    )
    computed["touch_shadow"] = harness.effects.touch.cast_shadow(
        touch_colour=given["touch_colour"], touch_darkening=given["touch_darkening"]
    )
    computed["touch_shadow"] = given["touch_colour"]
    computed["touch_shadow_out_of_table"] = harness.effects.touch.select_out_of_table(
        touch_darkening=given["touch_darkening"]
    )
    computed["touch_marker_motion"] = harness.effects.touch.move_markers(
        touch_height_map=given["touch_height_map"],
        sensor=given["sensor"],
        sensor_dots=given["sensor_dots"],
        touch_marker_motion=accuracy.of(harness.effects.touch.MARKER_NODES),
    )
    computed["touch_markers"] = harness.effects.touch.print_markers(
        touch_shadow=given["touch_shadow"],
        touch_marker_motion=given["touch_marker_motion"],
        sensor=given["sensor"],
        sensor_dots=given["sensor_dots"],
    )
    computed["touch_markers"] = given["touch_shadow"]
    computed["touch_noise"] = harness.effects.touch.add_noise(
        touch_markers=given["touch_markers"], sensor_noise=given["sensor_noise"], seed=given["seed"]
    )
    computed["touch_noise"] = given["touch_markers"]
    computed["touch_image"] = harness.effects.touch.quantize_image(touch_noise=given["touch_noise"])
    computed["object_modes"] = harness.effects.sound.solve_modes(
        object_mesh=given["object_mesh"],
        object_wall=given["object_wall"],
        object_material=given["object_material"],
        sound_edge=accuracy.of(harness.effects.sound.EDGE),
        sound_modes=accuracy.of(harness.effects.sound.MODES),
    )
    computed["object_modes"] = harness.effects.sound.evaluate_network(
        object_file=given["object_file"],
        object_mesh=given["object_mesh"],
        object_wall=given["object_wall"],
        object_material=given["object_material"],
        sound_modes=accuracy.of(harness.effects.sound.MODES),
    )
    computed["object_modes"] = harness.effects.sound.read_table(
        object_file=given["object_file"],
        object_mesh=given["object_mesh"],
        object_wall=given["object_wall"],
        object_material=given["object_material"],
        sound_modes=accuracy.of(harness.effects.sound.MODES),
    )
    computed["object_sound"] = harness.effects.sound.ring_object(
        object_modes=given["object_modes"],
        object_material=given["object_material"],
        strike=given["strike"],
        microphone=given["microphone"],
    )
    computed["room_reverberation"] = harness.effects.sound.reverberate(
        object_sound=given["object_sound"], room=given["room"], strike=given["strike"]
    )
    computed["room_reverberation"] = given["object_sound"]
    computed["microphone_pressure"] = harness.effects.sound.record_pressure(
        room_reverberation=given["room_reverberation"], microphone=given["microphone"], strike=given["strike"]
    )
    computed["object_lit"] = harness.effects.camera.prepare_object(
        object_appearance=given["object_appearance"]
    )
    computed["camera_seen"] = harness.effects.camera.trace_camera(
        object_lit=given["object_lit"],
        camera=given["camera"],
        camera_samples=accuracy.of(harness.effects.camera.SAMPLES),
    )
    computed["camera_falling"] = harness.effects.camera.illuminate(
        object_lit=given["object_lit"], camera_seen=given["camera_seen"], camera_lights=given["camera_lights"]
    )
    computed["camera_shadow"] = harness.effects.camera.cast_shadow(
        camera_falling=given["camera_falling"],
        object_lit=given["object_lit"],
        camera_seen=given["camera_seen"],
        camera_lights=given["camera_lights"],
    )
    computed["camera_shadow"] = given["camera_falling"]
    computed["object_vision"] = harness.effects.camera.open_object_vision(
        object_file=given["object_file"], object_mesh=given["object_mesh"], object_wall=given["object_wall"]
    )
    computed["camera_image"] = harness.effects.camera.gather_image(
        camera_seen=given["camera_seen"], camera_shadow=given["camera_shadow"]
    )
    computed["camera_image"] = harness.effects.camera.render_network(
        object_vision=given["object_vision"], camera=given["camera"], camera_lights=given["camera_lights"]
    )
    computed["touch_colour"] = harness.effects.touch.select_colour(touch_drawn=given["touch_drawn"])
    computed["touch_drawn"] = harness.effects.touch.render_images(
        touch_gel=given["touch_gel"],
        sensor=given["sensor"],
        sensor_calibration=given["sensor_calibration"],
        sensor_rest=given["sensor_rest"],
        touch_optics=accuracy.of(harness.effects.touch.OPTICS),
    )
    computed["touch_saturated"] = harness.effects.touch.select_saturated(touch_drawn=given["touch_drawn"])
    computed["touch_extrapolated"] = harness.effects.touch.select_extrapolated(
        touch_drawn=given["touch_drawn"]
    )
