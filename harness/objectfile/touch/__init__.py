"""The touch of an ObjectFile: codes of its surface, and the height maps they give."""
