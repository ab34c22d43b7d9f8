"""Fits the networks of the baselines; the one part of them that needs torch."""
