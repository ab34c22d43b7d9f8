"""In which order a sparse symmetric system is eliminated, and what fills: the plan of its factors.

Unknowns that share their neighbours (the three displacements of a node) are planned as one. The
order is METIS's nested dissection (Karypis and Kumar, SIAM J. Scientific Computing 20(1), 1998);
columns of one pattern are gathered in supernodes, a few explicit zeros allowed (Ashcraft and
Grimes, The influence of relaxed supernode partitions, ACM TOMS 15(4), 1989).
"""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pymetis
import scipy.sparse as sp

from harness.basics.arrays import IntArray
from harness.basics.compiled import compiled, copy_line

Pattern: TypeAlias = "sp.csr_array[Any] | sp.csc_array[Any]"

_SEED = 4321
"""Of the dissection: one mesh, one order."""


class Elimination(NamedTuple):
    """The plan for every symmetric matrix within one pattern of ``u`` unknowns.

    Supernode ``s`` eliminates the unknowns ``firsts[s]`` to ``firsts[s + 1]`` of the new order;
    below them its columns fill the rows ``rows[starts[s] : starts[s + 1]]``, ascending.
    """

    order: IntArray  #: ``(u,)``, the old number of each new one.
    rank: IntArray  #: ``(u,)``, the new number of each old one.
    firsts: IntArray  #: ``(s + 1,)``.
    starts: IntArray  #: ``(s + 1,)``.
    rows: IntArray  #: new numbers.
    children: IntArray  #: ``(s,)``: how many supernodes hand what is left of theirs to this one.

    @property
    def widths(self) -> IntArray:
        """``(s,)``: unknowns that each supernode eliminates."""
        return np.diff(self.firsts)

    @property
    def heights(self) -> IntArray:
        """``(s,)``: rows below them."""
        return np.diff(self.starts)

    @property
    def stored(self) -> int:
        """Numbers that a factor keeps."""
        return int((self.widths * (self.widths + self.heights)).sum())


def elimination(pattern: Pattern, together: IntArray | None = None) -> Elimination:
    """Plan for the matrices that have no entries outside a symmetric pattern.

    Args:
        pattern: ``(g, g)``, which groups of unknowns meet; the values do not matter.
        together: ``(u,)``, the group of each unknown; None if each is its own.
    """
    groups = pattern.shape[0]
    together = np.arange(groups) if together is None else np.asarray(together, dtype=np.int64)
    members = np.argsort(together, kind="stable")
    width = np.bincount(together, minlength=groups).astype(np.int64)
    starts, neighbours = _without_diagonal(pattern.indptr.astype(np.int64), pattern.indices.astype(np.int64))
    if len(neighbours) == 0:
        order = np.arange(len(starts) - 1)  # unconnected unknowns need no dissection
    else:
        graph = pymetis.CSRAdjacency(starts.astype(np.int32), neighbours.astype(np.int32))
        dissected, _ = pymetis.nested_dissection(graph, options=pymetis.Options(seed=_SEED))
        order = np.asarray(dissected, dtype=np.int64)
    parent = _tree(starts, neighbours, order, _ranks(order))
    follow = _postorder(parent)
    ranks = _ranks(follow)
    old = parent[follow]
    order, parent = order[follow], np.where(old < 0, -1, ranks[old])
    below = _below(starts, neighbours, order, _ranks(order), parent, width)
    ends = _supernodes(parent, below, width[order])
    row_starts, rows, children = _structure(starts, neighbours, order, _ranks(order), ends)
    # Each group replaced by the unknowns that are in it.
    begins = np.concatenate([[0], np.cumsum(width)])
    firsts = np.concatenate([[0], np.cumsum(width[order])])
    unknowns = members[_runs(begins[order], width[order])]
    long_rows = _runs(firsts[rows], width[order[rows]])
    long_starts = np.concatenate([[0], np.cumsum(width[order[rows]])])[row_starts]
    return Elimination(unknowns, _ranks(unknowns), firsts[ends], long_starts, long_rows, children)


@compiled
def _without_diagonal(starts: IntArray, columns: IntArray) -> tuple[IntArray, IntArray]:
    kept = np.empty(len(columns), np.int64)
    fresh = np.zeros(len(starts), np.int64)
    total = 0
    for row in range(len(starts) - 1):
        for p in range(starts[row], starts[row + 1]):
            if columns[p] != row:
                kept[total] = columns[p]
                total += 1
        fresh[row + 1] = total
    return fresh, kept[:total].copy()


def _ranks(order: IntArray) -> IntArray:
    ranks = np.empty(len(order), dtype=np.int64)
    ranks[order] = np.arange(len(order))
    return ranks


@compiled
def _tree(starts: IntArray, neighbours: IntArray, order: IntArray, rank: IntArray) -> IntArray:
    """Elimination tree: the next column that each one changes, -1 for none (Liu, 1990)."""
    parent = np.full(len(order), -1, np.int64)
    ancestor = np.full(len(order), -1, np.int64)
    for i in range(len(order)):
        for p in range(starts[order[i]], starts[order[i] + 1]):
            k = rank[neighbours[p]]
            while k < i and ancestor[k] != i:
                above = ancestor[k]
                ancestor[k] = i
                if above == -1:
                    parent[k] = i
                    break
                k = above
    return parent


