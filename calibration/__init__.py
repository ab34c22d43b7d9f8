"""Programs that fit an instrument's calibration artefact to a recording of it."""
