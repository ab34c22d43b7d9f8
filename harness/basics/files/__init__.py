"""Files by what they are: named by an operator, from outside, JSON, of an owner who may go."""
