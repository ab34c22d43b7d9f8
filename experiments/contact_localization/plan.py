"""A localization's contacts, planned and rehearsed."""

from experiments.contact_localization.next_contact import PLACEHOLDER
from experiments.contact_localization.section import Localization
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.experiment import Planned
from harness.skills.planning import ContactRequest, RunPlan, plan_run
from harness.skills.sites import PressLimits


def plan_contacts(
    scene: SceneFile, station: Station, mesh: Mesh, seed: int, contacts: int | None = None
) -> RunPlan:
    """Choose the places that the scene asks for, plan the ways, rehearse the whole.

    Args:
        scene: says which places.
        station: whose arm it is for.
        mesh: of the object, in metres.
        seed: of the choice.
        contacts: how many; None for all that the scene asks for.
    """
    asked = scene.section(Localization)
    count = asked.contacts if contacts is None else contacts
    wanted = ContactRequest(count, asked.spacing, PressLimits(asked.step, asked.tilt, asked.depth))
    return plan_run(scene, station, mesh, seed, wanted)


def plan(scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> Planned:
    """The same, as a run's folder keeps it; of contacts that are chosen on the way, the first.

    Raises:
        WrongUse: contacts are to end when the place is known so well, and are not chosen one by one; or too
            few places that the arm can reach on a free way.
        MotionRefused: the rehearsal found a motion that must not be made.
    """
    asked = scene.section(Localization)
    if asked.choose == "planned" and asked.until is not None:
        raise WrongUse(
            f"[localization] until = {1e3 * asked.until:g} mm ends contacts that are chosen one by one, and "
            'choose = "planned" makes all of them: set choose = "active", or leave until out'
        )
    chosen = asked.contacts - 1 if asked.choose == "active" else 0
    made = plan_contacts(scene, station, mesh, seed, asked.contacts - chosen)
    pressed = [site.base_from_gel.tolist() for site in made.sites]
    steps = [*made.parameters(), *[dict(PLACEHOLDER)] * chosen]
    return Planned(steps, made.rehearsal, made.bench, {"pressed": pressed}, chosen)
