#pragma once

namespace esim::inline stats {

/// Regularised incomplete gamma functions P(a, x) and Q(a, x) = 1 - P(a, x), each without cancellation; a > 0, x >= 0.
/// Series below x = a + 1, Lentz's continued fraction above. Relative error below 1e-9 for a up to 1e5.
double gamma_p(double a, double x);
double gamma_q(double a, double x);

/// Probability of a chi-squared variable with `dof` degrees of freedom to be at least `chi2`: Q(dof / 2, chi2 / 2).
double chi2_tail(double chi2, double dof);

/// Probability of a Poisson variable with mean `lambda` to be at least `count`: P(count, lambda); 1 for count 0.
double poisson_tail(double count, double lambda);

}  // namespace esim::inline stats
