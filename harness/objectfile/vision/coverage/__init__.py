"""Which pixels an object covers, by how much, and how deep it is there."""
