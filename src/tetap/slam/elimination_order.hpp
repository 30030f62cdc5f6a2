// SPDX-License-Identifier: Apache-2.0
// Order in which the poses of a graph are eliminated, and the entries that their rows of the square-root information
// get. The order is minimum degree on the elimination graph kept as bits (Tinney & Walker 1967; George & Liu, SIAM
// Review 31(1), 1989). One node is held back to the end. A postorder of the elimination tree follows (Liu, SIAM J.
// Matrix Anal. 11(1), 1990).
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace tetap::slam {

/// Neighbours as bits: what begin() and pivot() work on. Its memory is free once the order is found.
template <int kNodes>
struct Adjacency {
  static constexpr int kWords = (kNodes + 31) / 32;
  std::array<std::array<std::uint32_t, kWords>, kNodes> bits;

  void connect(int a, int b) {
    set(a, b);
    set(b, a);
  }

 private:
  void set(int a, int b) {
    bits[static_cast<std::size_t>(a)][static_cast<std::size_t>(b / 32)] |= std::uint32_t{1} << (b % 32);
  }
};

/// Order and pattern for up to kNodes nodes whose rows have together up to kBlocks entries off the diagonal.
template <int kNodes, int kBlocks>
class EliminationOrder {
  static_assert(kNodes < 0xffff);

 public:
  using Index = std::uint16_t;

  /// The graph has `nodes` nodes and no edge yet.
  void begin(int nodes, Adjacency<kNodes>& graph) {
    nodes_ = nodes;
    used_ = 0;
    eliminated_ = 0;
    words_ = static_cast<std::size_t>(nodes + 31) / 32;
    fits_ = true;
    for (int i = 0; i < nodes; ++i)
      for (std::size_t w = 0; w < words_; ++w) graph.bits[at(i)][w] = 0;
  }

  /// After all edges were connected: nodes are sorted by degree.
  void sort(const Adjacency<kNodes>& graph) {
    for (int d = 0; d < nodes_; ++d) head_[at(d)] = kNone;
    least_ = 0;
    for (int i = nodes_ - 1; i >= 0; --i) link(i, degree(i, graph));
  }

  /// Implements docs/explanation/pose_graph.md (4).
  /// Eliminates the node of least degree; the last node waits for the end. Operations done, about one a word.
  int pivot(Adjacency<kNodes>& graph) {
    const int node = take_least();
    auto& row = graph.bits[at(node)];
    const std::uint32_t first = used_;
    int cost = static_cast<int>(words_);
    for (std::size_t w = 0; w < words_; ++w)
      for (std::uint32_t rest = row[w]; rest != 0; rest &= rest - 1) {
        if (used_ == static_cast<std::uint32_t>(kBlocks)) {
          fits_ = false;
          return cost;
        }
        index_[used_++] = static_cast<Index>(static_cast<int>(w) * 32 + std::countr_zero(rest));
      }
    first_[at(node)] = first;
    count_[at(node)] = static_cast<Index>(used_ - first);
    for (std::uint32_t k = first; k < used_; ++k) {
      const int neighbour = index_[k];
      auto& of = graph.bits[at(neighbour)];
      for (std::size_t w = 0; w < words_; ++w) of[w] |= row[w];
      clear(of, neighbour);
      clear(of, node);
      unlink(neighbour);
      link(neighbour, degree(neighbour, graph));
      cost += 2 * static_cast<int>(words_);
    }
    order_[at(eliminated_)] = static_cast<Index>(node);
    position_[at(node)] = static_cast<Index>(eliminated_);
    ++eliminated_;
    return cost;
  }
  [[nodiscard]] bool all_eliminated() const { return eliminated_ == nodes_; }
  /// False when the rows need more than kBlocks entries: the order is of no use.
  [[nodiscard]] bool fits() const { return fits_; }

  /// Numbers the nodes anew in postorder, so that a node's children are eliminated right before it; patterns then hold
  /// positions, sorted. Operations done.
  int finish() {
    build_tree();
    walk_tree();
    for (int p = 0; p < nodes_; ++p) position_[at(order_[at(p)])] = static_cast<Index>(p);
    int cost = 4 * nodes_;
    for (int i = 0; i < nodes_; ++i) cost += sort_pattern(i);
    return cost;
  }

  [[nodiscard]] int nodes() const { return nodes_; }
  [[nodiscard]] int node(int position) const { return order_[at(position)]; }
  [[nodiscard]] int position(int node) const { return position_[at(node)]; }
  /// Number of entries off the diagonal that the row at this position has.
  [[nodiscard]] int count(int position) const { return count_[at(order_[at(position)])]; }
  /// Position of entry k of that row: later than the row, ascending.
  [[nodiscard]] int entry(int position, int k) const {
    return index_[first_[at(order_[at(position)])] + static_cast<std::uint32_t>(k)];
  }
  /// Number of rows with their first entry in this row's column.
  [[nodiscard]] int children(int position) const { return children_[at(position)]; }
  [[nodiscard]] std::uint32_t entries() const { return used_; }

 private:
  static constexpr Index kNone = 0xffff;
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  template <class Row>
  static void clear(Row& row, int bit) {
    row[static_cast<std::size_t>(bit / 32)] &= ~(std::uint32_t{1} << (bit % 32));
  }
  /// std::popcount is a call where the core has no such instruction.
  [[nodiscard]] static constexpr int ones(std::uint32_t x) {
    x -= (x >> 1) & 0x5555'5555U;
    x = (x & 0x3333'3333U) + ((x >> 2) & 0x3333'3333U);
    return static_cast<int>((((x + (x >> 4)) & 0x0f0f'0f0fU) * 0x0101'0101U) >> 24);
  }
  [[nodiscard]] int degree(int node, const Adjacency<kNodes>& graph) const {
    int sum = 0;
    for (std::size_t w = 0; w < words_; ++w) sum += ones(graph.bits[at(node)][w]);
    return sum;
  }

  void link(int node, int degree) {
    degree_[at(node)] = static_cast<Index>(degree);
    if (node == nodes_ - 1) return;  // the last node is in no list
    const Index next = head_[at(degree)];
    next_[at(node)] = next;
    previous_[at(node)] = kNone;
    if (next != kNone) previous_[at(next)] = static_cast<Index>(node);
    head_[at(degree)] = static_cast<Index>(node);
    if (degree < least_) least_ = degree;
  }
  void unlink(int node) {
    if (node == nodes_ - 1) return;
    const Index next = next_[at(node)], previous = previous_[at(node)];
    if (next != kNone) previous_[at(next)] = previous;
    if (previous != kNone)
      next_[at(previous)] = next;
    else
      head_[at(degree_[at(node)])] = next;
  }
  int take_least() {
    if (eliminated_ == nodes_ - 1) return nodes_ - 1;
    while (head_[at(least_)] == kNone) ++least_;  // a node that is left has a degree below nodes_
    const int node = head_[at(least_)];
    unlink(node);
    return node;
  }

  /// Children of every node as lists, in head_ (first child), next_ (sibling); previous_ holds the parent.
  void build_tree() {
    for (int i = 0; i < nodes_; ++i) head_[at(i)] = kNone;
    for (int p = nodes_ - 1; p >= 0; --p) {
      const int node = order_[at(p)];
      int parent = kNone, earliest = nodes_;
      for (std::uint32_t k = first_[at(node)]; k < first_[at(node)] + count_[at(node)]; ++k)
        if (position_[at(index_[k])] < earliest) earliest = position_[at(index_[k])], parent = index_[k];
      previous_[at(node)] = static_cast<Index>(parent);
      if (parent == kNone) continue;
      next_[at(node)] = head_[at(parent)];
      head_[at(parent)] = static_cast<Index>(node);
    }
  }
  /// Fills order_ anew. The trees of a graph that hangs not together follow each other; the last node's comes last,
  /// because its root is the last node.
  void walk_tree() {
    int position = 0;
    for (int root = 0; root < nodes_; ++root) {
      if (previous_[at(root)] != kNone) continue;
      int node = root;
      bool down = true;
      for (int steps = 0; steps < 3 * nodes_; ++steps) {
        if (down && head_[at(node)] != kNone) {
          node = head_[at(node)];
          continue;
        }
        int children = 0;
        for (Index c = head_[at(node)]; c != kNone; c = next_[at(c)]) ++children;
        order_[at(position)] = static_cast<Index>(node);
        children_[at(position)] = static_cast<Index>(children);
        ++position;
        if (node == root) break;
        down = next_[at(node)] != kNone;
        node = down ? next_[at(node)] : previous_[at(node)];
      }
    }
  }
  int sort_pattern(int node) {
    const std::uint32_t first = first_[at(node)], end = first + count_[at(node)];
    int cost = 0;
    for (std::uint32_t k = first; k < end; ++k) {
      const Index value = position_[at(index_[k])];
      std::uint32_t to = k;
      for (; to > first && index_[to - 1] > value; --to, ++cost) index_[to] = index_[to - 1];
      index_[to] = value;
      ++cost;
    }
    return cost;
  }

  int nodes_ = 0;
  int eliminated_ = 0;
  int least_ = 0;
  std::uint32_t used_ = 0;
  std::size_t words_ = 0;
  bool fits_ = true;
  std::array<Index, kNodes> order_{}, position_{}, count_{}, children_{}, degree_{}, next_{}, previous_{}, head_{};
  std::array<std::uint32_t, kNodes> first_{};
  std::array<Index, kBlocks> index_{};
};

}  // namespace tetap::slam
