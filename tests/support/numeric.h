#pragma once

#include <Eigen/Core>

namespace esim::test {

/// Derivative of a function of one variable by central differences of fourth order: the error is about
/// step⁴ |f⁽⁵⁾|/30 + 2e-16 |f|/step. The function returns a double or an Eigen matrix by value (no expression), and
/// must be smooth on [t − 2 step, t + 2 step].
template <typename Function>
auto numeric_derivative(const Function& f, double t, double step = 1e-3) {
  const auto far_below = f(t - 2.0 * step), below = f(t - step), above = f(t + step), far_above = f(t + 2.0 * step);
  using Value = decltype(f(t));
  return Value((8.0 * (above - below) - (far_above - far_below)) / (12.0 * step));
}

/// The matrix ∂f/∂x of a vector-valued function of a vector, by the same differences.
template <typename Function, typename Vector>
auto numeric_jacobian(const Function& f, const Vector& x, double step = 1e-3) {
  using Value = decltype(f(x));
  Eigen::Matrix<double, Value::RowsAtCompileTime, Vector::RowsAtCompileTime> jacobian(f(x).size(), x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const auto along_axis = [&](double offset) -> Value {
      Vector moved = x;
      moved[i] += offset;
      return f(moved);
    };
    jacobian.col(i) = numeric_derivative(along_axis, 0.0, step);
  }
  return jacobian;
}

/// Largest absolute difference of two matrices of the same shape; not a number where either holds one.
template <typename A, typename B>
double largest_difference(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return (a - b).cwiseAbs().template maxCoeff<Eigen::PropagateNaN>();
}

}  // namespace esim::test
