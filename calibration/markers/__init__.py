"""The dots printed on a gel: found in pictures of it at rest."""
