"""From a recorded step to a contact: what is refused, what is averaged, and what no order changes."""

from collections.abc import Sequence

import numpy as np
import pytest

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.touch.touch import Contact, TouchNoise, contact_of
from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import DataRefused, RecordingDamaged, WrongUse
from harness.basics.geometry import quaternion_from_rotation, rotation_about, rotation_from_vector, transform
from harness.bench.device import Channel, Reading
from harness.bench.sensor import GELSIGHT_R15
from harness.picture.square_pixels import made_square
from harness.recording.observation import AROUND_IMAGES, Observation, observe_step
from harness.recording.step_file import Step, StepRecord
from harness.sim.optics.inverse import GelReader
from harness.sim.optics.optics import Optics
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.samples.synthetic_press import BLOCK, Press, felt, stepped_block

IMAGE = Channel("gel.image", "count", (120, 160, 3), "uint8", "gel")
POSE = Channel("arm.base_from_flange", "m", (7,), "float64", "base")
FLANGE_FROM_GEL = transform(rotation_from_vector(np.array([0.0, 0.0, 0.5])), np.array([0.0, 0.0, 0.06]))
AT = transform(rotation_from_vector(np.array([2.9, 0.4, -0.2])), np.array([0.4, -0.2, 0.3]))
EDGE = Press((0.008, -0.005, 0.025), (0.0, 0.0, -1.0), yaw=0.3)


def height_map(observation: Observation, model: Model) -> FloatArray:
    """Of a picture that is not refused."""
    reading = GelReader(model.calibration).read(observation.images)
    assert not reading.refusal
    return reading.height


@pytest.fixture(scope="module")
def model() -> Model:
    return Model(stepped_block(), GELSIGHT_R15, shipped_calibration("gelsight_r15_bench"))


@pytest.fixture(scope="module")
def pressed(model: Model) -> FloatArray:
    return felt(model.raster, EDGE)


@pytest.fixture(scope="module")
def picture(model: Model, pressed: FloatArray) -> ByteArray:
    images: ByteArray = Optics(model.calibration, "smooth").render(pressed[None]).images
    return np.asarray(images[0])


def noisy(picture: ByteArray, count: int, seed: int = 0) -> ByteArray:
    noise = np.random.default_rng(seed).normal(0.0, 3.0, (count, *picture.shape))
    return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    "pose", [np.eye(3), np.full((4, 4), np.nan), np.eye(4)[:3]], ids=["(3, 3)", "NaN", "(3, 4)"]
)
def test_a_pose_that_is_none_is_refused(pose: FloatArray, picture: ByteArray) -> None:
    with pytest.raises(DataRefused, match=r"base_from_gel .*\(4, 4\)"):
        Observation(pose, picture[None])


def test_images_that_are_none_are_refused(picture: ByteArray) -> None:
    for images in (picture, picture[None][:0], picture[None, ..., :1], picture[None].astype(np.float64)):
        with pytest.raises(DataRefused, match=r"uint8 .*\(n, rows, columns, 3\)"):
            Observation(np.eye(4), images)  # type: ignore[arg-type]  # one of them is not of bytes


def test_an_observation_keeps_its_own_pose(picture: ByteArray) -> None:
    pose = np.eye(4)
    kept = Observation(pose, picture[None])
    pose[0, 3] = 7.0
    assert kept.base_from_gel[0, 3] == 0.0
    assert not kept.base_from_gel.flags.writeable


def test_one_frame_and_many_alike_ones_say_the_same(model: Model, picture: ByteArray) -> None:
    one = height_map(Observation(np.eye(4), picture[None]), model)
    many = height_map(Observation(np.eye(4), np.repeat(picture[None], 5, axis=0)), model)
    np.testing.assert_array_equal(one, many)


def test_the_mean_of_frames_is_read_and_their_order_does_not_matter(model: Model, picture: ByteArray) -> None:
    frames = noisy(picture, 8)
    read = height_map(Observation(np.eye(4), frames), model)
    np.testing.assert_array_equal(read, height_map(Observation(np.eye(4), frames[::-1]), model))
    # Noise of single frames averages out: the mean is nearer to what was pressed than a frame usually is.
    clean = height_map(Observation(np.eye(4), picture[None]), model)
    singles = [np.abs(height_map(Observation(np.eye(4), f[None]), model) - clean).mean() for f in frames]
    assert np.abs(read - clean).mean() < np.mean(singles)


def test_an_untouched_gel_reads_zero(model: Model) -> None:
    background = model.calibration.background
    assert not height_map(Observation(np.eye(4), background[None]), model).any()


def read(observation: Observation, model: Model) -> Contact:
    heights = height_map(observation, model)
    return contact_of(observation.base_from_gel, heights, model.sensor.pitch, BLOCK, TouchNoise())


def test_contacts_keep_their_poses_and_order_and_show_whether_they_touched(
    model: Model, picture: ByteArray
) -> None:
    background = model.calibration.background
    poses = [transform(np.eye(3), np.array([0.1 * k, 0.0, 0.0])) for k in range(3)]
    images = [picture[None], background[None], picture[None]]
    observations = [Observation(p, i) for p, i in zip(poses, images, strict=True)]
    contacts = [read(observation, model) for observation in observations]
    assert [c.shows_contact for c in contacts] == [True, False, True]
    for contact, pose in zip(contacts, poses, strict=True):
        np.testing.assert_array_equal(contact.base_from_gel, pose)
    np.testing.assert_array_equal(contacts[0].touch.heights, contacts[2].touch.heights)  # type: ignore[union-attr]


