"""Estimators of shape that learn nothing: from raw points to a surface through the contacts."""
