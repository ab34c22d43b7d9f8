"""Chi-squares of one contact's surface and of the arm's tables, from gaps that are known."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.stats import chi2

from harness.agreement.arm import TABLES, joint_residual
from harness.agreement.touch import SurfaceNoise, Surfaces, surface_residual
from harness.basics.arrays import FloatArray
from harness.basics.geometry import quaternion_from_rotation
from harness.bench import kinematics
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord

SIGMA, SIDE, PITCH = 0.05e-3, 10, 0.6e-3
NOISE = SurfaceNoise()


def surfaces(gaps: FloatArray, prior: float, sigmas: tuple[float, ...] = (SIGMA,)) -> Surfaces:
    flat = np.zeros_like(gaps)
    variances = np.array([np.full_like(gaps, sigma**2) for sigma in sigmas])
    return Surfaces(gaps, flat, variances, np.ones(gaps.shape, np.bool_), PITCH, np.zeros(6), 1.0, prior)


def patches() -> float:
    """Patches of a contact that are off independently of each other: its area over the noise's."""
    return SIDE**2 * PITCH**2 / NOISE.length**2


def test_a_surface_off_by_two_sigmas_everywhere_has_four_a_patch_and_the_prior() -> None:
    found = surface_residual(3, surfaces(np.full((SIDE, SIDE), 2.0 * SIGMA), prior=1.7), NOISE)
    assert found.step == 3
    assert found.dof == pytest.approx(patches(), abs=1e-9)
    assert found.chi_square == pytest.approx(4.0 * patches() + 1.7, abs=1e-9)


def test_one_block_far_off_counts_as_much_as_the_noise_allows() -> None:
    gaps = np.zeros((SIDE, SIDE))
    gaps[2, 3] = 1000.0 * SIGMA
    found = surface_residual(0, surfaces(gaps, prior=0.0), NOISE)
    assert found.chi_square == pytest.approx(patches() * NOISE.most**2 / SIDE**2, abs=1e-9)


def test_two_noises_are_averaged_as_probabilities() -> None:
    gaps = np.full((SIDE, SIDE), 2.0 * SIGMA)
    found = surface_residual(0, surfaces(gaps, 0.5, (SIGMA, 2.0 * SIGMA)), NOISE)
    mean = np.mean(chi2.sf([4.0 * patches() + 0.5, patches() + 0.5], patches()))
    assert chi2.sf(found.chi_square, found.dof) == pytest.approx(mean, abs=1e-9)


def test_a_flange_three_sigmas_from_the_twins_has_nine_of_three() -> None:
    joints = np.array([[0.1, -1.2, 1.4, -1.6, -1.5, 0.3], [0.4, -1.0, 1.2, -1.5, -1.4, 0.1]])
    poses = []
    for k, row in enumerate(joints):
        flange = kinematics.forward("ur5e", row)
        moved = flange[:3, 3] + np.array([0.0, 0.0, 3.0 * TABLES if k else TABLES])
        poses.append(np.concatenate([moved, quaternion_from_rotation(flange[:3, :3])]))
    readings = {
        "arm.joints": SimpleNamespace(values=joints),
        "arm.base_from_flange": SimpleNamespace(values=np.array(poses)),
    }
    run = SimpleNamespace(station=SimpleNamespace(arm=SimpleNamespace(model="ur5e")))
    record = SimpleNamespace(readings=readings, step=SimpleNamespace(index=4))
    found = joint_residual(cast("RunFiles", run), cast("StepRecord", record))
    assert found is not None
    assert (found.step, found.dof) == (4, 3.0)
    assert found.chi_square == pytest.approx(9.0, abs=1e-6)
    assert found.numbers["apart_m"] == pytest.approx(3.0 * TABLES, abs=1e-9)
    empty = SimpleNamespace(readings={}, step=record.step)
    assert joint_residual(cast("RunFiles", run), cast("StepRecord", empty)) is None
