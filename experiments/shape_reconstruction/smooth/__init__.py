"""Estimators without learning: smooth surfaces through contacts, bounded by free space and silhouette."""
