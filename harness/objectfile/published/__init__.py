"""Networks imported from ObjectFolder's published files: the folder, the graphs, how they are queried."""
