"""A mesh's faces, searched: rays, nearest points, and the grids and clusters that make both fast."""
