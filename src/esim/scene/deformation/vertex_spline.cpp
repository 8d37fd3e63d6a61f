#include "esim/scene/deformation/vertex_spline.h"

#include <algorithm>
#include <cmath>

#include "esim/core/error.h"

namespace esim::inline scene {
namespace {

/// A square matrix whose entries are 0 beyond two places from the diagonal, and which needs no pivots: those of the
/// interpolation by B-splines are totally positive (de Boor and Pinkus, 1977).
class BandMatrix {
 public:
  explicit BandMatrix(std::size_t size) : rows_(size) {}

  double& at(std::size_t row, std::size_t column) { return rows_[row][column + kBand - row]; }

  /// Replaces the matrix by its factors L - 1 and U.
  void factorise() {
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      for (std::size_t row = i + 1; row <= last_of(i); ++row) {
        const double factor = at(row, i) /= at(i, i);
        for (std::size_t column = i + 1; column <= last_of(i); ++column) at(row, column) -= factor * at(i, column);
      }
    }
  }

  /// Solves for several right-hand sides, which are the columns, and are replaced.
  void solve(std::vector<double>& sides, std::size_t columns) {
    const auto subtract = [&](std::size_t to, std::size_t from, double factor) {
      for (std::size_t k = 0; k < columns; ++k) sides[to * columns + k] -= factor * sides[from * columns + k];
    };
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      for (std::size_t row = i + 1; row <= last_of(i); ++row) subtract(row, i, at(row, i));
    }
    for (std::size_t i = rows_.size(); i-- > 0;) {
      for (std::size_t column = i + 1; column <= last_of(i); ++column) subtract(i, column, at(i, column));
      for (std::size_t k = 0; k < columns; ++k) sides[i * columns + k] /= at(i, i);
    }
  }

 private:
  static constexpr std::size_t kBand = 2;

  std::size_t last_of(std::size_t i) const { return std::min(i + kBand, rows_.size() - 1); }

  std::vector<std::array<double, 2 * kBand + 1>> rows_;
};

/// The knots of the splines through points at these times.
std::vector<double> knots_of(const std::vector<double>& times_s, std::size_t degree) {
  std::vector<double> knots(degree + 1, times_s.front());
  // All inner times but the second and the second last one; no inner knots for polynomials.
  for (std::size_t i = 2; i + 2 < times_s.size() && degree == VertexSpline::kMaxDegree; ++i)
    knots.push_back(times_s[i]);
  knots.insert(knots.end(), degree + 1, times_s.back());
  return knots;
}

}  // namespace

VertexSpline::VertexSpline(VertexFrames frames)
    : vertices_(frames.vertices_per_frame()),
      size_(frames.times_s.size()),
      degree_(std::min(kMaxDegree, size_ - 1)),
      knots_(knots_of(frames.times_s, degree_)),
      control_points_(std::move(frames.positions)) {
  interpolate(frames.times_s);
}

/// Cox and de Boor's recursion (de Boor, chapter X).
VertexSpline::Basis VertexSpline::basis_at(double t_s) const {
  const double t = std::clamp(t_s, start_s(), end_s());
  const auto last = knots_.begin() + static_cast<std::ptrdiff_t>(size_);  // the last interval includes its end
  const auto after = std::upper_bound(knots_.begin() + static_cast<std::ptrdiff_t>(degree_) + 1, last, t);
  const auto span = static_cast<std::size_t>(after - knots_.begin()) - 1;
  Basis basis{span - degree_};
  basis.values[0] = 1;
  for (std::size_t degree = 1; degree <= degree_; ++degree) {
    double carried = 0;
    for (std::size_t i = 0; i < degree; ++i) {
      const double end = knots_[span + 1 + i], begin = knots_[span + 1 + i - degree];
      const double part = basis.values[i] / (end - begin);
      basis.slopes[i] = static_cast<double>(degree) * part;
      basis.values[i] = carried + (end - t) * part;
      carried = (t - begin) * part;
    }
    basis.values[degree] = carried;
  }
  return basis;
}

VertexSpline::Place VertexSpline::place_at(double t_s) const {
  const Basis basis = basis_at(t_s);
  Place place{basis.first};
  double of_later = 0;
  for (std::size_t i = degree_; i-- > 0;) {
    of_later += basis.values[i + 1];
    place.steps[i] = static_cast<float>(std::min(of_later, 1.0));
    place.slopes[i] = static_cast<float>(basis.slopes[i]);
  }
  return place;
}

void VertexSpline::interpolate(const std::vector<double>& times_s) {
  BandMatrix matrix(size_);
  for (std::size_t row = 0; row < size_; ++row) {
    const Basis basis = basis_at(times_s[row]);
    for (std::size_t i = 0; i <= degree_; ++i) {
      if (basis.values[i] != 0) matrix.at(row, basis.first + i) = basis.values[i];
    }
  }
  matrix.factorise();

  // Columns are solved side by side, in 32 MiB at most.
  constexpr std::size_t kMaxColumns = 64, kMaxSides = std::size_t{1} << 22;
  const std::size_t at_once = std::clamp<std::size_t>(kMaxSides / size_, 1, kMaxColumns);
  constexpr double kMaxCoordinate = 1e12;
  const std::size_t all = 3 * vertices_;
  float* const numbers = control_points_.empty() ? nullptr : control_points_.front().data();
  std::vector<double> sides;
  for (std::size_t begin = 0; begin < all; begin += at_once) {
    const std::size_t columns = std::min(at_once, all - begin);
    sides.resize(size_ * columns);
    for (std::size_t row = 0; row < size_; ++row)
      std::copy_n(numbers + row * all + begin, columns, sides.begin() + static_cast<std::ptrdiff_t>(row * columns));
    matrix.solve(sides, columns);
    for (std::size_t row = 0; row < size_; ++row) {
      for (std::size_t k = 0; k < columns; ++k) {
        const double value = sides[row * columns + k];
        if (!(std::abs(value) <= kMaxCoordinate))
          throw UserError("its vertices move too far between two frames; export it with frames at equal steps of time");
        numbers[row * all + begin + k] = static_cast<float>(value);
      }
    }
  }
}

}  // namespace esim::inline scene
