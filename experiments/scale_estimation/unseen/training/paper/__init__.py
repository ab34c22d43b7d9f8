"""How the paper's own networks are trained; all but the samples needs torch."""
