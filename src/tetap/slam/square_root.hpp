// SPDX-License-Identifier: Apache-2.0
// Least squares of a graph of poses by orthogonal elimination. Rows of the whitened Jacobian are rotated into the
// triangular square root R of the information (Dellaert & Kaess, IJRR 25(12), 2006). There is one dense front a pose
// (Duff & Reid 1983; Matstoms, ACM TOMS 20(1), 1994). J^T J is never formed: its condition number is beyond what float
// resolves. Three rows are rotated at a time (Householder; Golub & Van Loan 2013, alg. 5.1.1).
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/base/math_double.hpp"
#include "tetap/base/reinitialise.hpp"
#include "tetap/filter/symmetric.hpp"
#include "tetap/slam/elimination_order.hpp"

namespace tetap::slam {

/// Rows of one measurement between two nodes: whitened Jacobian blocks by row, and the whitened residual, negative.
template <class Scalar>
struct BlockRow {
  using Block = std::array<std::array<Scalar, 3>, 3>;
  Block of_first, of_second;
  std::array<Scalar, 3> rest;
};

/// Up to kNodes nodes of three states, up to kRows measurements of three rows. Finished rows of R grow from the bottom
/// of one arena of kBlocks 3 x 3 blocks, unfinished fronts from its top.
template <class Scalar, int kNodes, int kRows, int kBlocks>
class SquareRoot {
 public:
  static constexpr int kFixed = -1;  ///< in place of a node: the pose that is no unknown
  static_assert(kRows < 0xffff);

  void begin(int nodes) {
    base::begin_life(memory_.adjacency);
    order_.begin(nodes, memory_.adjacency);
    for (int i = 0; i < nodes; ++i) first_row_[at(i)] = kNone;
  }
  /// A measurement between two nodes, before sort(). Rows are named 0 ... kRows - 1.
  void connect(int a, int b) {
    if (a != kFixed && b != kFixed && a != b) memory_.adjacency.connect(a, b);
  }
  void sort() { order_.sort(memory_.adjacency); }
  /// One step of the search for an order; its cost.
  int order_step() { return order_.pivot(memory_.adjacency); }
  [[nodiscard]] bool ordered() const { return order_.all_eliminated() || !order_.fits(); }
  /// After the last order_step(). False when fronts and rows do not fit the arena.
  [[nodiscard]] bool finish_order() {
    if (!order_.fits()) return false;
    cost_of_order_ = order_.finish();
    return fits();
  }
  [[nodiscard]] int cost_of_order() const { return cost_of_order_; }

  /// Memory for one covariance a pose, the fixed one too; free from begin_scratch() to begin_rows().
  using Scratch = std::array<filter::Symmetric<Scalar, 3>, kNodes + 1>;
  Scratch& scratch() { return memory_.scratch; }
  void begin_scratch() { base::begin_life(memory_.scratch); }
  /// Forgets the measurements, keeps the order.
  void begin_rows() {
    base::begin_life(memory_.arena);
    for (int i = 0; i < order_.nodes(); ++i) first_row_[at(i)] = kNone;
    position_ = 0;
    phase_ = Phase::kStart;
    finished_ = 0;
    low_ = kBlocks * 9U;
    depth_ = 0;
    decrease_ = 0;
    singular_ = false;
  }
  /// The measurement `row` is between these nodes; it is asked for when the earlier of them is eliminated.
  void add_row(int row, int a, int b) {
    const bool by_a = b == kFixed || (a != kFixed && order_.position(a) < order_.position(b));
    const int node = by_a ? a : b;
    if (node == kFixed) return;
    next_row_[at(row)] = first_row_[at(node)];
    first_row_[at(node)] = static_cast<Index>(row);
  }
  [[nodiscard]] int rows_left() const { return order_.nodes() - position_; }
  [[nodiscard]] bool rows_done() const { return position_ == order_.nodes() || singular_; }
  /// Implements docs/explanation/pose_graph.md (3).
  /// One step of the elimination: a measurement, three rows of a front, or a front begun or ended.
  /// `source.linearise(row, block_row)` gives the measurement and returns its two nodes. The cost: entries that were
  /// visited.
  template <class Source>
  int row_step(const Source& source) {
    switch (phase_) {
      case Phase::kStart:
        return start_front();
      case Phase::kChildren:
        return insert_child();
      case Phase::kMeasurements:
        return insert_measurement(source);
      case Phase::kEnd:
        break;
    }
    return end_front();
  }
  /// A node is not held by any measurement, or something is no number.
  [[nodiscard]] bool singular() const { return singular_; }
  /// By how much the linearised problem's sum of squares falls.
  [[nodiscard]] Scalar decrease() const { return decrease_; }

