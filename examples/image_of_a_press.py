"""The tactile image of a press: python examples/image_of_a_press.py OUT.png."""

import sys

import cv2

import touchstone

press = touchstone.tactile_image("builtin:mug", contact=(-0.04, 0.0, 0.05), depth=0.8e-3, tilt=0.1)
cv2.imwrite(sys.argv[1], press.image[..., ::-1])
print(
    f"{press.image.shape}, {1e3 * press.deepest:.2f} mm deep; {sum(press.evaluation.seconds.values()):.3f} s"
)
