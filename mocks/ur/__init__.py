"""A controller that speaks UR's real-time data exchange, dashboard and script ports."""
