"""What a network of sound is worth, as numbers of a table's row."""

from collections.abc import Mapping, Sequence

import numpy as np

HEADINGS = ("MB", "us", "gain %", "95th", "STFT e-5", "envelope e-4", "dB")

_COLUMNS = (
    ("bytes", 1e-6),
    ("seconds_per_vertex", 1e6),
    ("gain_error_median", 1e2),
    ("gain_error_p95", 1e2),
    ("stft_distance", 1e5),
    ("envelope_distance", 1e4),
    ("spectral_error_db", 1.0),
)


def worth(errors: Mapping[str, float]) -> list[float]:
    """``authoring.audio.audio.measure_audio``'s errors under ``HEADINGS``; NaN where there is none."""
    return [errors.get(key, float("nan")) * scale for key, scale in _COLUMNS]


def said(numbers: Sequence[float]) -> list[str]:
    """To three digits; NaN as nothing."""
    return ["" if np.isnan(number) else f"{number:.3g}" for number in numbers]
