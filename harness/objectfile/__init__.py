"""ObjectFiles: what is known of one object, in a folder that any program can read."""
