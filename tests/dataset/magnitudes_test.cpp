#include "esim/dataset/generators/magnitudes.h"

#include <gtest/gtest.h>

#include <fstream>
#include <numeric>

#include "esim/core/error.h"
#include "support/errors.h"
#include "support/temporary_directory.h"

namespace esim {
namespace {

TEST(Magnitudes, OfSintelHaveThePublishedShares) {
  const MagnitudeHistogram sintel = sintel_magnitudes();
  ASSERT_EQ(sintel.edges.size(), sintel.fractions.size() + 1);
  EXPECT_NEAR(std::accumulate(sintel.fractions.begin(), sintel.fractions.end(), 0.0), 1, 1e-12);
  double below_10 = 0, below_40 = 0;
  for (std::size_t i = 0; i < sintel.bins(); ++i) {
    EXPECT_GT(sintel.edges[i + 1], sintel.edges[i]);
    if (sintel.edges[i + 1] <= 10.001) below_10 += sintel.fractions[i];
    if (sintel.edges[i + 1] <= 40.001) below_40 += sintel.fractions[i];
  }
  EXPECT_NEAR(below_10, 0.593, 5e-4);
  EXPECT_NEAR(below_40, 0.881, 5e-4);
}

TEST(Magnitudes, QuantilesAreTheInverseOfBins) {
  const MagnitudeHistogram histogram{{0, 1, 4, 10}, {0.5, 0, 0.5}, ""};
  EXPECT_NEAR(histogram.quantile(0.25), 0.5, 1e-12);
  EXPECT_NEAR(histogram.quantile(0.75), 7, 1e-12);
  EXPECT_EQ(histogram.quantile(0), 0);
  EXPECT_LE(histogram.quantile(1 - 1e-16), 10);
  EXPECT_EQ(histogram.bin_of(0), 0U);
  EXPECT_EQ(histogram.bin_of(1), 1U);
  EXPECT_EQ(histogram.bin_of(9.9), 2U);
  EXPECT_EQ(histogram.bin_of(10), 3U) << "beyond";
  EXPECT_EQ(histogram.scaled(2).edges.back(), 20);
}

class MagnitudeFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    const std::filesystem::path path = folder_.path() / "histogram.txt";
    std::ofstream(path) << text;
    return path;
  }
  std::string problem(const std::string& text) {
    return test::message_of<UserError>([&] { read_magnitudes(write(text)); });
  }
  test::TemporaryDirectory folder_;
};

TEST_F(MagnitudeFile, IsReadAndNormalised) {
  const MagnitudeHistogram read = read_magnitudes(write("# px\n0 1 3\n\n1 2.5 1  # the rest\n"));
  EXPECT_EQ(read.edges, (std::vector<double>{0, 1, 2.5}));
  EXPECT_EQ(read.fractions, (std::vector<double>{0.75, 0.25}));
}

TEST_F(MagnitudeFile, SaysWhatIsWrongAndWhere) {
  EXPECT_TRUE(test::contains(problem("0 1 3\n2 3 1\n"), "histogram.txt:2: LOW is 2 px, but must continue at 1"));
  EXPECT_TRUE(test::contains(problem("1 2 3\n"), "must continue at 0"));
  EXPECT_TRUE(test::contains(problem("0 1\n"), "three numbers"));
  EXPECT_TRUE(test::contains(problem("0 1 2 3\n"), "three numbers"));
  EXPECT_TRUE(test::contains(problem("0 x 2\n"), "three numbers"));
  EXPECT_TRUE(test::contains(problem("0 0 2\n"), "HIGH is 0 px"));
  EXPECT_TRUE(test::contains(problem("0 nan 2\n"), "three numbers"));
  EXPECT_TRUE(test::contains(problem("0 1 -2\n"), "WEIGHT is -2"));
  EXPECT_TRUE(test::contains(problem("0 1 0\n"), "a weight above 0"));
  EXPECT_TRUE(test::contains(problem(""), "a weight above 0"));
  EXPECT_TRUE(test::contains(test::message_of<UserError>([] { read_magnitudes("/nowhere"); }), "cannot be read"));
}

TEST(TotalVariation, IsTheShareThatIsElsewhere) {
  EXPECT_NEAR(total_variation({0.5, 0.5}, {0.5, 0.5}), 0, 1e-15);
  EXPECT_NEAR(total_variation({1, 0}, {0, 1}), 1, 1e-15);
  EXPECT_NEAR(total_variation({0.6, 0.4}, {0.5, 0.5}), 0.1, 1e-15);
}

}  // namespace
}  // namespace esim
