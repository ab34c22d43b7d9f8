"""The glance: a network that predicts the whole shape from the silhouette alone, and its training."""
