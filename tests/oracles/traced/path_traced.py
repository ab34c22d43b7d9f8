"""Pictures by Mitsuba 3: what the direct level is checked by, and light that comes by way of other places.

Two pictures of half the samples each, from two seeds: their mean is the picture, half of what they differ by
its noise. Float32, linear light, a pixel's mean over its square.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray, block_means, read_only
from harness.basics.errors import OutOfDomain
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import Appearance
from tests.oracles.traced.mitsuba_scene import camera_of, lamps_of, surfaces_of
from tests.oracles.traced.mitsuba_variant import FAST, Variant, chosen_variant

_CHANNELS = "place:position,normal:sh_normal,albedo:albedo"

_DIRECT = 2
"""Mitsuba's depth of light that comes straight from its source."""


@dataclass(frozen=True, eq=False)
class TracedImage:
    """A picture with what is known of it."""

    image: LinearImage  #: linear light, coverage and depth.
    noise: float  #: linear light, root mean square over pixels and channels, of the picture's mean.
    alpha_noise: float  #: the same of coverage.
    samples: int  #: a pixel, of both seeds together.
    variant: Variant  #: of Mitsuba, and why.
    seconds: Mapping[str, float]  #: by what was done; the first picture of a kind is compiled in its time.


class PathTraced:
    """An object for any number of pictures by Mitsuba.

    Mitsuba keeps one variant for a whole process: do not mix two.
    """

    def __init__(self, appearance: Appearance, variant: str = FAST) -> None:
        """Hand the surface to Mitsuba; errors as of ``chosen_variant`` and ``surfaces_of``."""
        self.variant = chosen_variant(variant)
        import mitsuba

        mitsuba.set_variant(self.variant.name)
        self._mitsuba: Any = mitsuba
        self._surfaces = surfaces_of(mitsuba, appearance)

    def render(
        self,
        camera: Pinhole,
        lights: Sequence[DirectionalLight],
        samples: int = 64,
        shadow: bool = True,
        bounces: int = 0,
        seed: int = 0,
    ) -> TracedImage:
        """One picture.

        Args:
            camera: anywhere.
            lights: from far away; without any the object is black.
            samples: a pixel, two or more; as few more are taken as two pictures of whole rows of places need.
            shadow: whether the object is in its own light's way.
            bounces: of light between places of the object before the one that is seen; 0 for light straight
                from its source.
            seed: of the samples.

        Raises:
            OutOfDomain: fewer samples, or fewer bounces than none.
        """
        if samples < 2 or bounces < 0:
            raise OutOfDomain(
                f"{samples} samples a pixel and {bounces} bounces were asked for; give 2 samples or more "
                "(two seeds tell the noise) and 0 bounces or more"
            )
        half = _whole_rows((samples + 1) // 2)
        seconds: dict[str, float] = {}
        parts = [self._traced(camera, lights, half, shadow, bounces, 2 * seed + k, seconds) for k in range(2)]
        mean = 0.5 * (parts[0] + parts[1])
        apart = 0.5 * (parts[0] - parts[1])
        return TracedImage(
            _image(mean, camera),
            float(np.sqrt(np.mean(apart[..., :3] ** 2))),
            float(np.sqrt(np.mean(apart[..., 3] ** 2))),
            2 * half,
            self.variant,
            MappingProxyType(seconds),
        )

    def _traced(
        self,
        camera: Pinhole,
        lights: Sequence[DirectionalLight],
        samples: int,
        shadow: bool,
        bounces: int,
        seed: int,
        seconds: dict[str, float],
    ) -> FloatArray:
        """``(rows, columns, 7)``: light, coverage, place (the last two of all the samples of one seed)."""
        if shadow:
            depth, done = _DIRECT + bounces, "indirect" if bounces else "direct"
            return self._light(camera, lights, samples, depth, seed, seconds, done)
        found = self._unshadowed(camera, lights, samples, seed, seconds)
        if bounces:
            # One seed for both: their first places are the same, and what is left is what bounced.
            whole = self._light(camera, lights, samples, _DIRECT + bounces, seed, seconds, "indirect")
            straight = self._light(camera, lights, samples, _DIRECT, seed, seconds, "direct")
            found[..., :3] += whole[..., :3] - straight[..., :3]
        return found

    def _light(
        self,
        camera: Pinhole,
        lights: Sequence[DirectionalLight],
        samples: int,
        depth: int,
        seed: int,
        seconds: dict[str, float],
        done: str,
    ) -> FloatArray:
        path = {"type": "path", "max_depth": depth, "rr_depth": depth + 1, "hide_emitters": True}
        return self._rendered(camera, lights, samples, path, seed, seconds, done)[..., :7]

    def _unshadowed(
        self,
        camera: Pinhole,
        lights: Sequence[DirectionalLight],
        samples: int,
        seed: int,
        seconds: dict[str, float],
    ) -> FloatArray:
        """Mitsuba has no light without shadow: it is computed from its normals and colours, sample by sample.

        Every sample is a pixel of a picture so much larger.
        """
        side = int(np.ceil(np.sqrt(samples)))
        larger = camera.resized(camera.width * side, camera.height * side)
        nothing = {"type": "path", "max_depth": 1, "hide_emitters": True}
        found = self._rendered(larger, lights, 1, nothing, seed, seconds, "unshadowed")
        begun = time.perf_counter()
        away = found[..., 4:7] - camera.eye
        normal, albedo = found[..., 7:10], found[..., 10:13]
        turned = normal * -np.sign(np.einsum("ijk,ijk->ij", normal, away))[..., None]
        falling = sum(
            (light.irradiance / np.pi * np.maximum(turned @ light.direction, 0.0) for light in lights),
            np.zeros(normal.shape[:2]),
        )
        found[..., :3] = albedo * falling[..., None]
        # Without light Mitsuba calls every place empty; where there is a surface there is a normal.
        found[..., 3] = np.any(normal != 0.0, axis=2)
        mean = block_means(found[..., :7], side)
        seconds["unshadowed"] += time.perf_counter() - begun
        return mean

    def _rendered(
        self,
        camera: Pinhole,
        lights: Sequence[DirectionalLight],
        samples: int,
        light: dict[str, Any],
        seed: int,
        seconds: dict[str, float],
        done: str,
    ) -> FloatArray:
        """``(rows, columns, 13)``: light, coverage, place, normal, albedo; seconds are added to."""
        begun = time.perf_counter()
        scene = self._mitsuba.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "aov", "aovs": _CHANNELS, "light": light},
                "camera": camera_of(self._mitsuba, camera, samples),
                **lamps_of(lights),
                **self._surfaces,
            }
        )
        found = np.array(self._mitsuba.render(scene, spp=samples, seed=seed), dtype=np.float64)
        seconds[done] = seconds.get(done, 0.0) + time.perf_counter() - begun
        return found


def _whole_rows(samples: int) -> int:
    """The least number from ``samples`` that Mitsuba's jittered places fill, row by row."""
    across = int(np.sqrt(samples))
    return across * -(-samples // across)


def _image(found: FloatArray, camera: Pinhole) -> LinearImage:
    alpha = found[..., 3]
    covered = alpha > 0.0
    place = found[..., 4:7] / np.where(covered, alpha, 1.0)[..., None]
    depth = np.where(covered, (place - camera.eye) @ camera.forward, np.inf)
    return LinearImage(
        read_only(np.ascontiguousarray(np.maximum(found[..., :3], 0.0))),
        read_only(np.clip(alpha, 0.0, 1.0)),
        read_only(depth),
    )