  void begin_solve() { top_ = finished_; }
  [[nodiscard]] bool solved() const { return position_ == 0; }
  /// Back substitution of one node; the cost.
  int solve_step() {
    --position_;
    const int count = order_.count(position_), n = 3 * (count + 1);
    top_ -= 3U * static_cast<std::uint32_t>(n);
    const Scalar* row = memory_.arena.data() + top_;
    std::array<Scalar, 3> sum{row[n], row[n + 1 + n - 1], row[n + 1 + n + n - 2]};
    for (int k = 0; k < count; ++k) {
      const Scalar* d = &correction_[at(3 * order_.node(order_.entry(position_, k)))];
      const Scalar* r0 = row + 3 * (k + 1);
      const Scalar* r1 = r0 + n;
      const Scalar* r2 = r1 + n - 1;
      for (int i = 0; i < 3; ++i) sum[0] -= r0[i] * d[i], sum[1] -= r1[i] * d[i], sum[2] -= r2[i] * d[i];
    }
    Scalar* const d = &correction_[at(3 * order_.node(position_))];
    d[2] = sum[2] / row[2 * n + 1];
    d[1] = (sum[1] - row[n + 2] * d[2]) / row[n + 1];
    d[0] = (sum[0] - row[1] * d[1] - row[2] * d[2]) / row[0];
    return n;
  }
  /// Solution of the linearised problem: correction of a node, three states in a row.
  [[nodiscard]] const Scalar* correction(int node) const { return &correction_[at(3 * node)]; }

  /// Covariance of the last node: valid between the last row_step() and begin_rows().
  [[nodiscard]] filter::Symmetric<Scalar, 3> covariance_of_last() const {
    const Scalar* r = memory_.arena.data() + finished_ - 9;
    const Scalar i0 = Scalar{1} / r[0], i1 = Scalar{1} / r[4], i2 = Scalar{1} / r[7];
    const Scalar i01 = -r[1] * i0 * i1, i12 = -r[5] * i1 * i2, i02 = (r[1] * r[5] * i1 - r[2]) * i0 * i2;
    filter::Symmetric<Scalar, 3> p;
    p(0, 0) = i0 * i0 + i01 * i01 + i02 * i02;
    p(0, 1) = i01 * i1 + i02 * i12;
    p(1, 1) = i1 * i1 + i12 * i12;
    p(0, 2) = i02 * i2;
    p(1, 2) = i12 * i2;
    p(2, 2) = i2 * i2;
    return p;
  }
  [[nodiscard]] std::uint32_t blocks_used() const { return most_ / 9; }

 private:
  using Index = std::uint16_t;
  using Arena = std::array<Scalar, static_cast<std::size_t>(kBlocks) * 9>;
  static constexpr Index kNone = 0xffff;
  /// A square below is the rounding of whitened rows: reflecting it would mix noise into what is known.
  static constexpr Scalar kNothing = sizeof(Scalar) == 8 ? static_cast<Scalar>(1e-28) : static_cast<Scalar>(1e-14);
  enum class Phase : std::uint8_t { kStart, kChildren, kMeasurements, kEnd };
  union Memory {
    Memory() : adjacency{} {}
    Adjacency<kNodes> adjacency;
    Scratch scratch;
    Arena arena;
  };

  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }
  /// Scalars in n rows of a front with n columns and a right-hand side, row r without its first r columns.
  static constexpr std::uint32_t triangle(int n) { return static_cast<std::uint32_t>(n * (n + 3) / 2); }
  /// The latest child has this row's very pattern, so its front is this one's.
  [[nodiscard]] bool in_place(int p) const {
    return order_.children(p) > 0 && order_.count(p - 1) == order_.count(p) + 1;
  }

