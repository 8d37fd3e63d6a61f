#include "esim/stats/numerics/probability.h"

#include <cmath>
#include <limits>

namespace esim::inline stats {
namespace {

constexpr double kEpsilon = 1e-15;

// x^a e^-x / Gamma(a); uses lgamma_r, because std::lgamma writes to a global variable.
double leading_factor(double a, double x) {
  int sign = 0;
  return std::exp(a * std::log(x) - x - ::lgamma_r(a, &sign));
}

// P(a, x) = x^a e^-x / Gamma(a) * sum over n of x^n / (a (a+1) ... (a+n))
double series(double a, double x) {
  double term = 1.0 / a, sum = term;
  for (double n = a + 1.0; term > kEpsilon * sum; n += 1.0) {
    term *= x / n;
    sum += term;
  }
  return sum * leading_factor(a, x);
}

// Q(a, x) = x^a e^-x / Gamma(a) * 1/(x+1-a- 1(1-a)/(x+3-a- 2(2-a)/(x+5-a- ...)))
double continued_fraction(double a, double x) {
  constexpr double kTiny = std::numeric_limits<double>::min() / kEpsilon;
  double b = x + 1.0 - a, c = 1.0 / kTiny, d = 1.0 / b, fraction = d;
  for (double n = 1.0; n < 1e7; n += 1.0) {
    const double numerator = -n * (n - a);
    b += 2.0;
    d = numerator * d + b;
    if (std::abs(d) < kTiny) d = kTiny;
    c = b + numerator / c;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1.0 / d;
    fraction *= d * c;
    if (std::abs(d * c - 1.0) < kEpsilon) break;
  }
  return fraction * leading_factor(a, x);
}

}  // namespace

double gamma_p(double a, double x) {
  if (x <= 0.0) return 0.0;
  return x < a + 1.0 ? series(a, x) : 1.0 - continued_fraction(a, x);
}

double gamma_q(double a, double x) {
  if (x <= 0.0) return 1.0;
  return x < a + 1.0 ? 1.0 - series(a, x) : continued_fraction(a, x);
}

double chi2_tail(double chi2, double dof) { return gamma_q(0.5 * dof, 0.5 * chi2); }

double poisson_tail(double count, double lambda) { return count <= 0.0 ? 1.0 : gamma_p(count, lambda); }

}  // namespace esim::inline stats
