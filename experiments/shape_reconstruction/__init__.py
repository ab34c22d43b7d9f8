"""Shape reconstruction: what does an object never seen look like, by a look and a few touches?"""
