"""Every figure of every page."""
