"""Commands about one press: simulate it, read its depth and force."""
