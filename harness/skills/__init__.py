"""What an arm does at a bench: choose places, plan, press, strike."""