  /// Plays all fronts through by their sizes.
  [[nodiscard]] bool fits() {
    std::uint32_t finished = 0, unfinished = 0;
    depth_ = 0;
    most_ = 0;
    for (int p = 0; p < order_.nodes(); ++p) {
      const int count = order_.count(p), n = 3 * (count + 1);
      std::uint32_t of_children = 0;
      for (int c = 0; c < order_.children(p); ++c) of_children += triangle(3 * order_.count(pending_[at(--depth_)]));
      const std::uint32_t front = in_place(p) ? 0 : triangle(n);
      const std::uint32_t all = finished + unfinished + front + 3U * static_cast<std::uint32_t>(n + 1);
      if (all > most_) most_ = all;
      finished += 3U * static_cast<std::uint32_t>(n);
      unfinished = unfinished - of_children + triangle(3 * count);
      if (count > 0) pending_[at(depth_++)] = static_cast<Index>(p);
    }
    return most_ <= kBlocks * 9U;
  }

  int start_front() {
    const int p = position_, count = order_.count(p), children = order_.children(p);
    columns_ = 3 * (count + 1);
    local_[at(p)] = 0;
    for (int k = 0; k < count; ++k) local_[at(order_.entry(p, k))] = static_cast<Index>(k + 1);
    child_ = low_;
    above_ = low_;
    for (int c = 0; c < children; ++c) above_ += triangle(3 * order_.count(pending_[at(depth_ - 1 - c)]));
    children_left_ = children;
    int cost = columns_ + children;
    if (in_place(p)) {
      front_ = low_;
      child_ += triangle(columns_);
      --children_left_;
      --depth_;
    } else {
      front_ = low_ - triangle(columns_);
      for (std::uint32_t i = front_; i < low_; ++i) memory_.arena[i] = Scalar{0};
      cost += static_cast<int>(low_ - front_) / 4;
    }
    panel_ = front_ - 3U * static_cast<std::uint32_t>(columns_ + 1);
    child_row_ = 0;
    phase_ = Phase::kChildren;
    return cost;
  }

  /// Three rows of a child's front.
  int insert_child() {
    if (children_left_ == 0) {
      phase_ = Phase::kMeasurements;
      return 1;
    }
    const int child = pending_[at(depth_ - 1)], blocks = order_.count(child), left = 3 * (blocks - child_row_);
    const Scalar* const row = memory_.arena.data() + child_;
    int cost = left;
    if (held(row, left) > 0) {
      const int first = local_[at(order_.entry(child, child_row_))];
      const bool empty = held(first) == 0;
      clear_panel(first);
      const Scalar* from = row;
      for (int r = 0; r < 3; ++r) {
        Scalar* const to = empty ? front_row(3 * first + r) : panel_row(r);
        for (int k = child_row_; k < blocks; ++k) {
          const int column = 3 * local_[at(order_.entry(child, k))], skip = k == child_row_ ? r : 0;
          for (int i = skip; i < 3; ++i) to[column + i] = *from++;
        }
        to[columns_] = *from++;
      }
      if (!empty) cost += rotate_panel(first);
    }
    child_ += 3U * static_cast<std::uint32_t>(left);
    if (++child_row_ == blocks) {
      child_row_ = 0;
      --children_left_;
      --depth_;
    }
    return cost;
  }

