"""Commands of every experiment: run, replay, cost, tables, demo."""
