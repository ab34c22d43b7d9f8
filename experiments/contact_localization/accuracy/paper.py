"""What the paper printed of contact localization."""

PAPER_CM = {
    "random": (6.74, 12.96, 4.28, 9.39, 14.53, 14.21),
    "audio, simulated": (1.88, 0.26, 0.65, 0.23, 0.14, 0.74),
    "audio, real": (1.79, 1.16, 4.67, 1.04),
    "touch, simulated": (0.04, 0.03, 0.18, 0.04, 0.04, 0.04),
    "touch, real": (1.26, 0.78, 1.30, 0.44, 0.91, 3.82),
    "audio and touch, simulated": (0.02, 0.04, 0.09, 0.04, 0.23, 0.30),
    "audio and touch, real": (0.59, 0.36, 0.51, 0.63),
}
"""ObjectFolder 2.0, table 4: mean error in cm over six objects of theirs, 5 to 7 contacts; the last two
objects were not struck in reality."""
