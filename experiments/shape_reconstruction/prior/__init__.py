"""The single-view prior: a network that predicts the whole shape from the silhouette, and its training."""
