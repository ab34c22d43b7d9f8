"""Where each number of a shape is kept: one vector for every kind, so that one fit serves all of them.

Lengths are logarithms of metres unless said, angles radians. The first numbers are the pose and what the
bench is uncertain of; they mean the same for every kind. The rest is the kind's own.
"""

# Pose in the frame ``stand``, and nuisances, of every kind.
X, Y, YAW = 0, 1, 2
"""Metres, metres, rad."""
TILT_X, TILT_Y = 3, 4
"""Rad about the object's x and y."""
LIFT = 5
"""Metres that the support is above z = 0."""
CAMERA_RIGHT, CAMERA_DOWN, CAMERA_SCALE = 6, 7, 8
"""Metres at the object by which the picture is shifted, and the relative error of its scale."""
OUTLINE = 9
"""Metres by which the mask reaches beyond the object."""
GEL = 10
"""Three metres, in the gel's frame: where the gel is off from its believed place, all through a run."""
POSE_END = 13

# A turned kind: a section (radius, height) swept round a plan, with what sticks out of it.
HEIGHT = 13
RADII = 14
"""Logarithms of the radii at ``KNOTS`` heights, from the foot to the rim."""
KNOTS = 7
WARP = 21
"""Logarithm of the power that the shares of the knots' heights are raised to."""
WALL, FLOOR = 22, 23
CORE_X, CORE_Y = 24, 25
"""Half sides of the rectangle that the section is swept round; zero size is an axis."""
ACROSS, POWER = 26, 27
"""Logarithms of y over x of a superelliptic plan, at the widest place where sides are flat, and of its
power."""
LIMB_AT, LIMB_HALF, LIMB_REACH, LIMB_SLANT, LIMB_CORNER, LIMB_THICK, LIMB_WIDE = 28, 29, 30, 31, 32, 33, 34
"""A handle: height of its middle over the object's, half its height, how far it stands out of the wall, slope
of its outer bar (a number), its corner's share (logit), half its thickness in its plane and across it."""
SPOUT_AT, SPOUT_REACH, SPOUT_RISE, SPOUT_ROOT, SPOUT_TIP = 35, 36, 37, 38, 39
"""Height of its root over the object's, how far it stands out, its rise over that, its two radii."""
SHARES = 40
"""``KNOTS`` shares of the height at which the radii are; not fitted."""
TURNED_END = 47

# A flat tool: a tapered shaft between two ends, cut out of a plate.
LENGTH = 13
"""From the middle of one end to that of the other."""
SHAFT_A, SHAFT_B = 14, 15
"""Half widths at both ends of the shaft."""
SHAFT_THICK, HEAD_THICK = 16, 17
"""Half thicknesses."""
HEAD_A, HEAD_B = 18, 19
"""Radii of the two ends."""
HOLE_A, HOLE_B = 20, 21
"""Half widths of what is cut out of each: a hole's radius, or half a slot's width."""
SLOT_TURN = 22
"""Rad between a slot and the shaft."""
TOOL_END = 23

# A bent body that lies: a round section swept along an arc.
ARC = 13
"""Length of the middle line."""
BEND = 14
"""Rad that it turns by from end to end."""
GIRTHS = 15
"""Logarithms of ``GIRTH_KNOTS`` radii along it."""
GIRTH_KNOTS = 5
FLAT = 20
"""Logarithm of its height over its width."""
BENT_END = 21

SIZE = 47
"""Numbers of every shape's vector."""

# What a shape's code says: which kind, and which parts it has.
KIND, HOLLOW, PLAN, LIMB, SPOUT, END_A, END_B = 0, 1, 2, 3, 4, 5, 6
CODE_SIZE = 7
TURNED, TOOL, BENT = 0, 1, 2
ROUND, CORED, SUPER, FLAT_SIDED = 0, 1, 2, 3
"""Plans: an axis, a rectangle swept round, a superellipse of one shape at all heights, and one that flat
sides hold to their depth, while what is narrower than that, as a bottle's neck and cap are, is round."""
NO_LIMB, LOOP, BAR = 0, 1, 2
PLAIN, DISC, RING, SLOT = 0, 1, 2, 3
"""Ends of a tool."""
