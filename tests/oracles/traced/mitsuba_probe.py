"""Whether a variant of Mitsuba can render here, asked in a process that may die of the answer.

``python tests/oracles/traced/mitsuba_probe.py llvm_ad_rgb`` renders a ball and ends with 0, or does not:
a version of LLVM that lacks an instruction ends the whole process in the middle of a picture, after it was
imported, and after it computed sums, without complaint.
"""

import sys


def main(variant: str) -> int:
    """Render a ball of 8 x 8 pixels; 0 where its picture is lit."""
    import mitsuba as mi
    import numpy as np

    mi.set_variant(variant)
    # As long as what is asked later: a texture, a second bounce, and the picture's further channels.
    texture = mi.Bitmap(np.full((2, 2, 3), 128, np.uint8))
    scene = {
        "type": "scene",
        "integrator": {
            "type": "aov",
            "aovs": "place:position,normal:sh_normal,albedo:albedo",
            "light": {"type": "path", "max_depth": 3, "hide_emitters": True},
        },
        "ball": {
            "type": "sphere",
            "bsdf": {
                "type": "twosided",
                "of": {"type": "diffuse", "reflectance": {"type": "bitmap", "bitmap": texture}},
            },
        },
        "lamp": {"type": "directional", "direction": [0.0, 1.0, 0.0]},
        "camera": {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at([0.0, -4.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            "film": {"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "rgba"},
            "sampler": {"type": "multijitter", "sample_count": 4},
        },
    }
    picture = np.array(mi.render(mi.load_dict(scene), spp=4))
    return 0 if np.isfinite(picture).all() and picture[..., :3].max() > 0.0 else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
