"""The sound of a strike: reference, the ways to it, and what 1.0 had."""
