"""The known mesh that fits the readings best, at the size, turn and place that fit, bent to the contacts."""
