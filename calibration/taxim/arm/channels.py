"""Names of what is recorded of a press, beside the arm's own channels."""

IMAGE = "gel.image"
"""The press at rest; of a background step the untouched gel."""

UNTOUCHED = "gel.untouched.image"
"""The gel at the stand-off, just before."""

DESCENT = "gel.descent.image"
"""On the way down, from the first touch on."""

WAY = "press.way"
"""m from the stand-off, of each picture of the way down."""

STATE = "press.state"
"""Whether the ball was met (1 or 0), whether the picture came to rest (1 or 0), s that it took."""

UNREST = "press.unrest"
"""Grey levels between each look and the one before."""

ARM = "arm.base_from_flange"