def test_the_coarse_map_is_of_the_same_press_at_half_the_resolution(model: Model, picture: ByteArray) -> None:
    contact = read(Observation(np.eye(4), picture[None]), model)
    fine, coarse = contact.touch, contact.coarse
    assert fine is not None
    assert coarse is not None
    assert coarse.pitch == pytest.approx(2.0 * fine.pitch)
    # 7 of the 7.5 coarse rows are kept: half a fine row is cut at each end.
    whole = height_map(Observation(np.eye(4), picture[None]), model)
    assert coarse.heights.mean() == pytest.approx(whole[4:116].mean(), rel=1e-9)
    # 15 rows have a middle one; 20 columns have two.
    assert contact.indentation == pytest.approx(whole[56:64, 72:88].mean(), rel=1e-9)


def record(
    pose_times: Sequence[float] = (0.0,),
    poses: Sequence[FloatArray] = (AT,),
    frame_times: Sequence[float] = (0.01, 0.05),
    without: str = "",
) -> StepRecord:
    frames = np.zeros((len(frame_times), 120, 160, 3), np.uint8)
    written = np.array([[*p[:3, 3], *quaternion_from_rotation(p[:3, :3])] for p in poses])
    readings = {
        "gel.image": Reading(IMAGE, np.array(frame_times), frames),
        "arm.base_from_flange": Reading(POSE, np.array(pose_times), written),
    }
    readings.pop(without, None)
    return StepRecord(Step(4, "press", {}), readings, 1.0)


def test_the_gel_is_where_the_flange_carries_it() -> None:
    found = observe_step(record(), FLANGE_FROM_GEL)
    assert found.base_from_gel == pytest.approx(AT @ FLANGE_FROM_GEL, abs=1e-12)


def test_frames_are_made_square_as_the_presses_of_the_calibration_were() -> None:
    step = record()
    frames = np.random.default_rng(0).integers(0, 256, (2, 120, 160, 3)).astype(np.uint8)
    readings = {**step.readings, "gel.image": Reading(IMAGE, np.array([0.01, 0.05]), frames)}
    taken = StepRecord(step.step, readings, 1.0)
    assert np.array_equal(observe_step(taken, FLANGE_FROM_GEL).images, frames)
    square = observe_step(taken, FLANGE_FROM_GEL, aspect=1.04).images
    assert np.array_equal(square, made_square(frames, 1.04))
    assert not np.array_equal(square, frames)


@pytest.mark.parametrize("without", ["gel.image", "arm.base_from_flange"])
def test_a_step_without_a_needed_reading_is_refused_by_name(without: str) -> None:
    with pytest.raises(RecordingDamaged, match=f"step 4 .*'{without}'"):
        observe_step(record(without=without), FLANGE_FROM_GEL)


def test_poses_recorded_at_other_times_than_the_images_do_not_count() -> None:
    away = transform(AT[:3, :3], AT[:3, 3] + np.array([0.05, 0.0, 0.0]))
    times = (-1.0, 0.0, 0.02, 0.04, 1.0)
    found = observe_step(record(times, (away, AT, AT, AT, away)), FLANGE_FROM_GEL)
    assert found.base_from_gel == pytest.approx(AT @ FLANGE_FROM_GEL, abs=1e-12)


def test_images_without_a_pose_in_their_time_are_refused() -> None:
    late = 0.01 - 2.0 * AROUND_IMAGES
    with pytest.raises(RecordingDamaged, match=r"step 4\b.* 0\.1 s"):
        observe_step(record((late, 0.2), (AT, AT)), FLANGE_FROM_GEL)


def test_the_attitude_is_the_mean_whichever_sign_its_quaternions_have() -> None:
    """q and -q are one rotation; a driver may send either."""
    wiggles = [transform(AT[:3, :3] @ rotation_about(np.eye(3)[2], a), AT[:3, 3]) for a in (-1e-3, 0.0, 1e-3)]
    plain = record((0.0, 0.02, 0.04), wiggles)
    poses = plain.readings["arm.base_from_flange"]
    values = poses.values.copy()
    values[1, 3:] *= -1.0
    flipped = StepRecord(
        plain.step, {**plain.readings, POSE.name: Reading(POSE, poses.times, values)}, plain.seconds
    )
    for one in (plain, flipped):
        assert observe_step(one, np.eye(4)).base_from_gel == pytest.approx(AT, abs=1e-9)


def test_a_single_wild_packet_does_not_move_the_place() -> None:
    wild = transform(AT[:3, :3], AT[:3, 3] + 0.5)
    found = observe_step(record((0.0, 0.01, 0.02, 0.03, 0.04), (AT, AT, wild, AT, AT)), np.eye(4))
    assert found.base_from_gel[:3, 3] == pytest.approx(AT[:3, 3], abs=1e-12)


def test_a_yaw_turns_the_object_about_the_benchs_vertical() -> None:
    nominal = rotation_from_vector(np.array([0.3, 0.2, -0.5]))
    turned = Prior(nominal).object_from_base(np.array([0.0, 0.4]))
    expected = np.array([nominal.T, (rotation_about(np.eye(3)[2], 0.4) @ nominal).T])
    assert turned == pytest.approx(expected)


@pytest.mark.parametrize("rotation", [np.eye(4), 1.1 * np.eye(3), np.diag([1.0, 1.0, -1.0])])
def test_what_is_no_rotation_is_refused_as_a_prior(rotation: FloatArray) -> None:
    with pytest.raises(WrongUse, match="rotation"):
        Prior(rotation)


def test_a_models_samples_are_made_once_for_each_spacing(model: Model) -> None:
    assert model.surface(4e-3) is model.surface(4e-3)
    assert len(model.surface(4e-3).points) < len(model.surface(3e-3).points)
