"""One press of a gel: from a height map, a gel or a mesh and a pose to the picture and what limits it.

The effects of one press: the catalogue's, where something is given that the catalogue computes.

A press may bring its own height map, or its own gel; a published calibration brings the untouched gel's
surface. And one picture is asked what a batch is not: how much of it is clipped, and how much of it
is steeper than any press of the calibration.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.bench.scene import SceneFile
from harness.effects.accuracy import Accuracy, Level
from harness.effects.catalogue import EFFECTS, MARKER_NODES, OPTICS, SUPERSAMPLING
from harness.effects.effect import Effect, Facts, knobs_of
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.force_effects import pressed_of_gel
from harness.effects.plan import Plan, default_accuracy, plan
from harness.effects.touch_drawing import optics, reached
from harness.sim.gel.contact_force import ContactForce
from harness.sim.gel.gel import over_range, require_within_gel
from harness.sim.gel.height_file import Heights
from harness.sim.gel.markers import draw_markers, marker_displacements
from harness.sim.optics.optics import TactileImages
from harness.sim.optics.pressed_gel import Gel
from harness.sim.optics.shadow_image import darkening
from harness.sim.optics.tactile_calibration import Float32Array, TactileCalibration

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

REST = "sensor.rest"
"""Source: ``(rows, columns)`` metres, the untouched gel's surface towards the camera."""

DOTS = "sensor.dots"
"""Source: the ``MarkerFile`` of the very gel."""


@dataclass(frozen=True, eq=False)
class Press:
    """A press, drawn."""

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
        image: ByteArray = self.evaluation["touch.image"][0]
        return image

    @property
    def heights(self) -> FloatArray:
        """``(rows, columns)`` metres: how deep the object reaches, or the gel that was given."""
        return self.surface if self.of == "gel" else self._value("touch.height_map")

    @property
    def surface(self) -> FloatArray:
        """``(rows, columns)`` metres of indentation of the gel, as the camera sees it."""
        return self._value("touch.gel")

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
        return int(self.evaluation["touch.saturated"][0])

    @property
    def out_of_domain(self) -> float | None:
        """Share of pixels steeper than any press of the calibration; None where it does not say how steep."""
        if self.gel.calibration.header.slope_limit >= 1.0:
            return None
        return int(self.evaluation["touch.extrapolated"][0]) / self.contact.size

    @property
    def shadow_out_of_table(self) -> float | None:
        """Share of the contact's rim whose depth the shadow table does not hold; None without shadows."""
        if "touch.shadow_out_of_table" not in self.evaluation.values:
            return None
        return float(self.evaluation["touch.shadow_out_of_table"][0])

    @property
    def maps_measured(self) -> dict[str, float] | None:
        """Errors that an ObjectFile claims for the network that gave the gel's surface; None without one."""
        opened = self.evaluation.values.get("object.touch_codes")
        return None if opened is None else dict(opened.measured)

    @property
    def force(self) -> ContactForce | None:
        """With how much force it is pressed; None where that was not asked for."""
        found: ContactForce | None = self.evaluation.values.get("touch.force")
        return found

    @property
    def levels(self) -> dict[str, Any]:
        """Of every knob of an effect that ran."""
        return {name: level for step in self.plan.ran for name, level in step.levels.items()}

    def _value(self, quantity: str) -> FloatArray:
        value: FloatArray = self.evaluation[quantity][0]
        return value


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
    if of == "object":
        sources = {"touch.height_map": np.maximum(heights, 0.0)[None]}
        return _masked(_pressed(sources, of, gel, scene, levels, force), missing)
    if reached is None and (gel.sensor.casts_shadow or gel.sensor.markers is not None):
        raise WrongUse(
            "the surface of a gel does not say where the object touches, and shadows and dots go by that; "
            "give it with --reached FILE.npy, or leave them out (--no-shadow)"
        )
    touched = pressed_of_gel(heights) if reached is None else reached
    sources = {"touch.height_map": np.maximum(touched, 0.0)[None], "touch.gel": heights[None]}
    press = _pressed(sources, of, gel, scene, levels, force)
    if reached is not None:
        press = replace(press, contact=contact_of(reached, gel.calibration, "object"))
    return _masked(press, missing)


