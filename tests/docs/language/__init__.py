"""The check of the project's language, with the lists of words that it uses."""
