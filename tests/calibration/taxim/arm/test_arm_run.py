"""Calibrations by the arm on the bench in process: what is found, what is noticed, and what a crash costs."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calibration.taxim.arm.plan import PressMotion, PressSettings, places
from calibration.taxim.arm.press import ball_scene, procedure
from calibration.taxim.arm.record import read_arm_run
from calibration.taxim.arm.touch_down import look
from harness.basics.errors import CalibrationRefused, NotTouched, WrongUse
from harness.bench.gap import load_gap
from harness.bench.sensor import GELSIGHT_R15
from harness.bench.station_file import load_station, station_path
from harness.experiment.begin import begin
from harness.recording.recording import Recording
from harness.recording.session import Quiet
from mocks.world.gap_draw import GapDraw
from tests.support.arm_presses import RADIUS, Creeping, begun, gap_of_aspect, opened, perform_on, performed
from tests.support.whole_run import copied, edited


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Sixteen presses; nothing may be changed in its folder."""
    return performed(tmp_path_factory.mktemp("arm") / "run", 16, seed=4)


def truth(recording: Recording) -> dict[str, float]:
    known: dict[str, float] = json.loads(recording.truth_path.read_text())["differences"]
    return known


def test_scale_aspect_and_rotation_are_the_drawn_ones_within_what_is_stated(done: Recording) -> None:
    found, true = read_arm_run(done.folder).scale(), truth(done)
    pitch = GELSIGHT_R15.pitch * true["pitch_over_nominal"] * np.sqrt(true["aspect"])
    assert abs(found.pitch.value - pitch) < 3.0 * found.pitch.sigma
    assert abs(found.aspect.value - true["aspect"]) < 3.0 * found.aspect.sigma
    assert abs(found.rotation.value - true["image_yaw_rad"]) < 3.0 * found.rotation.sigma
    assert abs(found.skew.value) < 3.0 * found.skew.sigma
    # And what is stated is of use: the issue asks for half a per cent and a fifth of a degree of 49 presses.
    assert found.pitch.sigma < 0.005 * pitch
    assert found.rotation.sigma < np.radians(0.25)
    # The drawn arm repeats to 0.03 mm; places in pictures add little.
    assert 0.02e-3 < found.scatter < 0.06e-3


@pytest.mark.slow  # a whole run; the drawn aspect is measured in the first
def test_pixels_three_per_cent_too_high_are_measured(tmp_path: Path) -> None:
    aspect = 1.03 if GapDraw(load_gap("target"), 5).run.aspect > 1.0 else 0.97
    recording = performed(tmp_path / "run", 20, seed=5, gap=str(gap_of_aspect(tmp_path, aspect, 5)))
    assert truth(recording)["aspect"] == pytest.approx(aspect)
    found = read_arm_run(recording.folder).scale()
    assert abs(found.aspect.value - aspect) < 3.0 * found.aspect.sigma
    assert found.aspect.within95 < 0.02
    assert found.aspect_taken == found.aspect.value
    wide = GELSIGHT_R15.pitch * truth(recording)["pitch_over_nominal"]
    assert abs(found.wide.value - wide) < 3.0 * found.wide.sigma
    assert abs(found.high.value - wide * aspect) < 3.0 * found.high.sigma


@pytest.mark.slow  # a whole run of a rule tested by itself
def test_the_pitch_believed_before_is_contradicted_where_it_is_wrong(tmp_path: Path) -> None:
    recording = performed(tmp_path / "run", 20, seed=2)
    found, nominal = read_arm_run(recording.folder).scale(), GELSIGHT_R15.pitch
    assert truth(recording)["pitch_over_nominal"] < 0.98
    assert abs(found.pitch.value - nominal) > 4.0 * found.pitch.sigma


def test_every_press_met_the_ball_and_came_to_rest(done: Recording) -> None:
    run = read_arm_run(done.folder)
    assert len(run.taken) == len(run.pictures.images) == 16
    assert run.pictures.refused == ()
    assert all(one.touched and one.settled for one in run.taken)
    assert len(run.backgrounds) == 3
    assert run.drift == 0.0
    depth = [np.abs(one.image - one.rest).max() for one in run.taken]
    assert min(depth) > 40.0


def test_the_arm_never_goes_below_what_was_rehearsed(done: Recording) -> None:
    for record in done.steps():
        if record.step.kind == "press":
            motion = PressMotion.from_parameters(dict(record.step.parameters))
            pose = record.readings["arm.base_from_flange"].values[-1]
            down = float((pose[:3] - motion.base_from_stand_off[:3, 3]) @ motion.axis)
            assert motion.touch < down <= motion.lowest + 1e-6
            way = record.readings["press.way"].values
            assert np.diff(way) == pytest.approx(np.full(len(way) - 1, PressSettings().step))
            assert way[-1] <= down + 1e-9


