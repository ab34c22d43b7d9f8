"""The far end of each cable: what an instrument would answer, written from its manual."""
