"""Whether a tactile picture is of the gel, the light and the orientation that its calibration was made of."""