  template <class Source>
  int insert_measurement(const Source& source) {
    const int node = order_.node(position_), row = first_row_[at(node)];
    if (row == kNone) {
      phase_ = Phase::kEnd;
      return 1;
    }
    first_row_[at(node)] = next_row_[at(row)];
    BlockRow<Scalar> block;
    const auto nodes = source.linearise(row, block);
    clear_panel(0);
    for (int side = 0; side < 2; ++side) {
      const int to = side == 0 ? nodes.first : nodes.second;
      if (to == kFixed) continue;
      const int column = 3 * local_[at(order_.position(to))];
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t i = 0; i < 3; ++i)
          panel_row(static_cast<int>(r))[column + static_cast<int>(i)] =
              side == 0 ? block.of_first[r][i] : block.of_second[r][i];
    }
    for (std::size_t r = 0; r < 3; ++r) panel_row(static_cast<int>(r))[columns_] = block.rest[r];
    return 3 * columns_ + rotate_panel(0);
  }

  /// The front's first three rows are rows of R; what is left moves up to where the children's fronts were.
  int end_front() {
    const int count = order_.count(position_);
    Scalar* const arena = memory_.arena.data();
    const std::uint32_t rows = 3U * static_cast<std::uint32_t>(columns_);
    const Scalar* const row = arena + front_;
    if (held(row, columns_) < 3) singular_ = true;
    for (const int i : {columns_, 2 * columns_, 3 * columns_ - 1}) decrease_ += row[i] * row[i];
    for (std::uint32_t i = 0; i < rows; ++i) arena[finished_ + i] = arena[front_ + i];
    finished_ += rows;
    const std::uint32_t rest = triangle(3 * count);
    if (above_ != front_ + rows + rest)
      for (std::uint32_t i = rest; i > 0; --i) arena[above_ - rest + i - 1] = arena[front_ + rows + i - 1];
    low_ = above_ - rest;
    if (count > 0) pending_[at(depth_++)] = static_cast<Index>(position_);
    ++position_;
    phase_ = Phase::kStart;
    return columns_ + static_cast<int>(rest) / 4;
  }

  /// Indexed by column, from column r on.
  [[nodiscard]] Scalar* front_row(int r) {
    return memory_.arena.data() + front_ + r * (columns_ + 1) - r * (r - 1) / 2 - r;
  }
  [[nodiscard]] Scalar* panel_row(int r) { return memory_.arena.data() + panel_ + r * (columns_ + 1); }
  /// Number of three rows that have a pivot. `row` is the first of them, and has n columns.
  [[nodiscard]] static int held(const Scalar* row, int n) {
    int pivots = 0;
    for (const int i : {0, n + 1, 2 * n + 1}) pivots += row[i] > Scalar{0} || row[i] < Scalar{0} ? 1 : 0;
    return pivots;
  }
  [[nodiscard]] int held(int block) { return held(front_row(3 * block) + 3 * block, columns_ - 3 * block); }
  void clear_panel(int block) {
    for (int r = 0; r < 3; ++r)
      for (int c = 3 * block; c <= columns_; ++c) panel_row(r)[c] = Scalar{0};
  }

  /// Rotates the panel's rows into the front from a block on; the cost.
  int rotate_panel(int block) {
    int cost = 0;
    for (; 3 * block < columns_; ++block) {
      const bool empty = held(block) == 0;
      for (int c = 3 * block; c < 3 * block + 3; ++c) reflect(c);
      cost += 3 * (columns_ - 3 * block);
      if (empty && held(block) == 3) break;  // the three rows came to stay
    }
    return cost;
  }
  /// One reflection of a front row and the three rows of the panel, so that the panel's column c is zero.
  void reflect(int c) {
    Scalar* const f = front_row(c);
    Scalar* const a = panel_row(0);
    Scalar* const b = panel_row(1);
    Scalar* const d = panel_row(2);
    const Scalar below = a[c] * a[c] + b[c] * b[c] + d[c] * d[c];
    if (!(below > kNothing)) return;
    const Scalar norm = base::sqrt(f[c] * f[c] + below);
    const Scalar pivot = f[c] > Scalar{0} ? -norm : norm;
    const Scalar scale = Scalar{1} / (f[c] - pivot), tau = (pivot - f[c]) / pivot;
    const Scalar va = a[c] * scale, vb = b[c] * scale, vd = d[c] * scale;
    f[c] = pivot;
    for (int k = c + 1; k <= columns_; ++k) {
      const Scalar s = tau * (f[k] + va * a[k] + vb * b[k] + vd * d[k]);
      f[k] -= s;
      a[k] -= va * s;
      b[k] -= vb * s;
      d[k] -= vd * s;
    }
  }

  EliminationOrder<kNodes, kBlocks> order_;
  Memory memory_;
  int cost_of_order_ = 0;
  int position_ = 0;
  Phase phase_ = Phase::kStart;
  bool singular_ = false;
  int depth_ = 0;          ///< entries of pending_ in use
  int columns_ = 0;        ///< columns of the front, without the right-hand side
  int children_left_ = 0;  ///< children whose fronts were not taken in yet
  int child_row_ = 0;      ///< the next block row of the child at hand
  std::uint32_t finished_ = 0, top_ = 0, low_ = 0, front_ = 0, panel_ = 0, child_ = 0, above_ = 0, most_ = 0;
  Scalar decrease_ = 0;
  std::array<Index, kNodes> local_{}, pending_{}, first_row_{};
  std::array<Index, kRows> next_row_{};
  std::array<Scalar, static_cast<std::size_t>(kNodes) * 3> correction_{};
};

}  // namespace tetap::slam
