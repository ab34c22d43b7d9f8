"""Layout of a shape's vector: its pose and the bench errors first, then the parameters of its kind.

Lengths of a kind are natural logarithms of metres; angles are radians.
"""

X, Y, YAW = 0, 1, 2
"""Position in the frame ``stand``, m, and rotation about the vertical, rad."""
TILT_X, TILT_Y = 3, 4
"""Rotations about the object's x and y, rad."""
LIFT = 5
"""Height of the support above z = 0, m."""
CAMERA_RIGHT, CAMERA_DOWN, CAMERA_SCALE = 6, 7, 8
"""Shift of the picture at the object, m, and the relative error of its scale."""
OUTLINE = 9
"""Distance of the mask's border beyond the object, m."""
GEL = 10
"""Offset of the gel from its calibrated position throughout a run, three numbers in the gel's frame, m."""
POSE_SIZE = 13
"""Numbers before those of the kind."""

KIND, CODE_SIZE = 0, 7
"""Entry of a shape's code that is its kind, and entries of a code: the others are the parts of the kind."""
REVOLUTION, TOOL, BENT = 0, 1, 2
"""Kinds: body of revolution, flat tool, bent body."""

PREPARED = 64
"""Size of the buffer that a distance is computed from: the pose, the kind's numbers, the box."""
BOX = 54
"""First of six numbers of that buffer: the body's box in its own frame, smallest x, y, z, then largest, m."""
