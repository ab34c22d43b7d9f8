"""The picture of a press: reference, the ways to it, and what 1.0 had."""
