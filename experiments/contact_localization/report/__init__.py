"""The answer as JSON, the comparison and the report of a localization."""
