"""The instruments of a station file: one module for each family, and the table of their kinds."""
