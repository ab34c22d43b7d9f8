"""Ball presses made by the arm: plan, press, record, and what the moves tell."""
