"""A plan in words: which effects run and which not, and why."""

from typing import Any

from rich.table import Table

from harness.bench.scene import SceneFile
from harness.bench.sensor import TactileSensor
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Facts
from harness.effects.plan import Plan, default_accuracy, plan
from harness.effects.sound_effects import SOUND_EFFECTS

MODES = "object.modes"


def scene_plan(scene: SceneFile, sensor: TactileSensor, accuracy: Accuracy | None = None) -> Plan:
    """What would be simulated to compare a bench with this scene.

    Args:
        scene: says what is observed.
        sensor: on the flange.
        accuracy: levels; None for the default ones.

    Raises:
        WrongUse: ``observe`` names something that nothing computes or that the scene rules out.
    """
    return plan(EFFECTS, Facts(scene, sensor), wanted_of(scene), accuracy or default_accuracy(EFFECTS))


def wanted_of(scene: SceneFile) -> tuple[str, ...]:
    """What the scene observes and, where it is heard, the modes that its sounds are compared with."""
    heard = scene.sensors.sound and MODES not in scene.observe
    return (*scene.observe, MODES) if heard else scene.observe


def without_sound(scene: SceneFile) -> SceneFile:
    """The scene where nothing is to be heard, nor any quantity of sound observed."""
    audible = {effect.provides for effect in SOUND_EFFECTS}
    silent = scene.sensors.model_copy(update={"sound": False})
    observed = tuple(name for name in scene.observe if name not in audible)
    return scene.model_copy(update={"sensors": silent, "observe": observed})


def as_json(chosen: Plan) -> dict[str, Any]:
    """``{"ran": [{effect, reason, levels}], "skipped": [{effect, reason}]}``."""
    ran = [
        {"effect": step.effect.provides, "reason": step.reason, "levels": dict(step.levels)}
        for step in chosen.ran
    ]
    skipped = [{"effect": step.effect.provides, "reason": step.reason} for step in chosen.skipped]
    return {"ran": ran, "skipped": skipped}


def as_table(chosen: Plan, left_out: bool = True) -> Table:
    """The same for a terminal.

    Args:
        chosen: the plan.
        left_out: whether an effect that does not run has a row too.
    """
    table = Table(title=f"to compute {', '.join(chosen.wanted)}")
    for heading in ("effect", "runs", "why", "levels"):
        table.add_column(heading)
    for step in chosen.ran:
        levels = ", ".join(f"{name} = {level}" for name, level in step.levels.items())
        table.add_row(step.effect.provides, "[green]yes[/]", step.reason, levels)
    for skipped in chosen.skipped if left_out else ():
        reason = skipped.reason.replace("[", r"\[")
        table.add_row(skipped.effect.provides, "no", reason, "", style="dim")
    return table


def left_out(chosen: Plan) -> list[str]:
    """A sentence for each reason why effects do not run: ``"the gel has no markers: touch.markers, ..."``."""
    named: dict[str, list[str]] = {}
    for skipped in chosen.skipped:
        name = skipped.effect.provides
        # What passes through in its place, and its own name, would make every reason another one.
        reason = skipped.reason.split("; ")[0].replace(f" {name}", " it")
        named.setdefault(reason, []).append(name)
    return [f"{reason}: {', '.join(names)}" for reason, names in named.items()]
