// Positions and labels of ticks, compared with a slow search over all steps, and their properties.
#include "esim/plot/ticks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "esim/core/error.h"
#include "esim/plot/scale.h"

namespace esim {
namespace {

struct Range {
  double low, high;
};

/// Ranges over more than 30 decades, of both signs, some narrow compared with their distance from 0.
std::vector<Range> ranges() {
  std::vector<Range> all = {{0, 1},
                            {-1, 1},
                            {0, 10},
                            {0.9, 3.1},
                            {1, 1.3},
                            {-5, -4.9},
                            {1e-3, 1e3},
                            {99, 101},
                            {-1e9, 1e9},
                            {0, 1e-18},
                            {-3e17, 0},
                            {0, 3},
                            {0.1, 0.3},
                            {1e6, 1e6 + 1},
                            {1.6e9, 1.6e9 + 0.05},
                            {-1.6e9 - 2, -1.6e9},
                            {0, 2.9999999},
                            {1 - 1e-9, 1 + 1e-9}};
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> exponent(-16, 16), unit(-1, 1), narrow(0, 8);
  for (int i = 0; i < 20000; ++i) {
    const double width = std::pow(10.0, exponent(random));
    const double low = unit(random) * width * std::pow(10.0, i % 3 == 0 ? narrow(random) : 0.0);
    all.push_back({low, low + width});
  }
  return all;
}

/// The mantissa of the number, 1 to 10.
double mantissa(double value) { return value / std::pow(10.0, std::floor(std::log10(value) + 1e-6)); }

bool is_one_two_or_five(double value) {
  const double m = mantissa(value);
  return std::abs(m - 1) < 1e-4 || std::abs(m - 2) < 1e-4 || std::abs(m - 5) < 1e-4;
}

/// Tries every step of 1, 2, 5 times a power of ten, and counts its multiples one after the other.
double reference_step(const Range& range, int wanted) {
  double coarsest_usable = 0;
  for (int exponent = -25; exponent < 25; ++exponent) {
    for (const int m : {1, 2, 5}) {
      const double step = m * std::pow(10.0, exponent);
      if ((range.high - range.low) / step > 20) continue;
      int count = 0;
      const double first = std::floor(range.low / step) - 1;
      for (int i = 0; i < 30; ++i) {
        const double tick = (first + i) * step;
        count += tick >= range.low - 1e-9 * step && tick <= range.high + 1e-9 * step ? 1 : 0;
      }
      if (count < 3) return coarsest_usable;
      if (count > 10) continue;
      coarsest_usable = step;
      if (count <= wanted) return step;
    }
  }
  return coarsest_usable;
}

double step_of(const Ticks& ticks) {
  return (ticks.major.back().value - ticks.major.front().value) / static_cast<double>(ticks.major.size() - 1);
}

TEST(LinearTicks, AreThreeToTenMultiplesOfARoundStepWithinTheRange) {
  for (const auto& [low, high] : ranges()) {
    for (const int wanted : {1, 3, 6, 10, 50}) {
      SCOPED_TRACE(testing::Message() << low << " to " << high << ", wanted " << wanted);
      const Ticks ticks = linear_ticks(low, high, wanted);
      ASSERT_GE(ticks.major.size(), 3U);
      ASSERT_LE(ticks.major.size(), 10U);
      ASSERT_TRUE(is_one_two_or_five(step_of(ticks))) << step_of(ticks);
      const double step = step_of(ticks);
      for (std::size_t i = 0; i < ticks.major.size(); ++i) {
        const double value = ticks.major[i].value;
        ASSERT_GE(value, low);
        ASSERT_LE(value, high);
        const double multiple = value / step;  // its rounding grows with its size
        ASSERT_NEAR(multiple, std::round(multiple), 1e-5 + 1e-7 * std::abs(multiple));
        if (i > 0) {
          ASSERT_NEAR(value - ticks.major[i - 1].value, step, 1e-4 * step);
        }
      }
      ASSERT_LT(ticks.major.front().value - low, step * (1 + 1e-6)) << "the first multiple is missing";
      ASSERT_LT(high - ticks.major.back().value, step * (1 + 1e-6)) << "the last multiple is missing";
    }
  }
}

TEST(LinearTicks, HaveTheStepThatASlowSearchFinds) {
  for (const auto& [low, high] : ranges()) {
    for (const int wanted : {3, 6, 10}) {
      const double step = reference_step({low, high}, wanted);
      ASSERT_NEAR(step_of(linear_ticks(low, high, wanted)) / step, 1, 1e-4)
          << low << " to " << high << ", wanted " << wanted;
    }
  }
}

/// The number that a reader understands: the label with the factor and the offset.
double read_label(const Ticks& ticks, const std::string& label) {
  const auto number = [](std::string text) {
    if (text.starts_with("−")) text.replace(0, std::string("−").size(), "-");
    return std::stod(text);
  };
  double factor = 1;
  if (!ticks.factor.empty()) {
    const std::vector<std::string> digits = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string rest = ticks.factor.substr(std::string("×10").size()), exponent;
    while (!rest.empty()) {
      if (rest.starts_with("⁻")) {
        exponent += '-';
        rest.erase(0, std::string("⁻").size());
      }
      for (std::size_t d = 0; d < digits.size(); ++d) {
        if (!rest.starts_with(digits[d])) continue;
        exponent += static_cast<char>('0' + d);
        rest.erase(0, digits[d].size());
        break;
      }
    }
    factor = std::pow(10.0, std::stoi(exponent));
  }
  return number(label) * factor + (ticks.offset.empty() ? 0.0 : number(ticks.offset));
}

TEST(LinearTicks, LabelsAreShortDistinctAndTrue) {
  for (const auto& [low, high] : ranges()) {
    const Ticks ticks = linear_ticks(low, high);
    std::set<std::string> labels;
    for (const Tick& tick : ticks.major) {
      SCOPED_TRACE(testing::Message() << low << " to " << high << ": " << tick.label << ticks.factor << ticks.offset);
      ASSERT_LE(tick.label.size(), 11U) << "nine characters; a minus sign has three bytes";
      ASSERT_TRUE(labels.insert(tick.label).second) << "two ticks have the same label";
      ASSERT_NEAR(read_label(ticks, tick.label), tick.value, 1e-6 * step_of(ticks) + 4e-16 * std::abs(tick.value));
    }
  }
}

TEST(LinearTicks, AreWhatOneWouldWrite) {
  const auto labels = [](const Ticks& ticks) {
    std::string text;
    for (const Tick& tick : ticks.major) text += (text.empty() ? "" : " ") + tick.label;
    return text + (ticks.factor.empty() ? "" : " | " + ticks.factor) +
           (ticks.offset.empty() ? "" : " | + " + ticks.offset);
  };
  EXPECT_EQ(labels(linear_ticks(0, 1)), "0.0 0.2 0.4 0.6 0.8 1.0");
  EXPECT_EQ(labels(linear_ticks(-1, 1, 5)), "−1.0 −0.5 0.0 0.5 1.0");
  EXPECT_EQ(labels(linear_ticks(-1, 1, 5, LabelStyle::magnitudes)), "1.0 0.5 0.0 0.5 1.0");
  EXPECT_EQ(labels(linear_ticks(0, 2.3e6)), "0.0 0.5 1.0 1.5 2.0 | ×10⁶");
  EXPECT_EQ(labels(linear_ticks(0, 2.3e-5)), "0 5 10 15 20 | ×10⁻⁶");
  EXPECT_EQ(labels(linear_ticks(1600000000.02, 1600000000.07)), "0.02 0.03 0.04 0.05 0.06 0.07 | + 1600000000");
  EXPECT_EQ(labels(linear_ticks(7, 7.004, 6, LabelStyle::full)), "7.000 7.001 7.002 7.003 7.004");
}

TEST(LinearTicks, RefuseWhatIsNotARange) {
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::nan("");
  for (const auto& [low, high] : {Range{1, 1},
                                  {2, 1},
                                  {0, nan},
                                  {nan, 1},
                                  {0, infinity},
                                  {-infinity, 0},
                                  {0, 0},
                                  {1, 1 + 1e-15},
                                  {0, 1e-300},
                                  {-1.7e308, 1.7e308}})
    EXPECT_THROW(linear_ticks(low, high), Error) << low << " to " << high;
  for (const auto& [low, high] : {Range{0, 1}, {-1, 1}, {2, 1}, {1, nan}, {1, infinity}})
    EXPECT_THROW(logarithmic_ticks(low, high), Error) << low << " to " << high;
}

TEST(LogarithmicTicks, AreThreeToTenWithinTheRange) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> exponent(-20, 20), decades(0.001, 30);
  for (int i = 0; i < 20000; ++i) {
    const double low = std::pow(10.0, exponent(random));
    const double high = low * std::pow(10.0, i % 2 == 0 ? decades(random) : 0.1 * decades(random));
    const int wanted = 1 + i % 12;
    SCOPED_TRACE(testing::Message() << low << " to " << high << ", wanted " << wanted);
    const Ticks ticks = logarithmic_ticks(low, high, wanted);
    ASSERT_GE(ticks.major.size(), 3U);
    ASSERT_LE(ticks.major.size(), 10U);
    std::set<double> major;
    std::set<std::string> labels;
    for (const Tick& tick : ticks.major) {
      ASSERT_GE(tick.value, low);
      ASSERT_LE(tick.value, high);
      ASSERT_TRUE(major.empty() || tick.value > *major.rbegin());
      major.insert(tick.value);
      ASSERT_TRUE(labels.insert(tick.label).second) << tick.label;
    }
    // Either 1, 2, 5 of each decade within the range, or every n-th power, or, in narrow ranges, even steps.
    if (std::all_of(major.begin(), major.end(), is_one_two_or_five)) {
      const double ratio = *std::next(major.begin()) / *major.begin();
      for (auto next = std::next(major.begin()); next != major.end(); ++next) {
        const double step = *next / *std::prev(next);
        if (ratio > 9) {
          ASSERT_NEAR(step / ratio, 1, 1e-6);
        } else {
          ASSERT_TRUE(std::abs(step - 2) < 1e-6 || std::abs(step - 2.5) < 1e-6) << step;
        }
      }
    } else {
      ASSERT_LT(high / low, 20);
      ASSERT_TRUE(is_one_two_or_five(step_of(ticks)));
    }
    for (const double value : ticks.minor) {
      ASSERT_GE(value, low);
      ASSERT_LE(value, high);
      ASSERT_EQ(major.count(value), 0U);
      ASSERT_NEAR(mantissa(value), std::round(mantissa(value)), 1e-6);
    }
  }
}

TEST(LogarithmicTicks, AreWhatOneWouldWrite) {
  const auto labels = [](const Ticks& ticks) {
    std::string text;
    for (const Tick& tick : ticks.major) text += (text.empty() ? "" : " ") + tick.label;
    return text;
  };
  EXPECT_EQ(labels(logarithmic_ticks(1, 100, 10)), "1 2 5 10 20 50 100");
  EXPECT_EQ(labels(logarithmic_ticks(0.1, 1000, 6)), "0.1 1 10 100 1000");
  EXPECT_EQ(labels(logarithmic_ticks(1e-5, 1e2, 10)), "10⁻⁵ 10⁻⁴ 10⁻³ 10⁻² 10⁻¹ 10⁰ 10¹ 10²");
  EXPECT_EQ(labels(logarithmic_ticks(1e-5, 1.1e-4, 6)), "10⁻⁵ 2×10⁻⁵ 5×10⁻⁵ 10⁻⁴");
  EXPECT_EQ(labels(logarithmic_ticks(1e-6, 1e2, 10, LabelStyle::seconds)),
            "1 µs 10 µs 100 µs 1 ms 10 ms 100 ms 1 s 10 s 100 s");
  EXPECT_EQ(labels(logarithmic_ticks(1e-12, 1e12, 6)), "10⁻¹⁰ 10⁻⁵ 10⁰ 10⁵ 10¹⁰");
  EXPECT_EQ(labels(logarithmic_ticks(3, 4, 6)), "3.0 3.2 3.4 3.6 3.8 4.0");
  const std::vector<double> minor = logarithmic_ticks(1, 100, 3).minor;
  EXPECT_EQ(minor, (std::vector<double>{2, 3, 4, 5, 6, 7, 8, 9, 20, 30, 40, 50, 60, 70, 80, 90}));
}

TEST(Scales, AreWidenedAroundASingleValue) {
  for (const double value : {0.0, 1.0, -3.5, 1e-15, -1e12, 1.6e9}) {
    for (const double next : {value, std::nextafter(value, 1e300)}) {
      const Scale scale = linear_scale(value, next, "");
      EXPECT_LT(scale.low, value);
      EXPECT_GT(scale.high, next);
      EXPECT_NEAR(scale.position(value), 0.5, 1e-6);
      EXPECT_GE(scale.ticks(6).major.size(), 3U);
    }
  }
  const Scale scale = logarithmic_scale(5, 5, "");
  EXPECT_NEAR(scale.position(5), 0.5, 1e-9);
  EXPECT_GE(scale.ticks(6).major.size(), 3U);
  EXPECT_EQ(linear_scale(3, 1, "").low, 1);
  EXPECT_LT(logarithmic_scale(1, 10, "").position(0), -1) << "0 is far below";
}

}  // namespace
}  // namespace esim
