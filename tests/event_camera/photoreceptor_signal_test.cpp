#include "esim/event_camera/circuit/photoreceptor_signal.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace esim {
namespace {

/// The circuit's equations by Runge-Kutta steps that are short compared with every time constant.
struct Slow {
  double y, v, w = 0;

  void run(const CircuitPoles& p, const LightRamp& ramp, double length) {
    const double fastest =
        std::min(p.t2_ns, p.t1_unit_ns * std::exp(-std::max({ramp.light, ramp.light + ramp.rate * length, y})));
    const auto count = static_cast<long>(std::ceil(length / (0.02 * fastest))) + 20;
    const double h = length / static_cast<double>(count);
    for (long i = 0; i < count; ++i) {
      const double s = h * static_cast<double>(i);
      const auto dy = [&](double at, double y_) {
        return (std::exp(ramp.light + ramp.rate * at) - std::exp(y_)) / p.t1_unit_ns;
      };
      const auto dv = [&](double y_, double v_) { return (y_ - v_) / p.t2_ns; };
      const auto dw = [&](double v_, double w_) { return (v_ - w_) * p.high_pass_per_ns; };
      const double a1 = dy(s, y), b1 = dv(y, v), c1 = dw(v, w);
      const double a2 = dy(s + h / 2, y + h / 2 * a1), b2 = dv(y + h / 2 * a1, v + h / 2 * b1),
                   c2 = dw(v + h / 2 * b1, w + h / 2 * c1);
      const double a3 = dy(s + h / 2, y + h / 2 * a2), b3 = dv(y + h / 2 * a2, v + h / 2 * b2),
                   c3 = dw(v + h / 2 * b2, w + h / 2 * c2);
      const double a4 = dy(s + h, y + h * a3), b4 = dv(y + h * a3, v + h * b3), c4 = dw(v + h * b3, w + h * c3);
      y += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
      v += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4);
      w += h / 6 * (c1 + 2 * c2 + 2 * c3 + c4);
    }
  }
};

/// Runs both over ramps; returns the largest differences of what the comparators see on the way.
double worst(const CircuitPoles& poles, const std::vector<double>& lights, double dt) {
  const double w = poles.high_pass_per_ns > 0 ? lights[0] : 0.0;
  CircuitState state{0, lights[0], w};
  Slow slow{lights[0], lights[0], w};
  double worst = 0;
  for (std::size_t i = 1; i < lights.size(); ++i) {
    const LightRamp ramp{lights[i - 1], (lights[i] - lights[i - 1]) / dt};
    for (double done = 0; done < 0.999999 * dt;) {
      const LightRamp part{ramp.light + ramp.rate * done, ramp.rate};
      const double h = step_length(poles, state, part, dt - done);
      done += h;
      const CircuitPiece piece = advance(poles, state, part, h);
      Slow middle = slow;
      middle.run(poles, part, h / 2);
      worst = std::max(worst, std::abs(piece.value(h / 2) - (middle.v - middle.w)));
      slow.run(poles, part, h);
      worst = std::max(worst, std::abs((state.v - state.w) - (slow.v - slow.w)));
      EXPECT_NEAR(std::log1p(state.lag), part.light + part.rate * h - slow.y, 1e-3);
    }
  }
  return worst;
}

TEST(PhotoreceptorSignal, FollowsTheCircuitsEquations) {
  for (const double t1 : {0.02e6, 0.3e6, 3e6, 50e6}) {
    for (const double t2 : {0.1e6, 0.8e6, 3e6}) {
      std::vector<double> lights;
      for (int i = 0; i < 60; ++i)
        lights.push_back(-0.5 + std::sin(0.3 * i) + (i > 30 ? 0.8 : 0));  // an edge of 800 per s: 0.5 us
      EXPECT_LT(worst({t1, t2}, lights, 1e6), 4e-4) << t1 << " " << t2;
      for (const double high_pass_hz : {0.1, 20.0, 150.0}) {
        const double k3 = 2e-9 * std::numbers::pi * high_pass_hz;
        if (k3 > 0.5 / t2) continue;
        EXPECT_LT(worst({t1, t2, k3}, lights, 1e6), 4e-4) << t1 << " " << t2 << " " << high_pass_hz;
      }
    }
  }
}

TEST(PhotoreceptorSignal, AStepOfLightFallsFasterThanItRises) {
  // The photodiode discharges with the new photocurrent: a rise is fast, a fall slow.
  const CircuitPoles poles{1e6, 0.01e6};
  CircuitState up{0, 0}, down{0, 0};
  const auto settle = [&](CircuitState& state, double change) {
    state.lag = std::expm1(change);  // y is still at 0
    for (int i = 0; i < 100; ++i) advance(poles, state, {change, 0}, 0.01e6);
    return state.v / change;
  };
  EXPECT_GT(settle(up, 1), 0.85);
  EXPECT_LT(settle(down, -1), 0.75);
}

