"""Household shapes as signed distances of few numbers, and which of them the readings of an object allow."""