def test_presses_keep_one_attitude_and_stay_in_the_picture(done: Recording) -> None:
    plan = done.header.plan
    steps = [step for step in plan["steps"] if step["kind"] == "press"]
    motions = [PressMotion.from_parameters(step["parameters"]) for step in steps]
    attitudes = np.array([motion.base_from_stand_off[:3, :3] for motion in motions])
    assert np.abs(attitudes - attitudes[0]).max() < 1e-9
    spread = np.array([motion.on_gel for motion in motions])
    contact = np.sqrt(0.8e-3 * (2.0 * RADIUS - 0.8e-3))
    assert (np.abs(spread) + contact < 0.5 * np.array(GELSIGHT_R15.window)).all()


def test_half_a_run_is_spread_over_the_gel_already() -> None:
    settings = PressSettings(presses=40)
    for seed in range(3):
        first = places(GELSIGHT_R15, RADIUS, settings, seed)[:15]
        whole = places(GELSIGHT_R15, RADIUS, settings, seed)
        assert (first.std(axis=0) > 0.75 * whole.std(axis=0)).all()
        # A drift in time is no slope over the picture.
        order = np.arange(40)
        assert max(abs(np.corrcoef(order, axis)[0, 1]) for axis in whole.T) < 0.25


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (PressSettings(presses=14), "--presses 14.*15"),
        (PressSettings(depth=0.0), "--depth 0 mm.* 2 mm.*1.80 mm"),
        (PressSettings(depth=1.9e-3), "--depth 1.9 mm.*1.80 mm"),
    ],
)
def test_settings_that_cannot_be_are_refused_before_anything_moves(
    settings: PressSettings, says: str, tmp_path: Path
) -> None:
    station = load_station(station_path("mock"))
    with pytest.raises(WrongUse, match=says):
        begin(procedure(settings), ball_scene(RADIUS), station, 0, None, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_ball_too_large_for_the_window_is_refused() -> None:
    with pytest.raises(WrongUse, match=r"10\.6 mm.*3\.2 mm.*19\.9 x 14\.9 mm"):
        places(GELSIGHT_R15, 8e-3, PressSettings(depth=2e-3), 0)


def test_a_scene_of_something_else_is_refused() -> None:
    scene = ball_scene(RADIUS)
    mug = scene.model_copy(update={"object": scene.object.model_copy(update={"mesh": "builtin:mug"})})
    with pytest.raises(WrongUse, match="builtin:ball"):
        ball_scene(RADIUS, mug)


@pytest.mark.slow  # a whole run; waiting is in test_settled.py
def test_a_creeping_gel_is_waited_for_and_its_pictures_count(tmp_path: Path) -> None:
    recording = begun(tmp_path / "run").recording
    bench = opened(recording)
    slow = Creeping(bench.gel, lasts=0.5, share=0.3)
    perform_on(replace(bench, instruments={**bench.instruments, "gel": slow}), recording, Quiet())
    run = read_arm_run(recording.folder)
    assert all(one.settled for one in run.taken)
    assert np.median([one.seconds for one in run.taken]) > 1.0
    assert run.pictures.refused == ()


@pytest.mark.slow  # a whole run; waiting is in test_settled.py
def test_a_gel_that_never_rests_is_waited_for_then_refused(tmp_path: Path) -> None:
    recording = begun(tmp_path / "run").recording
    bench = opened(recording)
    restless = Creeping(bench.gel, trembles=0.3)
    with pytest.raises(CalibrationRefused, match=r"\d+ as 'unsettled'"):
        perform_on(replace(bench, instruments={**bench.instruments, "gel": restless}), recording, Quiet())
    taken = [one for one in recording.steps() if one.step.kind == "press"]
    assert len(taken) == 8
    assert all(one.readings["press.state"].values[-1][2] >= PressSettings().still.patience for one in taken)
    with pytest.raises(CalibrationRefused, match="press"):
        read_arm_run(recording.folder)


@pytest.mark.slow  # a whole run of a rule tested by itself
def test_a_light_that_fades_stops_the_run_between_two_presses_and_says_so(tmp_path: Path) -> None:
    recording = begun(tmp_path / "run").recording
    bench = opened(recording)
    fading = Creeping(bench.gel, fades=1.0)
    with pytest.raises(CalibrationRefused, match=r"drift.*\b40\b"):
        perform_on(replace(bench, instruments={**bench.instruments, "gel": fading}), recording, Quiet())
    assert 3 < recording.committed < 18
    run = read_arm_run(recording.folder)
    assert 25.0 < run.drift <= 40.0
    # The arm is where the next press would have begun, clear of the ball.
    index = recording.committed
    motion = PressMotion.from_parameters(dict(recording.header.plan["steps"][index]["parameters"]))
    pose = bench.arm.state().base_from_flange
    assert pose[:3, 3] == pytest.approx(motion.base_from_stand_off[:3, 3], abs=1e-6)


@pytest.mark.slow  # a whole run; drift that ends one stays
def test_a_little_drift_is_told_and_goes_on(tmp_path: Path) -> None:
    recording = begun(tmp_path / "run").recording
    bench = opened(recording)
    complete = perform_on(
        replace(bench, instruments={**bench.instruments, "gel": Creeping(bench.gel, fades=0.1)}),
        recording,
        Quiet(),
    ).complete
    assert complete
    run = read_arm_run(recording.folder)
    assert 4.0 < run.drift < 40.0
    assert run.marked < 3.0
    assert abs(run.scale().pitch.value / GELSIGHT_R15.pitch - 1.0) < 0.03


@pytest.mark.slow  # a whole run of a rule tested by itself
def test_where_no_ball_stands_the_run_ends_after_three_presses(tmp_path: Path) -> None:
    recording = begun(tmp_path / "run").recording
    bench = opened(recording)
    blind = Creeping(bench.gel, blind=True)
    with pytest.raises(NotTouched, match=r"\b3 presses"):
        perform_on(replace(bench, instruments={**bench.instruments, "gel": blind}), recording, Quiet())
    assert recording.committed == 4
    for record in recording.steps()[1:]:
        motion = PressMotion.from_parameters(dict(record.step.parameters))
        pose = record.readings["arm.base_from_flange"].values[-1]
        assert float((pose[:3] - motion.base_from_stand_off[:3, 3]) @ motion.axis) <= motion.lowest + 1e-6
    with pytest.raises(CalibrationRefused, match="ball"):
        read_arm_run(recording.folder)


def test_a_run_stopped_at_any_press_goes_on_there_and_reads_the_same(tmp_path: Path, done: Recording) -> None:
    """Whatever was taken before is kept to the bit; the rest is what an uninterrupted run takes."""
    recording = copied(done, tmp_path / "run", truth=False)
    for path in (recording.folder / "steps").glob("*.mcap"):
        path.unlink()

    class Enough(Exception):
        pass

    class Until(Quiet):
        def ended(self, step: object, seconds: float) -> None:
            if recording.committed == 9:
                raise Enough

    with pytest.raises(Enough):
        perform_on(opened(recording), recording, Until())
    kept = [path.read_bytes() for path in sorted((recording.folder / "steps").glob("*.mcap"))]
    again = Recording(recording.folder)
    assert again.committed == 9
    complete = perform_on(opened(again), again, Quiet()).complete
    assert complete
    now = [path.read_bytes() for path in sorted((recording.folder / "steps").glob("*.mcap"))]
    assert now[:9] == kept
    one, whole = read_arm_run(recording.folder), read_arm_run(done.folder)
    apart = np.abs(np.array([a.on_gel for a in one.taken]) - [b.on_gel for b in whole.taken]).max()
    assert apart < 1e-6
    assert one.scale().pitch.value == pytest.approx(whole.scale().pitch.value, rel=2e-3)


CHILD = """
import sys
from pathlib import Path
from harness.recording.recording import Recording
from tests.support.arm_presses import opened, perform_on
from harness.recording.session import Quiet
recording = Recording(Path(sys.argv[1]))
perform_on(opened(recording), recording, Quiet())
"""


@pytest.mark.slow  # a whole run; stopped at any press stays
def test_a_killed_run_loses_no_press_and_goes_on(tmp_path: Path) -> None:
    recording = begun(tmp_path / "run").recording
    paths = str(Path(__file__).parents[4])
    environment = {**os.environ, "PYTHONPATH": paths}
    child = subprocess.Popen([sys.executable, "-c", CHILD, str(recording.folder)], env=environment)
    try:
        while recording.committed < 4 and child.poll() is None:
            time.sleep(0.02)
        assert child.poll() is None
    finally:
        child.send_signal(signal.SIGKILL)
        child.wait()
    before = recording.committed
    assert 4 <= before < 18
    complete = perform_on(opened(recording), recording, Quiet()).complete
    assert complete
    assert len(read_arm_run(recording.folder).taken) == 15
    # What was being written when it was killed is not taken for a step.
    assert not any(path.name.startswith(".") for path in (recording.folder / "steps").glob("*.mcap"))


def test_a_folder_reads_without_arm_truth_or_bench(tmp_path: Path, done: Recording) -> None:
    shutil.copytree(done.folder, tmp_path / "elsewhere")
    here, there = read_arm_run(done.folder), read_arm_run(tmp_path / "elsewhere")
    assert there.pictures.sha256 == here.pictures.sha256
    assert there.scale().pitch == here.scale().pitch


def test_a_run_of_another_experiment_is_refused(tmp_path: Path, done: Recording) -> None:
    shutil.copytree(done.folder, tmp_path / "other")
    edited(Recording(tmp_path / "other"), lambda header: header.update(experiment="contact-localization"))
    with pytest.raises(CalibrationRefused, match="contact-localization"):
        read_arm_run(tmp_path / "other")


def test_a_run_without_a_press_yet_says_how_to_go_on(tmp_path: Path) -> None:
    recording = begun(tmp_path / "run").recording
    with pytest.raises(CalibrationRefused, match=r"0 presses.*--resume"):
        read_arm_run(recording.folder)


def test_the_picture_is_the_mean_of_its_frames(done: Recording) -> None:
    record = done.step(1)
    frames = record.readings["gel.image"]
    assert look(frames) == pytest.approx(frames.values.astype(float).mean(axis=0))
