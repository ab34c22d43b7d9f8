"""The tiny networks of a look: weights, graph, and the kernels that evaluate them."""
