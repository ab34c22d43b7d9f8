"""What each key of ``result.json`` means; ``test_reference.py`` holds the names to those of a real result."""

COMMON = {
    "schema": "1",
    "experiment": "name of the experiment",
    "object": "name of the object",
    "mock": "whether the bench was a mocked one",
    "seed": "of everything random in the run",
    "plan": "`ran`: the effects that were simulated, each with its `reason` and `levels`, and once the "
    "report is drawn with its `seconds` and `calls`; `skipped`: the others, each with its `reason`",
    "accuracy": "the level of every dial",
    "world": "of a mocked run: how the world differed from the model (never read by an estimator); else null",
    "recording": "the run's folder",
    "report": "path of the report's page; null until it is drawn",
    "warnings": "sentences that an operator should read",
    "answered_after_s": "s from the last step's commit to the answer; null in a replay",
    "observed": "with the report: each quantity of `observe`, simulated at the answer: shape, dtype, least, "
    "mean, most; the arrays are in `observed.npz`",
    "agreement": "with the report: the readings against networks, or the simulation, and the twin: "
    "one `verdict` a sense with its `residuals`, and `first_in_doubt`; as `touchstone compare` prints it",
}
"""Of every experiment."""

ASKED = {
    "cost": "only with `--budget` or `--error`: what was asked, what it took and the `levels` chosen",
}
"""Only where it was asked for."""

LOCALIZATION = {
    "contacts": "how many contacts were used",
    "estimates": "by sense (`touch`, `audio`, `both`): an estimate, or `refused` with the reason",
    "answer": "the sense whose estimate is the answer",
    "random_baseline_m": "m, mean error of a random point of the surface; null without a truth",
    "geometry_baseline_m": "m, error of the answer from the arm's translations alone; null without a truth",
    "symmetry": "the object's rotational symmetry, found from the mesh",
    "seconds": "s that the answer took, all senses and the reading of the images included",
}
"""Of contact localization, beside the common ones."""

ESTIMATE = {
    "position_m": "m, the last contact in the object's frame",
    "error_m": "m, from the true contact; null without a truth",
    "error_symmetric_m": "m, the same modulo the object's rotations",
    "error_mean_m": "m, mean over all contacts of the run",
    "error_top10_m": "m, mean distance of the ten likeliest places from the truth",
    "credible90_m": "m, radius around the answer that holds 90 % of the posterior",
    "region90_area_m2": "m^2, area of the 90 % region on the surface",
    "in_region90": "whether the truth lies in that region",
    "modes": "places that stay likely: `position_m`, `weight`, `spread_m`",
    "yaw_rad": "rad, the object's yaw off its nominal orientation",
    "yaw_sigma_rad": "rad, its standard deviation",
    "contacts": "each contact: its number from 1, `position_m`, `error_m`, `fit_nats`, `flags`",
    "seconds": "s of this estimate",
    "seconds_by_stage": "s by stage",
}
"""Of one estimate of contact localization."""

SHAPE = {
    "error_m": "m, Chamfer-L1 of the fused surface from the truth, samples to surface; null without a truth",
    "deviation_m": "m, mean of the standard deviations of the fused surface's vertices",
    "extents_m": "m, sides of the fused surface's box along the axes of base",
    "method": "the estimator",
    "choose": "what chose where the presses led",
    "presses": "how many guarded ways the gel has followed, those that met nothing too",
    "contacts": "how many of them the gel read, each place counted once",
    "repeated": "how many presses repeat an earlier one at its place; each place counts once",
    "ended_by_housing": "how many ended as the sensor's housing met it, with nothing in the gel",
    "estimates": "by sense (`vision`, `touch`, `fused`): an estimate, or `refused` with the reason",
    "seconds": "s that the answers took, the reading of the pictures included",
}
"""Of shape reconstruction, beside the common ones."""

SHAPE_ESTIMATE = {
    "chamfer_m": "m, half the sum of the mean distances from samples of each surface to the other; null "
    "without a truth",
    "chamfer_points_m": "m, the published form: from 10,000 points to 10,000 points",
    "accuracy_m": "m, mean distance from the estimate to the truth",
    "completeness_m": "m, mean distance from the truth to the estimate",
    "f_score": "0 to 1, at 5 mm",
    "deviation_m": "m, mean of the vertices' standard deviations",
    "extents_m": "m, sides of the box along the axes of base",
    "touched": "share of the vertices that were under a gel",
    "seen": "share of the vertices at the border of the silhouette",
    "not_bounded": "names of the axes along which no reading bounds the object",
    "doubtful_m": "m that a touch is off what all others say, by its step",
    "flags": "sentences that the answer carries",
    "details": "what the estimator found beside",
    "mesh": "file of the surface beside `result.json`, each vertex with its `deviation` and `known_by`",
    "seconds": "s of this estimate",
    "refused": "why there is none; else null",
}
"""Of one estimate of shape reconstruction."""
