"""Tables 1 and 2 of ObjectFolder 2.0 as printed: quoted, and never measured here.

Gao et al., CVPR 2022. Seconds are of "one observation sample for each modality"; the program published with
the paper runs on a GPU, of which neither says the make. Quality of touch is against pictures of real sensors,
a DIGIT for 1.0 and a GelSight for 2.0, so that its two rows are of two experiments, and neither is ours.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

SECONDS: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType({
    "ObjectFolder 1.0": {"vision": 3.699, "audio": 0.420, "touch": 0.010},
    "ObjectFolder 2.0": {"vision": 0.062, "audio": 0.035, "touch": 0.014},
})  # fmt: skip
"""Table 1, in s: by row and sense."""

QUALITY: Final[Mapping[str, Mapping[str, Mapping[str, float]]]] = MappingProxyType({
    "ObjectFolder 1.0": {
        "vision": {"psnr_db": 35.7, "ssim": 0.97},
        "audio": {"stft_distance": 4.94e-5, "envelope_distance": 7.65e-4},
        "touch": {"psnr_db": 27.9, "ssim": 0.64},
    },
    "ObjectFolder 2.0": {
        "vision": {"psnr_db": 36.3, "ssim": 0.98},
        "audio": {"stft_distance": 0.19e-5, "envelope_distance": 1.29e-4},
        "touch": {"psnr_db": 31.6, "ssim": 0.78},
    },
})  # fmt: skip
"""Table 2: by row, sense and metric."""

MACHINE: Final = "a GPU that the paper does not name"
