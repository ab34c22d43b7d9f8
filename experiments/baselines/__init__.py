"""ObjectFolder 1.0 beside 2.0 and ours: the paper's tables of rendering time and quality, measured here."""
