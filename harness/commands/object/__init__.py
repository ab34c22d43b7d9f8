"""Commands about ObjectFiles: build, render, compare, view."""
