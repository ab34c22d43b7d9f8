"""One press of a gel: from a height map, a gel or a mesh and a pose to the picture and its limits.

A press may bring its own height map, or its own gel; these take the place of the effects that compute them. A
published calibration brings the surface of the untouched gel. The catalogue of a press has three effects more
than that of a scene: it counts how much of the picture is clipped, and how much of it is steeper than any
press of the calibration.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.basics.arrays import BoolArray, ByteArray, FloatArray
from harness.basics.errors import WrongUse
from harness.bench.scene import SceneFile
from harness.effects import touch
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Effect, Facts, build_catalogue, knobs_of, quantity_name
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.plan import Plan, default_accuracy, plan
from harness.effects.quantities import Quantities
from harness.objectfile.file import ObjectFile
from harness.sim.gel.contact_force import ContactForce, pressed_of_gel
from harness.sim.gel.gel import require_within_gel
from harness.sim.gel.height_file import Heights
from harness.sim.optics.known_gel import Gel
from harness.sim.optics.tactile_calibration import TactileCalibration

_COLOUR = Effect("touch.colour", touch.select_colour)

PRESS_EFFECTS = build_catalogue(
    *(_COLOUR if effect.provides == _COLOUR.provides else effect for effect in EFFECTS),
    Effect("touch.drawn", touch.render_images, knobs=(touch.OPTICS,)),
    Effect("touch.saturated", touch.select_saturated),
    Effect("touch.extrapolated", touch.select_extrapolated),
)
"""Every effect of a press."""

_KNOBS = knobs_of(effect for effect in PRESS_EFFECTS if effect.provides.startswith("touch."))


@dataclass(frozen=True, eq=False)
class Press:
    """One press of a gel and its picture."""

    gel: Gel  #: that was pressed.
    plan: Plan  #: what ran, what did not, and why.
    evaluation: Evaluation  #: every quantity on the way.
    contact: BoolArray  #: ``(rows, columns)`` where the object touches.
    of: Heights  #: whether the heights are of the object or, given or of an ObjectFile's network, of the gel.
    missing: BoolArray | None = None
    """``(rows, columns)`` where a given map had no height; None where every pixel has one."""

    @property
    def image(self) -> ByteArray:
        """``(rows, columns, 3)`` RGB."""
        image: ByteArray = self.evaluation.values["touch_image"][0]
        return image

    @property
    def heights(self) -> FloatArray:
        """``(rows, columns)`` metres: how deep the object reaches, or the gel that was given."""
        if self.of == "gel":
            return self.surface
        reached: FloatArray = self.evaluation.values["touch_height_map"][0]
        return reached

    @property
    def surface(self) -> FloatArray:
        """``(rows, columns)`` metres of indentation of the gel, as the camera sees it."""
        surface: FloatArray = self.evaluation.values["touch_gel"][0]
        return surface

    @property
    def deepest(self) -> float:
        """Metres that the object reaches into the undeformed gel; 0 without contact."""
        return max(0.0, float(self.heights.max()))

    @property
    def touches_border(self) -> bool:
        """Whether the contact reaches the edge of what the camera sees."""
        edge = np.ones_like(self.contact)
        edge[1:-1, 1:-1] = False
        return bool((self.contact & edge).any())

    @property
    def saturated(self) -> int:
        """Values of the picture clipped to black or white by the optics."""
        return int(self.evaluation.values["touch_saturated"][0])

    @property
    def out_of_domain(self) -> float | None:
        """Share of pixels steeper than any press of the calibration; None where it does not say how steep."""
        if self.gel.calibration.header.slope_limit >= 1.0:
            return None
        return int(self.evaluation.values["touch_extrapolated"][0]) / self.contact.size

    @property
    def shadow_out_of_table(self) -> float | None:
        """Share of the contact's rim whose depth the shadow table does not hold; None without shadows."""
        share = self.evaluation.touch.shadow_out_of_table
        return None if share is None else float(share[0])

    @property
    def maps_measured(self) -> dict[str, float] | None:
        """Errors that an ObjectFile claims for the network that gave the gel's surface; None without one."""
        codes = self.evaluation.touch.codes
        return None if codes is None else dict(codes.measured)

    @property
    def force(self) -> ContactForce | None:
        """With how much force it is pressed; None where that was not asked for."""
        return self.evaluation.touch.force


