"""One kind of experiment: begin, rehearse, perform, resume, replay, answer, score, cost, tables."""
