"""The far end of the acquisition box's cable: its commands, its converter, its small memory."""
