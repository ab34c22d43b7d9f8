"""Readers of the mesh formats that declare units, axes and colours: glTF, COLLADA and 3MF."""
