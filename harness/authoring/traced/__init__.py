"""Path tracing by Mitsuba: light that bounces, beside the direct level."""
