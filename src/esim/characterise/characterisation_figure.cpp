#include "esim/characterise/characterisation_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "esim/plot/axes.h"

namespace esim::inline characterise {
namespace {

constexpr int kWidth = 1600, kHeader = 16, kMargin = 16, kHeight = 1000;
constexpr std::array<Rgb, 2> kColours{Rgb{36, 84, 160}, Rgb{214, 96, 30}};

Tile cell(int column, int row) {
  constexpr int width = (kWidth - kMargin) / 2, height = (kHeight - kHeader) / 2;
  return {kMargin + column * width, kHeader + row * height, width - kMargin, height - kMargin};
}

std::vector<LegendEntry> legend_of(const std::vector<Characterisation>& sensors) {
  std::vector<LegendEntry> legend;
  for (std::size_t i = 0; i < sensors.size(); ++i) legend.push_back({sensors[i].name, kColours[i % kColours.size()]});
  return legend;
}

void draw_s_curves(Canvas& canvas, const std::vector<Characterisation>& sensors) {
  double reach = 0.1;
  const auto each = [&](const auto& draw) {
    for (std::size_t i = 0; i < sensors.size(); ++i) {
      if (sensors[i].levels.empty()) continue;
      const LightLevel& brightest = sensors[i].levels.back();
      for (const SCurve* curve : {&brightest.on, &brightest.off}) draw(*curve, kColours[i % kColours.size()]);
    }
  };
  each([&](const SCurve& curve, Rgb) {
    for (const double contrast : curve.contrasts) reach = std::max(reach, std::abs(contrast));
  });
  Axes axes(canvas, cell(0, 0), linear_scale(-reach, reach, "change of ln(light)"), linear_scale(0, 1, "responses"),
            {"S-curves in the brightest light: OFF, ON", legend_of(sensors)});
  each([&](const SCurve& curve, Rgb colour) {
    std::vector<DataPoint> points;
    for (std::size_t k = 0; k < curve.contrasts.size(); ++k) {
      points.push_back({curve.contrasts[k], curve.fractions[k]});
      axes.dot(points.back(), 3, colour);
    }
    axes.line(points, colour);
  });
  axes.finish();
}

/// A quantity by illuminance. Values that are not above 0 are left out.
void draw_by_light(Canvas& canvas, const Tile& place, const std::vector<Characterisation>& sensors,
                   const std::string& title, const std::string& quantity, LabelStyle style,
                   const std::vector<double (*)(const LightLevel&)>& values) {
  double low = std::numeric_limits<double>::infinity(), high = 0, dark = low, bright = 0;
  for (const Characterisation& sensor : sensors) {
    for (const LightLevel& level : sensor.levels) {
      dark = std::min(dark, level.lux), bright = std::max(bright, level.lux);
      for (const auto value : values) {
        if (value(level) > 0 && std::isfinite(value(level)))
          low = std::min(low, value(level)), high = std::max(high, value(level));
      }
    }
  }
  if (high == 0) low = 0.1, high = 1;
  Axes axes(canvas, place, logarithmic_scale(dark / 1.5, bright * 1.5, "illuminance of the sensor (lux)"),
            logarithmic_scale(low / 1.5, high * 1.5, quantity, style), {title, legend_of(sensors)});
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      std::vector<DataPoint> points;
      for (const LightLevel& level : sensors[i].levels) {
        const double value = values[k](level);
        if (!(value > 0) || !std::isfinite(value)) continue;
        points.push_back({level.lux, value});
        axes.dot(points.back(), 4, kColours[i % kColours.size()]);
      }
      axes.line(points, kColours[i % kColours.size()], k == 0 ? 2 : 1);
    }
  }
  axes.finish();
}

}  // namespace

Image<Rgb> draw_characterisation(const std::vector<Characterisation>& sensors) {
  Canvas canvas(kWidth, kHeight, kLightTheme.page);
  draw_s_curves(canvas, sensors);
  draw_by_light(canvas, cell(1, 0), sensors, "Latency of doubled light; thin: jitter", "time", LabelStyle::seconds,
                {[](const LightLevel& l) { return l.latency_s; }, [](const LightLevel& l) { return l.jitter_s; }});
  draw_by_light(canvas, cell(0, 1), sensors, "Bandwidth, -3 dB", "frequency (Hz)", LabelStyle::numbers,
                {[](const LightLevel& l) { return l.bandwidth_hz; }});
  draw_by_light(
      canvas, cell(1, 1), sensors, "Background rate of a pixel: ON; thin: OFF", "rate (Hz)", LabelStyle::numbers,
      {[](const LightLevel& l) { return l.noise_on_hz; }, [](const LightLevel& l) { return l.noise_off_hz; }});
  return std::move(canvas).take();
}

}  // namespace esim::inline characterise
