"""What an instrument read, and when: a channel, times on the bench clock, values."""

from dataclasses import dataclass, field

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, read_only


@dataclass(frozen=True)
class Channel:
    """What the numbers of a reading mean."""

    name: str  #: for example ``"gel.image"`` or ``"arm.joints"``.
    unit: str  #: SI symbol, ``"count"`` for pixels, ``"1"`` for pure numbers.
    shape: tuple[int, ...]  #: of one sample.
    dtype: str  #: of one sample, as numpy writes it.
    frame: str = ""  #: the frame the numbers are in, or ``""``.
    nominal_rate: float | None = None
    """Hz, as the instrument's maker states it; never used to make time stamps."""


@dataclass(frozen=True, eq=False)
class Reading:
    """Samples of one channel with a measured time each."""

    channel: Channel  #: what was read.
    times: FloatArray  #: ``(n,)`` s on the bench clock, measured on arrival, increasing.
    values: AnyArray  #: ``(n, *channel.shape)``, read-only.
    encoded: tuple[bytes, ...] = field(default=())
    """the bytes each sample arrived as (JPEG), where there are such; what is recorded."""

    def __post_init__(self) -> None:
        times = read_only(np.array(self.times, dtype=np.float64))
        values = read_only(np.array(self.values, dtype=self.channel.dtype))
        if values.shape != (len(times), *self.channel.shape):
            raise ValueError(
                f"{self.channel.name}: {len(times)} times and values of shape {values.shape}; "
                f"each sample must have shape {self.channel.shape}"
            )
        if self.encoded and len(self.encoded) != len(times):
            raise ValueError(f"{self.channel.name}: {len(self.encoded)} encoded samples, {len(times)} times")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "values", values)
