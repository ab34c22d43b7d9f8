"""A localization's contacts, planned and rehearsed."""

from experiments.contact_localization.section import Localization
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.experiment import Planned
from harness.skills.planning import ContactRequest, RunPlan, plan_run
from harness.skills.sites import PressLimits


def plan_contacts(scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> RunPlan:
    """Choose the places that the scene asks for, plan the ways, rehearse the whole."""
    asked = scene.section(Localization)
    wanted = ContactRequest(asked.contacts, asked.spacing, PressLimits(asked.step, asked.tilt, asked.depth))
    return plan_run(scene, station, mesh, seed, wanted)


def plan(scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> Planned:
    """The same, as a run's folder keeps it."""
    made = plan_contacts(scene, station, mesh, seed)
    pressed = [site.base_from_gel.tolist() for site in made.sites]
    return Planned(made.parameters(), made.rehearsal, made.bench, {"pressed": pressed})