def _masked(press: Press, missing: BoolArray | None) -> Press:
    if missing is None or not missing.any():
        return press
    return replace(press, contact=press.contact & ~missing, missing=missing)


def press_mesh(
    sources: Mapping[str, Any],
    gel: Gel,
    scene: SceneFile,
    levels: Sequence[str] = (),
    force: bool = False,
) -> Press:
    """Draw the press of a mesh.

    Args:
        sources: ``object.mesh`` and ``contact.gel_from_object``, ``(1, 4, 4)``; ``contact.presses`` too where
            the place is known.
        gel: that is pressed.
        scene: says which senses and noises there are, and names an ObjectFile where touch comes from one.
        levels: as an operator writes them, ``"touch.optics=exact"``.
        force: whether to compute the force as well.

    Raises:
        WrongUse: an unknown knob or level; no ObjectFile where one is asked, or one of another object or gel.
        DataRefused: an ObjectFile without the touch that is asked for, or a damaged one.
        CalibrationRefused: a level that the calibration does not have.
        OutOfDomain: the object reaches deeper than the gel is thick, or beyond the table of forces.
    """
    return _pressed(sources, "object", gel, scene, levels, force)


def _pressed(
    given: Mapping[str, Any], of: Heights, gel: Gel, scene: SceneFile, levels: Sequence[str], force: bool
) -> Press:
    effects = press_effects(frozenset(given), gel.rest is not None, gel.dots is not None)
    press_knobs = knobs_of(_touching(press_effects(frozenset(), own_rest=False)))
    chosen = Accuracy.default(press_knobs).with_texts(levels)
    known = default_accuracy(effects)
    accuracy = known.with_({name: level for name, level in chosen.items() if name in known.levels})
    wanted = ["touch.image", "touch.saturated", "touch.extrapolated"]
    wanted += ["touch.shadow_out_of_table"] if gel.sensor.casts_shadow else []
    wanted += ["touch.force"] if force else []
    made = plan(effects, Facts(scene, gel.sensor), wanted, accuracy)
    dialled = {name for step in made.ran for name in step.levels}
    for text in levels:
        name = text.partition("=")[0].strip()
        if name not in dialled:
            raise WrongUse(
                f"{text}: nothing that runs here goes by {name}; leave it out (there are "
                f"{', '.join(sorted(dialled))})"
            )
    sources: dict[str, Any] = {
        "sensor": gel.sensor,
        "sensor.calibration": gel.calibration,
        REST: gel.rest,
        DOTS: gel.dots,
        "sensor.shadow_table": gel.shadow,
        "sensor.noise": gel.noise,
        "seed": gel.seed,
        "sensor.elastic": gel.elastic,
        "sensor.forces": gel.forces,
    }
    sources |= {"object.wall": scene.object.wall, **_file(made, scene)}
    done = evaluate(made, {**sources, **given})
    values = replace(done, values={**given, **done.values})
    for name in ("touch.height_map", "touch.gel"):
        if name in values.values:
            require_within_gel(values.values[name], gel.sensor)
    seen: Heights = of if "touch.height_map" in values.values else "gel"
    heights = values["touch.gel" if seen == "gel" else "touch.height_map"][0]
    return Press(gel, made, values, contact_of(heights, gel.calibration, seen), seen)


def _file(made: Plan, scene: SceneFile) -> dict[str, Any]:
    """The scene's ObjectFile, where something that runs is computed from it."""
    if "object.file" not in made.sources or scene.object.objectfile is None:
        return {}
    from harness.objectfile.file import ObjectFile

    return {"object.file": ObjectFile.open(Path(scene.object.objectfile))}


