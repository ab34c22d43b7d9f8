"""The picture of an object: reference, the ways to it, and what 1.0 had."""
