"""The one world behind all mocks: it holds the truth."""