def _touching(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    return tuple(effect for effect in effects if effect.provides.startswith("touch."))


def press_effects(given: frozenset[str], own_rest: bool, own_dots: bool = False) -> tuple[Effect, ...]:
    """The effects of a press.

    Args:
        given: quantities of the catalogue that come as sources: ``"touch.height_map"``, ``"touch.gel"``.
        own_rest: whether the untouched gel's surface is the source ``sensor.rest``; else it is the
            sensor's, flat or a dome.
        own_dots: whether the untouched dots are the source ``sensor.dots``; else they are the sensor's grid.
    """
    effects = {effect.provides: effect for effect in EFFECTS if effect.provides not in given}
    effects["touch.colour"] = Effect("touch.colour", ("touch.drawn",), _colour)
    rest = (REST,) if own_rest else ()
    needs = ("touch.gel", "sensor", "sensor.calibration", *rest)
    effects["touch.drawn"] = Effect("touch.drawn", needs, _drawn, knobs=(OPTICS,))
    effects["touch.saturated"] = Effect("touch.saturated", ("touch.drawn",), _saturated)
    effects["touch.extrapolated"] = Effect("touch.extrapolated", ("touch.drawn",), _extrapolated)
    if own_rest:
        shadowed = effects["touch.darkening"]
        effects["touch.darkening"] = replace(shadowed, needs=(*shadowed.needs, REST), compute=_darkening)
    if own_dots:
        for name, compute in (("touch.marker_motion", _marker_motion), ("touch.markers", _markers)):
            effects[name] = replace(effects[name], needs=(*effects[name].needs, DOTS), compute=compute)
    if own_rest and "touch.height_map" in effects:
        raster = effects["touch.height_map"]
        effects["touch.height_map"] = replace(raster, needs=(*raster.needs, REST), compute=_height_map)
    return tuple(effects.values())


def contact_of(
    penetration: FloatArray, calibration: TactileCalibration, of: Literal["object", "gel"]
) -> BoolArray:
    """``(rows, columns)`` where the object touches the gel.

    Of an object, every pixel where it reaches the gel. Of a gel, what the object surely shapes: the
    skirt's share of the deepest pixel and more.
    """
    share = calibration.header.skirt.core if of == "gel" else 0.0
    touched: BoolArray = (penetration > 0.0) & (penetration >= share * penetration.max())
    return touched


def _drawn(given: Given, levels: Levels) -> TactileImages:
    level, rest = str(levels[OPTICS.name]), given.get(REST)
    return optics(given["sensor.calibration"], level, given["sensor"], rest).render(given["touch.gel"])


def _colour(given: Given, _levels: Levels) -> ByteArray:
    images: ByteArray = given["touch.drawn"].images
    return images


def _saturated(given: Given, _levels: Levels) -> IntArray:
    counts: IntArray = given["touch.drawn"].saturated
    return counts


def _extrapolated(given: Given, _levels: Levels) -> IntArray:
    counts: IntArray = given["touch.drawn"].extrapolated
    return counts


def _darkening(given: Given, _levels: Levels) -> tuple[Float32Array, FloatArray]:
    return darkening(
        given["touch.colour"],
        given["touch.height_map"],
        given["touch.gel"],
        given["sensor"],
        given["sensor.calibration"],
        given["sensor.shadow_table"],
        given[REST],
    )


def _marker_motion(given: Given, levels: Levels) -> FloatArray:
    """As the catalogue's, of dots that were measured."""
    sensor, dots = given["sensor"], given[DOTS]
    pressed, _ = over_range(given["touch.height_map"], sensor)
    return marker_displacements(pressed, sensor, float(levels[MARKER_NODES.name]), dots.in_gel(sensor.pitch))


def _markers(given: Given, _levels: Levels) -> ByteArray:
    sensor, dots = given["sensor"], given[DOTS]
    at = dots.in_gel(sensor.pitch)
    return draw_markers(given["touch.shadow"], given["touch.marker_motion"], sensor, dots.ink, at)


def _height_map(given: Given, levels: Levels) -> FloatArray:
    """As the catalogue's, over a surface of the gel's own."""
    poses, rays = given["contact.gel_from_object"], int(levels[SUPERSAMPLING.name])
    return reached(given["object.raster"], poses, given["sensor"], rays, given[REST])
