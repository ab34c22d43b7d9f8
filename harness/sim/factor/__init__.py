"""Sparse symmetric systems: elimination order, LDL^T, solves."""
