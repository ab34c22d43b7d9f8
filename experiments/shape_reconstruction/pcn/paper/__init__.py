"""The network of the paper as published: another training, rows of a table; none ships."""