@compiled
def _postorder(parent: IntArray) -> IntArray:
    """The old number of each new one: every column after all below it in the tree."""
    count = len(parent)
    first = np.full(count + 1, -1, np.int64)
    following = np.full(count, -1, np.int64)
    for j in range(count - 1, -1, -1):
        above = parent[j] if parent[j] >= 0 else count
        following[j] = first[above]
        first[above] = j
    order = np.empty(count, np.int64)
    path = np.empty(count + 1, np.int64)
    path[0], depth, done = count, 1, 0
    while depth > 0:
        node = path[depth - 1]
        child = first[node]
        if child >= 0:
            first[node] = following[child]
            path[depth] = child
            depth += 1
        else:
            depth -= 1
            if node < count:
                order[done] = node
                done += 1
    return order


@compiled
def _below(
    starts: IntArray,
    neighbours: IntArray,
    order: IntArray,
    rank: IntArray,
    parent: IntArray,
    width: IntArray,
) -> IntArray:
    """``(g,)``: unknowns below each column of groups once it is filled."""
    below = np.zeros(len(order), np.int64)
    mark = np.full(len(order), -1, np.int64)
    for i in range(len(order)):
        mark[i] = i
        for p in range(starts[order[i]], starts[order[i] + 1]):
            k = rank[neighbours[p]]
            while k < i and mark[k] != i:
                mark[k] = i
                below[k] += width[order[i]]
                k = parent[k]
    return below


@compiled
def _worth(width: int, zeros: float, total: float) -> bool:
    """Whether a supernode may hold that many explicit zeros, for longer products."""
    share = 0.05
    if width <= 24:
        share = 0.6
    elif width <= 72:
        share = 0.2
    elif width <= 144:
        share = 0.1
    return zeros <= share * total


@compiled
def _supernodes(parent: IntArray, below: IntArray, width: IntArray) -> IntArray:
    """``(s + 1,)``: the first column of each supernode, and the end."""
    count = len(parent)
    ends = np.zeros(count + 1, np.int64)
    wide, real = np.zeros(count, np.int64), np.zeros(count)
    top = -1
    for j in range(count):
        top += 1
        ends[top + 1], wide[top] = j + 1, width[j]
        real[top] = 0.5 * width[j] * (width[j] + 1) + float(width[j] * below[j])
        while top > 0 and 0 <= parent[ends[top] - 1] <= j:
            both = wide[top - 1] + wide[top]
            total = 0.5 * both * (both + 1) + float(both * below[j])
            found = real[top - 1] + real[top]
            if not _worth(both, total - found, total):
                break
            top -= 1
            ends[top + 1], wide[top], real[top] = j + 1, both, found
    return ends[: top + 2].copy()


@compiled
def _structure(
    starts: IntArray, neighbours: IntArray, order: IntArray, rank: IntArray, ends: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Row starts and rows of every supernode, in groups, and how many children each has."""
    count = len(ends) - 1
    holder = np.empty(len(order), np.int64)
    for s in range(count):
        holder[ends[s] : ends[s + 1]] = s
    first, following = np.full(count, -1, np.int64), np.full(count, -1, np.int64)
    children, mark = np.zeros(count, np.int64), np.full(len(order), -1, np.int64)
    row_starts, rows, total = np.zeros(count + 1, np.int64), np.empty(len(neighbours) + 16, np.int64), 0
    for s in range(count):
        if total + len(order) > len(rows):
            longer = np.empty(2 * len(rows) + len(order), np.int64)
            copy_line(longer, rows[:total])
            rows = longer
        for column in range(ends[s], ends[s + 1]):
            for p in range(starts[order[column]], starts[order[column] + 1]):
                row = rank[neighbours[p]]
                if row >= ends[s + 1] and mark[row] != s:
                    mark[row] = s
                    rows[total] = row
                    total += 1
        child = first[s]
        while child >= 0:
            children[s] += 1
            for p in range(row_starts[child], row_starts[child + 1]):
                if rows[p] >= ends[s + 1] and mark[rows[p]] != s:
                    mark[rows[p]] = s
                    rows[total] = rows[p]
                    total += 1
            child = following[child]
        copy_line(rows[row_starts[s] :], np.sort(rows[row_starts[s] : total]))
        row_starts[s + 1] = total
        if total > row_starts[s]:
            above = holder[rows[row_starts[s]]]
            following[s] = first[above]
            first[above] = s
    return row_starts, rows[:total].copy(), children


def _runs(begins: IntArray, lengths: IntArray) -> IntArray:
    shift: IntArray = begins - (np.cumsum(lengths) - lengths)
    return np.arange(int(lengths.sum())) + np.repeat(shift, lengths)
