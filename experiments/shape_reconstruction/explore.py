"""The steps of a shape reconstruction: a look, then presses."""

from collections.abc import Iterator, Sequence
from functools import partial

from experiments.shape_reconstruction.section import ShapeRun
from harness.basics.mesh import Mesh
from harness.bench.reading import Reading
from harness.bench.scene import SceneFile
from harness.bench.station import Bench
from harness.bench.station_file import Station
from harness.experiment.experiment import Helpers, Planned
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step
from harness.skills.look import look
from harness.skills.planning import ContactRequest, plan_run
from harness.skills.press import PressPerformer
from harness.skills.sites import PressLimits
from harness.twin.bench_of import way_between

PLAN_KEY = "steps"


def plan(scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> Planned:
    """A look where there is a camera, then presses on the drawing."""
    asked = scene.section(ShapeRun)
    limits = PressLimits(tilt=asked.tilt, depth=asked.depth)
    made = plan_run(scene, station, mesh, seed, ContactRequest(asked.presses, "spread", limits))
    looks = [{"kind": "look"}] if scene.sensors.camera else []
    presses = [{"kind": "press", **parameters} for parameters in made.parameters()]
    return Planned([*looks, *presses], made.rehearsal, made.bench)


class ShapePerformer:
    """Looks, then presses.

    Args:
        run: the folder.
        helpers: what a step may use beside the bench.
    """

    def __init__(self, run: RunFiles, helpers: Helpers) -> None:
        self._run, self._ask = run, helpers.ask
        way = partial(way_between, helpers.twin)
        self._press = PressPerformer(way, ask=helpers.ask, plan_key=PLAN_KEY, explores=True)

    def steps(self, recording: Recording) -> Iterator[Step]:
        """Those that are not on the disk."""
        planned = recording.header.plan[PLAN_KEY]
        for index in range(recording.committed, len(planned)):
            yield Step(index, planned[index]["kind"], planned[index])

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """A look, or a press."""
        if step.kind == "look":
            return look(step.index, bench, self._ask)
        return self._press.perform(step, bench)
