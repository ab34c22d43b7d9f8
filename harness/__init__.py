"""The core: readings, recordings, effects, the twin and the report; imports none of the packages above it."""
