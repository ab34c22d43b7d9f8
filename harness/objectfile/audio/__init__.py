"""The sound of an ObjectFile: its network, its strikes, its WAV files."""
