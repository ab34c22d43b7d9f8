"""Which point of the object's surface was touched?"""
