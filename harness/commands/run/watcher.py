"""Print the reports of a run: progress on standard error, the answer on standard output."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from functools import partial

from harness.commands.output import ANSWERS, CONSOLE, step_progress, warn
from harness.effects.explain import as_table, left_out, networks_as_table, networks_in_use, scene_plan
from harness.experiment.begin import Begun
from harness.recording.session import Progress
from harness.tasks.runs import PlannedRun, RunWatcher


class TerminalWatcher(RunWatcher):
    """Prints the reports of a run; with ``--json`` neither the answer nor requests to the operator."""

    def __init__(self, as_json: bool) -> None:
        self._as_json = as_json
        self.ask = None if as_json else partial(CONSOLE.print, markup=False, style="bold")

    def report(self, sentence: str) -> None:
        """Print a sentence about the progress."""
        CONSOLE.print(sentence, markup=False)

    def warn(self, sentence: str) -> None:
        """Print a warning."""
        warn(sentence)

    def track_steps(self, done: int, total: int, noun: str) -> AbstractContextManager[Progress]:
        """Show a progress bar over the steps."""
        return step_progress(done, total, noun)

    def show_answer(self, lines: Sequence[str]) -> None:
        """Print the answer in words."""
        if not self._as_json:
            for line in lines:
                ANSWERS.print(line, markup=False)
            self.report("comparing with the simulation, drawing the report")

    def show_plan(self, run: PlannedRun, begun: Begun) -> None:
        """Print the plan of the run, and the simulated effects with their levels."""
        experiment, files = run.experiment, run.files
        for line in begun.known.read:
            self.report(line)
        section = {} if experiment.section is None else vars(files.scene.section(experiment.section))
        spaced = f", {section['spacing']}" if section.get("spacing") is not None else ""
        later, waiting = begun.plan.on_the_way, ""
        if later:
            what = f"{later} {experiment.plural} are" if later > 1 else f"1 {experiment.step} is"
            waiting = f"; {what} planned, and rehearsed, once those before are read"
        low, high = files.mesh.bounds
        self.report(
            f"{files.scene.object.name}: {len(files.mesh.faces)} faces, longest side "
            f"{1e3 * (high - low).max():.0f} mm; {len(begun.plan.steps)} {experiment.plural}{spaced}; "
            f"station {files.station.title}"
        )
        self.report(
            f"rehearsed in the twin: {begun.plan.rehearsal.segments} motions, none refused; "
            f"{len(begun.plan.rehearsal.warnings)} warnings{waiting}"
        )
        effects = scene_plan(files.scene, files.station.gel.sensor, run.accuracy)
        CONSOLE.print(as_table(effects, left_out=False))
        networks = networks_in_use(files.scene, effects)
        if networks:
            CONSOLE.print(networks_as_table(networks))
        self.report("not simulated:")
        for sentence in left_out(effects):
            self.report(f"  {sentence}")
