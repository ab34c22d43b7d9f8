"""The steps of a scale estimation: a look, then contacts planned one by one on what is known by then."""

from statistics import NormalDist

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.next_contact import Explorer
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.size import CREDIBLE, SHARED
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.experiment import ErrorBound, Helpers, Planned
from harness.recording.run_folder import RunFiles
from harness.skills.exploring.exploration import Exploration, kinds
from harness.twin.rehearsal import rehearse


def steps_of(scene: SceneFile) -> int:
    """How many steps a run of a scene has, if it is not surer before."""
    sensors = scene.sensors
    contacts = scene.section(Scale).contacts if sensors.touch or sensors.sound else 0
    return int(sensors.camera) + contacts


def smallest_error(scene: SceneFile, mesh: Mesh) -> ErrorBound:
    """Return the narrowest half interval that an answer can state: every sense shares ``SHARED``."""
    nominal = float((mesh.bounds[1] - mesh.bounds[0]).max())
    low = scene.object.sizes_of(nominal)[0] if scene.object.is_hidden else nominal
    half = NormalDist().inv_cdf(0.5 + 0.5 * CREDIBLE)
    return ErrorBound(
        half * SHARED * low,
        f"half the 90 % interval of an object {1e3 * low:.0f} mm long: all senses share an error of "
        f"{100 * SHARED:g} % of the size, which no contact reduces",
        "or leave it out to make every contact",
    )


def plan(scene: SceneFile, station: Station, mesh: Mesh, _seed: int) -> Planned:
    """A look where there is a camera, then so many contacts; each is planned once those before are read.

    Raises:
        WrongUse: nothing is to be read, or the scene names networks that only a table uses.
    """
    if scene.section(Scale).paper_networks is not None:
        raise WrongUse(
            "[scale] paper_networks adds rows to a table and is not used by a run; leave it out of the "
            "scene, or measure with: touchstone tables scale-estimation --set paper_networks=FOLDER"
        )
    looks, count = scene.sensors.camera, steps_of(scene)
    if count == 0:
        raise WrongUse("nothing is to be read: ask for vision, for contacts, or for both")
    model = ObjectModel(mesh, scene, station)
    bench = model.twin_around(model.nowhere)
    steps = kinds(looks, count - looks)
    return Planned(steps, rehearse(bench, []), bench, on_the_way=count - looks)


def performer(run: RunFiles, helpers: Helpers) -> Exploration:
    """Looks, then presses and strikes where the object must be, by what is known so far.

    Args:
        run: the folder.
        helpers: what a step may use beside the bench.
    """
    explorer = Explorer(run)
    enough = "the size is known as well as was asked"
    return Exploration(explorer, helpers.ask, helpers.say, enough, explorer.strike)