TEST(PhotoreceptorSignal, ALongSegmentAfterAStepOfLightHasTheSameLatency) {
  // Time at which v has done a third of a step by 1, from samples after the step: exact steps, or one segment of 16 ms.
  for (const double t1 : {0.05e6, 0.3e6, 2e6}) {
    const CircuitPoles poles{t1, 0.2e6};
    Slow slow{-1, -1};
    double expected = 0;
    while (slow.v < -2.0 / 3) slow.run(poles, {0, 0}, 500), expected += 500;
    CircuitState state{std::expm1(1.0), -1};
    double time = -1;
    for (double done = 0; done < 16e6 && time < 0;) {
      const double h = step_length(poles, state, {0, 0}, 16e6 - done);
      const CircuitPiece piece = advance(poles, state, {0, 0}, h);
      if (piece.value(h) >= -2.0 / 3) {
        double a = 0, b = h;
        for (int i = 0; i < 50; ++i) (piece.value(0.5 * (a + b)) < -2.0 / 3 ? a : b) = 0.5 * (a + b);
        time = done + b;
      }
      done += h;
    }
    EXPECT_NEAR(time, expected, 0.003 * expected + 500) << t1;
  }
}

TEST(PhotoreceptorSignal, SteadyLightChangesNothing) {
  const CircuitPoles poles{1e6, 0.5e6};
  CircuitState state{0, -1.25};
  for (const double length : {1.0, 5e4, 1e6, 5e6}) {
    const CircuitPiece piece = advance(poles, state, {-1.25, 0}, length);
    EXPECT_EQ(state.v, -1.25);
    EXPECT_EQ(state.lag, 0);
    EXPECT_EQ(piece.value(0.3 * length), -1.25);
  }
}

TEST(PhotoreceptorSignal, DoesNotDependOnHowARampIsCut) {
  const CircuitPoles poles{2e6, 0.7e6};
  for (const double rate : {1e-6, 1e-7, -3e-7}) {
    std::vector<double> ends;
    for (const int cuts : {4, 20, 400}) {
      CircuitState state{0, 0.2};
      for (int i = 0; i < cuts; ++i) {
        const double dt = 20e6 / cuts;
        const LightRamp ramp{0.2 + rate * dt * i, rate};
        for (double done = 0; done < 0.999999 * dt;) {
          const LightRamp part{ramp.light + rate * done, rate};
          const double h = step_length(poles, state, part, dt - done);
          advance(poles, state, part, h);
          done += h;
        }
      }
      ends.push_back(state.v);
    }
    EXPECT_NEAR(ends[0], ends[2], std::abs(rate) * 300);  // 0.3 us
    EXPECT_NEAR(ends[1], ends[2], std::abs(rate) * 300);
  }
}

TEST(PhotoreceptorSignal, RangesContainEveryValue) {
  for (const double high_pass : {0.0, 3e-7}) {
    const CircuitPoles poles{1.3e6, 0.6e6, high_pass};
    for (const double lag : {-0.3, 0.0, 0.4}) {
      for (const double rate : {-1e-7, 0.0, 1e-7}) {
        CircuitState state{lag, 0.1, high_pass > 0 ? 0.05 : 0.0};
        const CircuitPiece piece = advance(poles, state, {0, rate}, 1e6);
        for (double a = 0; a < 0.9e6; a += 0.13e6) {
          for (double b = a + 1e3; b < 1e6; b += 0.17e6) {
            const auto [low, high] = piece.range(a, b);
            for (double s = a; s <= b; s += (b - a) / 50) {
              EXPECT_GE(piece.value(s), low - 1e-12);
              EXPECT_LE(piece.value(s), high + 1e-12);
            }
          }
        }
      }
    }
  }
}

TEST(PhotoreceptorSignal, MomentsAreIntegrals) {
  for (const double a : {0.0, 1e-6, 0.1, 1.0, 1.99, 2.01, 7.0, 300.0}) {
    const auto psi = exponential_moments(a);
    for (int k = 0; k < 4; ++k) {
      double sum = 0;
      constexpr int kCount = 200000;
      for (int i = 0; i < kCount; ++i) {
        const double x = (i + 0.5) / kCount;
        sum += std::pow(x, k) * std::exp(-a * (1 - x)) / kCount;
      }
      EXPECT_NEAR(psi[static_cast<std::size_t>(k)], sum, 1e-6 * sum) << a << " " << k;
    }
  }
}

}  // namespace
}  // namespace esim
