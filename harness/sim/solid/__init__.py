"""From any mesh file to a solid: intake, repair, walls, tetrahedra, elements."""
