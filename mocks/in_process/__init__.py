"""The mocked bench without sockets, in simulated time."""
