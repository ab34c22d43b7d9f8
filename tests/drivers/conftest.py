"""Drivers against far ends that run in this process or beside it."""

from tests.support.idle_computer import idle_computer as idle_computer
