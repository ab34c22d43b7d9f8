"""Thresholds of shape reconstruction: every limit that decides which answer is given.

Each row states its unit, then the bounded quantity and the reason; each section the modules that use it.
"""

import numpy as np

# Choice of the answer: family/estimate, family/freedom, fits, reconstruct
MIN_CONTACTS = 6  # contacts: at different places that test whether an object is of the family
MIN_LOG_ODDS = 2.0  # log-likelihood: of the smooth surface against the family: most objects are of the family
PREDICTION_SCALE = 2.0e-3  # m: scale of the Cauchy density of a left-out contact: a slipped one counts little
MAX_OUTLINE_ERROR = 0.05  # of the silhouette: missed or added; right answers have up to 0.01, wrong ones 0.3
MIN_BLIND_CONTACTS = 12  # contacts: without a picture that would have met a shape which lies beyond them
MAX_BEYOND_CONTACTS = 10.0e-3  # m: mean distance of a shape beyond so many contacts
ASSUMED_DEVIATION = 5.1e-3  # m: of an assumed family: the error of the single-view prior on held-out shapes
MAX_NUISANCE_COST = 20.0  # half chi2: of the bench errors; right answers have up to 17, wrong ones 21 to 88
OUTSIDE_CONTACT_COST = 6.0  # chi2: of a typical contact from which on the object is of no class
POOR_CONTACT_COST = 8.0  # chi2: of a typical contact from which on the class limits no extent
MIN_RIVAL_WEIGHT = 0.2  # weight: of a second class from which on the class is unknown
MAX_SEARCHES = 3  # searches: of a shape that no search fits well
MIN_BLIND_SEARCHES = 2  # searches: without a picture: the cost has more local minima
MAX_NUISANCE_OF_FEW = 4.0  # half chi2: of bench errors with few contacts; above it one more search is made

# Outliers: family/contact_fit, family/estimate, smooth/hermite
MIN_OUTLIER_COST = 16.0  # chi2: of a contact, of some five numbers, that may be an outlier
MIN_OUTLIER_RATIO = 5.0  # of the median: where all contacts are off, the shape is wrong and not the contacts
MIN_OUTLIER_DISTANCE = 1.0e-3  # m: normals at edges differ at a right contact
MAX_OUTLIER_FRACTION = 0.15  # of all contacts: that may have slipped; of more, the shape is wrong
MIN_TILT = float(np.radians(9.0))  # rad: of a rotated contact: more than errors of gel and shape explain
MIN_TILT_RATIO = 3.0  # of the median: where all contacts are rotated, the shape is
MIN_TILT_GAIN = 8.0  # chi2: that the rotation of a contact explains
MIN_PATCH_WIDTH = 1.2e-3  # m rms: of points across the narrower side: narrower contacts have no one normal
MAX_NORMAL_SPREAD = float(np.radians(10.0))  # rad: of normals about their mean: 30 degrees or more on an edge
MAX_PREDICTION_SIGMAS = 4.0  # deviations: between a contact and its prediction by the field

# Stated deviation of the family: family/estimate
MIN_DEVIATION = 0.6e-3  # m: of a surface that all hypotheses agree about
SPREAD_FACTOR = 1.2  # factor: on the spread: few hypotheses are kept, and their costs are of one likelihood
BLIND_FACTOR = 1.3  # factor: without a picture: few local minima are found
MISFIT_GAIN = 0.5  # per chi2: growth of the variance: a shape off its contacts is wrong elsewhere too
UNDERSIDE_DEVIATION = 1.5e-3  # m: of the underside: feet, foot rings and hollows are common
UNDERSIDE_HEIGHT = 5.0e-3  # m: above the support, below which neither gel nor camera reaches
UNDERSIDE_NORMAL = -0.5  # z of a normal: below which a surface faces down

# Known and bounded parts: family/estimate, smooth/free_space
FAMILY_TOUCH_DISTANCE = 6.0e-3  # m: from a contact point within which the surface counts as touched
TOUCH_DISTANCE = 5.0e-3  # m: the same of a smooth surface that faces alike
BORDER_DISTANCE = 1.5  # pixels: from the border of the silhouette within which the surface counts as seen
MIN_LIMITING_NORMAL = 0.4  # of a normal: along an axis from which on a contact limits the extent there
MAX_BEYOND_LAST = 25.0e-3  # m: beyond the last contact along an axis that is still bounded
MAX_HIDDEN_BORDER = 0.4  # of the border: of a silhouette that limits the extent
MIN_SAME_FACING = 0.5  # cosine: between normals that face alike
MAX_END_DISTANCE = 0.25  # of the extent: from an end within which a contact limits it
MAX_ALONG_SIGHT = 0.5  # cosine: between an axis and the line of sight that the silhouette limits
MIN_MOUTH_DISTANCE = 20.0e-3  # m: from a touched top beyond which the top may be the mouth of a vessel

# Stated place and size: family/estimate, smooth/stated_space
MAX_PLACE_SIGMAS = 3.0  # deviations: of the stated place
MAX_CENTRE_OFFSET = 0.25  # of largest: between centre and foot: a head heavier than its handle
MAX_LENGTH_RATIO = 1.1  # of largest: longest side of an answer: its own error

# Rarity of shapes: family/kinds, family/posterior, family/revolution, family/search
PART_RARITY = 3.0  # log: of a part that no sample of a class has
SOLID_RARITY = 6.0  # log: of a solid vessel, a hollow solid body, and a widening one
MIN_VESSEL_WIDTH = 0.35  # of its length: below which a vessel is a trough, as rare as a solid one
SIZE_SPREAD = 0.15  # log: deviation of sizes about the samples: they end at the lists of makers
SIZE_TAIL = 4.0  # degrees of freedom: of sizes: the fewer, the less odd is one far from all samples
TEMPERATURE = 3.0  # divisor: of costs in weights: errors of neighbouring readings are correlated
SAME_SHAPE = 1.5e-3  # m: largest difference of two shapes that are one hypothesis
MIN_WEIGHT = 0.01  # of the greatest: weight of a hypothesis in the mixture

# Axis of revolution of the smooth surface: smooth/revolution
MAX_AXIS_SINE = 0.35  # sine: between the horizontal part of a normal and the direction from the axis
MAX_PROFILE_ERROR = 2.5e-3  # m: median distance from the profile of its partners
MIN_RADIAL = 0.6  # of the normals: that are radial
MIN_AGREEING = 0.5  # of the paired points: that are radial and on the profile
MIN_PAIRED = 10  # points: with partners
MIN_PAIRED_TOUCHES = 6  # contacts: with partners
MAX_OPEN_ANGLE = float(np.radians(200.0))  # rad: without a point: a rounded corner is part of a circle too

# Readings and presses: answer, contact_points, explore/choosing, smooth/free_space, smooth/grid
MIN_PIXELS = 12  # pixels: that a seen object covers
MIN_EARLY_END = 2.0e-3  # m: before its end that a stopped way ends: more than the error of the arm
MIN_INDENTATION = 0.12e-3  # m: of a touched gel
CONTACT_DEPTH = 0.5  # of the deepest: indentation of the surface itself, not of gel that hangs from it
MAX_PIECE_DISTANCE = 3.0  # cells: between a contact and the piece of a body that it is on
MIN_PIECE_VOLUME = 0.2  # of the main piece: of a piece without contacts that is joined to it
MIN_EXPECTED_ERROR = 1.0e-3  # m: of hypotheses from which on a press is chosen to tell them apart
