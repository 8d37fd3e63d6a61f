#include "esim/stats/numerics/probability.h"

#include <gtest/gtest.h>

#include <cmath>

namespace esim {
namespace {

TEST(Probability, ChiSquaredTablesAndClosedForm) {
  EXPECT_NEAR(chi2_tail(3.841458820694124, 1), 0.05, 1e-12);
  EXPECT_NEAR(chi2_tail(82.52872654147371, 63), 0.05, 1e-9);
  for (const double chi2 : {0.1, 1.0, 5.0, 40.0, 300.0}) {
    EXPECT_NEAR(chi2_tail(chi2, 2) / std::exp(-chi2 / 2), 1.0, 1e-11) << chi2;
  }
  EXPECT_EQ(chi2_tail(0, 63), 1.0);
  EXPECT_EQ(chi2_tail(1e6, 63), 0.0);
}

TEST(Probability, PoissonTailIsTheSumOfItsTerms) {
  for (const double lambda : {0.01, 0.7, 3.0, 42.0, 300.0}) {
    for (const int count : {1, 2, 5, 40, 200, 350}) {
      double sum = 0;
      for (int k = count; k < count + 2000; ++k) sum += std::exp(k * std::log(lambda) - lambda - std::lgamma(k + 1));
      EXPECT_NEAR(poisson_tail(count, lambda), sum, 1e-11 + 1e-9 * sum) << lambda << " " << count;
    }
  }
  EXPECT_EQ(poisson_tail(0, 3.0), 1.0);
  EXPECT_EQ(poisson_tail(4, 0.0), 0.0);
}

TEST(Probability, BothPartsMakeOne) {
  for (double a = 0.5; a < 1e7; a *= 3.7) {
    for (const double factor : {0.2, 0.9, 1.0, 1.1, 3.0}) {
      EXPECT_NEAR(gamma_p(a, factor * a) + gamma_q(a, factor * a), 1.0, 1e-12);
    }
    EXPECT_NEAR(gamma_p(a, a), 0.5, 0.2 / std::sqrt(a));  // the median of a gamma variable is near its mean
  }
}

}  // namespace
}  // namespace esim
