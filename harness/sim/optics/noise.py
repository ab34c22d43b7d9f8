"""What a camera adds to a picture of its own accord."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import OutOfDomain


def with_camera_noise(images: AnyArray, sigma: float, seed: int) -> FloatArray:
    """Pictures with independent normal noise on every value.

    A picture's noise depends on the seed and its place in the batch, not on the size of the batch.

    Args:
        images: ``(n, rows, columns, 3)`` grey levels.
        sigma: grey levels, zero or more.
        seed: of the noise.

    Returns:
        The same shape, float64, not clipped.

    Raises:
        OutOfDomain: a sigma that is negative or not finite.
    """
    if not (np.isfinite(sigma) and sigma >= 0.0):
        raise OutOfDomain(f"camera noise of {sigma!r} grey levels; give a finite number, zero or more")
    noisy = np.array(images, dtype=np.float64)
    for index, image in enumerate(noisy):
        image += sigma * np.random.default_rng((seed, index)).standard_normal(image.shape)
    return noisy
