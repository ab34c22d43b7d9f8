"""Contacts of the gel: how a shape disagrees with them, and which of them do not fit the rest."""
