"""Commands about objects whose networks were published by others: import, query files."""
