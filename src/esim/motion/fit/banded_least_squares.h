#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cassert>
#include <cstddef>
#include <span>
#include <vector>

#include "esim/core/error.h"

namespace esim::inline motion {

/// Least squares min_x Σ_k weight_k |residual_k + Σ_j jacobian_kj x_(first_k + j)|² over unknowns that come in blocks
/// of `BlockSize`, where each residual depends on `reach` neighbouring blocks only, so that the normal equations are
/// banded. The problem may have several right sides (`Columns`), with one solution each.
template <int BlockSize, int Columns>
class BandedLeastSquares {
 public:
  using Block = Eigen::Matrix<double, BlockSize, BlockSize>;
  using Value = Eigen::Matrix<double, BlockSize, Columns>;
  using Solution = Eigen::Matrix<double, Eigen::Dynamic, Columns>;  // the blocks stacked

  BandedLeastSquares(int blocks, int reach)
      : blocks_(blocks),
        reach_(reach),
        lower_(static_cast<std::size_t>(blocks) * static_cast<std::size_t>(reach), Block::Zero()),
        right_(Solution::Zero(Eigen::Index{blocks} * BlockSize, Columns)) {}

  /// Adds one residual; its Jacobians belong to the blocks first, first + 1, …
  void add(int first, std::span<const Block> jacobians, const Value& residual, double weight) {
    const int count = static_cast<int>(jacobians.size());
    assert(first >= 0 && first + count <= blocks_ && count <= reach_);
    for (int i = 0; i < count; ++i) {
      const Block weighted = weight * jacobians[i].transpose();
      right_.template middleRows<BlockSize>(Eigen::Index{first + i} * BlockSize) -= weighted * residual;
      for (int j = 0; j <= i; ++j) lower_[index(first + i, i - j)] += weighted * jacobians[j];
    }
  }

  /// The minimiser. Throws UserError if it is not unique to numerical precision.
  Solution solve() const {
    using Matrix = Eigen::SparseMatrix<double>;
    const int unknowns = blocks_ * BlockSize;
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(lower_.size() * BlockSize * BlockSize);
    for (int i = 0; i < blocks_; ++i) {
      for (int offset = 0; offset < reach_ && offset <= i; ++offset) add_entries(i, offset, entries);
    }
    Matrix normal(unknowns, unknowns);
    normal.setFromTriplets(entries.begin(), entries.end());

    // The factor of a banded matrix has the same band, so the unknowns keep their natural order.
    const Eigen::SimplicialLDLT<Matrix, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(normal);
    if (factor.info() != Eigen::Success || !well_determined(factor.vectorD(), normal.diagonal())) {
      throw UserError(
          "trajectory fit: the poses leave a control point undetermined; increase the knot interval or "
          "the smoothing time");
    }
    return factor.solve(right_);
  }

  /// The decrease of the sum of squares from zero to the minimiser x: |Jx|² for the Jacobian J.
  double predicted_decrease(const Solution& x) const { return right_.cwiseProduct(x).sum(); }

 private:
  std::size_t index(int row, int offset) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(reach_) + static_cast<std::size_t>(offset);
  }

  void add_entries(int row, int offset, std::vector<Eigen::Triplet<double>>& entries) const {
    const Block& block = lower_[index(row, offset)];
    for (int r = 0; r < BlockSize; ++r) {
      for (int c = 0; c < (offset == 0 ? r + 1 : BlockSize); ++c) {
        entries.emplace_back(row * BlockSize + r, (row - offset) * BlockSize + c, block(r, c));
      }
    }
  }

  /// If elimination has reduced a pivot to rounding errors, its unknown depends on the others.
  static bool well_determined(const Eigen::VectorXd& pivots, const Eigen::VectorXd& diagonal) {
    return (pivots.array() > 1e-14 * diagonal.array()).all();
  }

  int blocks_;
  int reach_;
  std::vector<Block> lower_;  // block (i, i − offset) at i · reach + offset
  Solution right_;
};

}  // namespace esim::inline motion