def press_heights(
    heights: FloatArray,
    of: Heights,
    gel: Gel,
    scene: SceneFile,
    levels: Sequence[str] = (),
    reached: FloatArray | None = None,
    missing: BoolArray | None = None,
    force: bool = False,
) -> Press:
    """Draw the press of a height map.

    Args:
        heights: ``(rows, columns)`` metres, checked by ``given_heights``.
        of: the object, around which the gel's skirt is then hung, or the gel itself.
        gel: that is pressed.
        scene: says which senses and noises there are.
        levels: as an operator writes them, ``"touch.optics=exact"``.
        reached: beside a gel, ``(rows, columns)`` metres, how deep the object reaches: shadows and printed
            dots go by it. Without it the contact is taken as what the object surely shapes.
        missing: ``(rows, columns)`` where no height was given: drawn as filled, and counted as no contact.
        force: whether to compute the force as well. Of a gel without ``reached``, what is deeper than a tenth
            of its deepest pixel is taken to be pressed.

    Raises:
        WrongUse: an unknown knob or level; shadows or dots of a gel of which nobody says what pressed it.
        CalibrationRefused: a level that the calibration does not have.
        OutOfDomain: heights deeper than the gel is thick, or beyond the table of forces.
    """
    sources: Quantities = {"touch_height_map": np.maximum(heights, 0.0)[None]}
    if of == "gel":
        if reached is None and (gel.sensor.casts_shadow or gel.sensor.markers is not None):
            raise WrongUse(
                "the surface of a gel does not say where the object touches, and shadows and dots go by "
                "that; give it with --reached FILE.npy, or leave them out (--no-shadow)"
            )
        touched = pressed_of_gel(heights) if reached is None else reached
        sources = {"touch_height_map": np.maximum(touched, 0.0)[None], "touch_gel": heights[None]}
    press = press_gel(sources, gel, scene, levels, force, of)
    if of == "gel" and reached is not None:
        press = replace(press, contact=_contact_of(reached, gel.calibration, "object"))
    if missing is None or not missing.any():
        return press
    return replace(press, contact=press.contact & ~missing, missing=missing)


def press_gel(
    sources: Quantities,
    gel: Gel,
    scene: SceneFile,
    levels: Sequence[str] = (),
    force: bool = False,
    of: Heights = "object",
) -> Press:
    """Draw one press of a gel.

    Args:
        sources: ``object_mesh`` and ``contact_gel_from_object``, ``(1, 4, 4)``, and ``contact_presses`` too
            where the place is known; or quantities that take their place, such as ``touch_height_map``.
        gel: that is pressed.
        scene: says which senses and noises there are, and names an ObjectFile where touch comes from one.
        levels: as an operator writes them, ``"touch.optics=exact"``.
        force: whether to compute the force as well.
        of: whether the press is known by the object, or by the gel alone.

    Raises:
        WrongUse: an unknown knob or level; no ObjectFile where one is asked, or one of another object or gel.
        DataRefused: an ObjectFile without the touch that is asked for, or a damaged one.
        CalibrationRefused: a level that the calibration does not have.
        OutOfDomain: the object reaches deeper than the gel is thick, or beyond the table of forces.
    """
    whole: Quantities = {
        "sensor": gel.sensor,
        "sensor_calibration": gel.calibration,
        "sensor_rest": gel.rest,
        "sensor_dots": gel.dots,
        "sensor_noise": gel.noise,
        "seed": gel.seed,
        "sensor_elastic": gel.elastic,
        "sensor_forces": gel.forces,
        "object_wall": scene.object.wall,
        **sources,
    }
    if gel.shadow is not None:
        whole["sensor_shadow_table"] = gel.shadow
    wanted = ["touch.image", "touch.saturated", "touch.extrapolated"]
    wanted += ["touch.shadow_out_of_table"] if gel.sensor.casts_shadow else []
    wanted += ["touch.force"] if force else []
    chosen = Accuracy.default(_KNOBS).with_texts(levels)
    accuracy = default_accuracy(PRESS_EFFECTS).with_(chosen)
    made = plan(PRESS_EFFECTS, Facts(scene, gel.sensor), wanted, accuracy, map(quantity_name, whole))
    for text in levels:
        name = text.partition("=")[0].strip()
        if name not in made.levels:
            raise WrongUse(
                f"{text}: nothing that runs here goes by {name}; leave it out (there are "
                f"{', '.join(sorted(made.levels))})"
            )
    if "object.file" in made.sources and scene.object.objectfile is not None:
        whole["object_file"] = ObjectFile.open(Path(scene.object.objectfile))
    done = evaluate(made, whole)
    result = done.touch
    for depths in (result.height_map, result.gel):
        if depths is not None:
            require_within_gel(depths, gel.sensor)
    seen: Heights = "gel" if result.height_map is None else of
    heights = done.values["touch_gel" if seen == "gel" else "touch_height_map"][0]
    return Press(gel, made, done, _contact_of(heights, gel.calibration, seen), seen)


def _contact_of(penetration: FloatArray, calibration: TactileCalibration, of: Heights) -> BoolArray:
    """``(rows, columns)`` where the object touches the gel.

    Of an object, every pixel where it reaches the gel. Of a gel, what the object surely shapes: the
    skirt's share of the deepest pixel and more.
    """
    share = calibration.header.skirt.core if of == "gel" else 0.0
    touched: BoolArray = (penetration > 0.0) & (penetration >= share * penetration.max())
    return touched
