"""The dials of a localization: cases, cost curve, budget, table."""
