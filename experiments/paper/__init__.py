"""Networks and baselines that serve only to reproduce the tables of ObjectFolder 2.0.

May use the three experiments; only the table of commands and the table of experiments name it.
"""
