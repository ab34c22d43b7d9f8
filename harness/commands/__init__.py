"""The commands of ``touchstone`` that belong to no experiment, and what all commands share."""
