"""Fixtures for the page of a run with contents that each test chooses."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from harness.agreement.agreement import Agreement
from harness.bench.acquisition import shipped_acquisition
from harness.bench.acquisition_channels import BLOCK, FORCE, PRESSURE, block_channel
from harness.bench.device import Channel, Health, Reading
from harness.bench.station_file import load_station, station_path
from harness.effects.accuracy import Knob
from harness.effects.catalogue import EFFECTS
from harness.experiment.compare import Comparison
from harness.experiment.experiment import AnyExperiment, AnyScored
from harness.experiment.report_content import COUNT, AnswerValue, RunReport
from harness.recording.run_folder import RunFiles
from harness.report.run_page import write_run_page
from harness.sim.optics.tactile_calibration import shipped_calibration

BOX = shipped_acquisition("acquisition_bench")
SPACING = Knob("stub.spacing", (4e-3, 2e-3), "m", "number", 2e-3, "distance of the samples")
REPORT = RunReport(
    "The contact is at (1.0, 2.0, 3.0) mm on the mug.",
    (
        AnswerValue("position", "(1.0, 2.0, 3.0)", "mm", "90 % within 2.1 mm"),
        AnswerValue("likely positions", "2", COUNT),
    ),
    seconds={"search": 0.0123, "refinement": 2.5},
)
OBSERVED = {"shape": [2, 120, 160, 3], "least": 0.0, "mean": 97.0, "most": 254.0}
HEALTH = {"arm": Health("arm", "127.0.0.1:30004", 499.9, 0, 1e-3, "reopened once")}


def reading(name: str, count: int) -> Reading:
    values = np.zeros((count, BLOCK), np.int32)
    return Reading(block_channel(name, BLOCK, 50_000.0), np.arange(float(count)), values)


def poses(count: int) -> Reading:
    return Reading(
        Channel("arm.joints", "rad", (6,), "float64"), np.arange(float(count)), np.zeros((count, 6))
    )


def stub_run(box: Any = BOX, mock: bool = True) -> RunFiles:
    """Write the files of a run's folder that the page reads."""
    readings = {FORCE: reading(FORCE, 4), PRESSURE: reading(PRESSURE, 3), "arm.joints": poses(70)}
    recording = SimpleNamespace(
        steps=lambda: [SimpleNamespace(readings=readings)] * 2,
        header=SimpleNamespace(
            created="2026-11-11T00:00:00+00:00",
            mock={} if mock else None,
            versions={"numpy": "2.3.1", "git": "054b11f+"},
        ),
        committed=2,
        folder="runs/20260302-140512-mug",
    )
    described = SimpleNamespace(name="mug", material="ceramic", objectfile=None)
    made = SimpleNamespace(
        recording=recording,
        scene=SimpleNamespace(title="", object=described),
        station=load_station(station_path("mock")),
        calibration=shipped_calibration("gelsight_r15_bench"),
        acquisition=box,
        mesh=SimpleNamespace(vertices=(), faces=()),
    )
    return cast(RunFiles, made)


@dataclass(frozen=True)
class Stub:
    """A page's content, each part of which a test may replace."""

    report: RunReport = REPORT
    title: str = "Contact localization"
    health: Mapping[str, Health] | None = field(default_factory=lambda: HEALTH)
    mock: bool = True
    world: Mapping[str, Any] | None = field(
        default_factory=lambda: {"gel_centre_m": [3e-4, -6e-5, 0.0], "sound": {"modes": 13}}
    )
    warnings: tuple[str, ...] = ("The calibration was fitted at 22 degrees; the gel was at 27.",)
    agreement: Agreement | None = None

    def write(self, folder: Path) -> Path:
        """The page."""
        truth = None if self.world is None else SimpleNamespace(differences=self.world)
        scored = SimpleNamespace(
            run=stub_run(mock=self.mock), truth=truth, warnings=self.warnings,
            result={"seconds": 2.5123}, accuracy={SPACING.name: SPACING.default, "touch.optics": "fast"},
        )  # fmt: skip
        effects = {effect.provides: effect for effect in EFFECTS}
        plan = SimpleNamespace(
            ran=[SimpleNamespace(effect=effects["touch.image"], reason="the scene observes it")],
            skipped=[SimpleNamespace(effect=effects["touch.shadow"], reason="the sensor casts no shadow")],
        )
        evaluation = SimpleNamespace(from_store=(), calls={"touch.image": 3}, seconds={"touch.image": 0.25})
        comparison = SimpleNamespace(
            plan=plan,
            evaluation=evaluation,
            observed=lambda: {"touch.image": OBSERVED},
            agreement=self.agreement,
        )  # fmt: skip
        experiment = SimpleNamespace(
            name="stub", title=self.title, plural="contacts", knobs=(SPACING,), measured="", measurement=None,
            report=lambda *_: self.report, lines=lambda _: ["a line of the terminal"],
        )  # fmt: skip
        return write_run_page(
            cast(AnyExperiment, experiment),
            cast(AnyScored, scored),
            cast(Comparison, comparison),
            self.health,
            folder,
        )


@pytest.fixture(scope="session")
def text_of() -> Callable[[Stub, Path], str]:
    """Return the text of a page without its tags."""
    from tests.support.pages import Page

    return lambda stub, folder: Page(stub.write(folder).read_text(encoding="utf-8")).text
