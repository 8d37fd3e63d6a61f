#include "esim/evaluate/realism/real_recordings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <span>

#include "esim/compare/same_scene.h"
#include "esim/core/error.h"
#include "esim/files/codecs/image_codecs.h"
#include "esim/files/input_file.h"
#include "esim/files/npy_header.h"
#include "esim/files/number_text.h"
#include "esim/formats/events_file.h"

namespace esim::inline evaluate {
namespace {

namespace fs = std::filesystem;

constexpr double kReach = 2;  // of the interpolation, px
constexpr const char* kPositive = "noise_pos_";
constexpr std::uint64_t kMostNumbers = 1U << 28;

struct Array {
  std::vector<std::uint64_t> shape;
  std::vector<double> values;  // in C order
};

Array read_doubles(const fs::path& path) {
  InputFile file(path);
  const auto fail = [&](const std::string& problem) { throw UserError(path.string() + ": " + problem); };
  const npy::Header header = npy::read_header([&](std::span<std::byte> out) { return file.read_into(out); }, fail);
  if (header.descr.text != "<f8" || header.fortran_order) fail("must hold float64 in C order");
  std::uint64_t count = 1;
  for (const std::uint64_t size : header.shape) {
    if (size == 0 || size > kMostNumbers / count) fail("its shape is not supported");
    count *= size;
  }
  Array array{header.shape, std::vector<double>(count)};
  if (file.read_into(std::as_writable_bytes(std::span(array.values))) != 8 * count)
    fail("it ends before its last number");
  return array;
}

/// The index of what a mirror at both ends shows at i.
int mirrored(int i, int size) {
  const int period = 2 * size, at = (i % period + period) % period;
  return at < size ? at : period - 1 - at;
}

/// Catmull and Rom's cubic, whose third-order accuracy keeps moving textures free of steps.
double cubic_value(const Image<float>& image, double x, double y) {
  const double left = std::floor(x), top = std::floor(y);
  const auto weights = [](double u) {
    return std::array{((-0.5 * u + 1) * u - 0.5) * u, (1.5 * u - 2.5) * u * u + 1, ((-1.5 * u + 2) * u + 0.5) * u,
                      (0.5 * u - 0.5) * u * u};
  };
  const auto wx = weights(x - left), wy = weights(y - top);
  double sum = 0;
  for (int j = 0; j < 4; ++j) {
    const int v = mirrored(static_cast<int>(top) + j - 1, image.height());
    for (int i = 0; i < 4; ++i) {
      const int u = mirrored(static_cast<int>(left) + i - 1, image.width());
      sum += wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)] * static_cast<double>(image(u, v));
    }
  }
  return sum;
}

RealNoise::Polarity read_polarity(const fs::path& path, RealNoise& noise) {
  constexpr std::size_t kNumbers = 72, kRates = 71;
  const Array array = read_doubles(path);
  if (array.shape.size() != 3 || array.shape[2] != kNumbers || array.shape[0] > 4096 || array.shape[1] > 4096)
    throw UserError(path.string() + ": its shape must be (rows, columns, 72)");
  noise.height = static_cast<int>(array.shape[0]), noise.width = static_cast<int>(array.shape[1]);
  RealNoise::Polarity polarity;
  for (int decade = -3; decade <= 4; ++decade) {
    for (int digit = 1; digit <= 9; ++digit) polarity.rates_hz.push_back(digit * std::pow(10.0, decade));
  }
  polarity.rates_hz.erase(polarity.rates_hz.begin());  // the number k counts the rates below the limit k + 1
  std::vector<double> sums(kRates);
  for (std::size_t i = 0; i < array.values.size(); i += kNumbers) {
    polarity.counts.add(static_cast<std::uint64_t>(std::max(0.0, array.values[i + kRates - 1])));
    for (std::size_t k = 0; k < kRates; ++k) sums[k] += array.values[i + k];
  }
  for (const double sum : sums) polarity.fraction.push_back(sums.back() > 0 ? sum / sums.back() : 0);
  return polarity;
}

std::optional<fs::path> only_png(const fs::path& folder) {
  std::optional<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".png") continue;
    if (found) throw UserError(folder.string() + ": must contain one PNG file only");
    found = entry.path();
  }
  return found;
}

/// Time stamps in whole us as text of seconds are often off by a few ns, from arithmetic on doubles.
void repair_microseconds(std::vector<Event>& events) {
  constexpr TimeNs kRounding = 10;
  const auto rounded = [](TimeNs t) { return (t + kNsPerUs / 2) / kNsPerUs * kNsPerUs; };
  const bool whole = std::all_of(events.begin(), events.end(),
                                 [&](const Event& event) { return std::abs(rounded(event.t) - event.t) <= kRounding; });
  if (!whole) return;
  for (Event& event : events) event.t = rounded(event.t);
}

}  // namespace

Image<float> RealClip::image_at(double s) const {
  const double part = (start_s + s) / complete_s - 0.5;
  Image<float> image(frame.scene.width(), frame.scene.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double value = cubic_value(frame.scene, x - part * static_cast<double>(flow_x(x, y)),
                                       y - part * static_cast<double>(flow_y(x, y)));
      image(x, y) = static_cast<float>(std::clamp(value * static_cast<double>(frame.vignetting(x, y)), 0.0, 1.0));
    }
  }
  return image;
}

RealClip::Region RealClip::region_inside() const {
  const auto sees_inside = [&](int x, int y) {
    const auto is_inside = [&](double part) {
      const double u = x - part * static_cast<double>(flow_x(x, y)), v = y - part * static_cast<double>(flow_y(x, y));
      return u >= kReach && u <= frame.scene.width() - 1 - kReach && v >= kReach &&
             v <= frame.scene.height() - 1 - kReach;
    };
    return is_inside(-0.5) && is_inside(0.5);
  };
  int left = 0, right = frame.scene.width() - 1, top = 0, bottom = frame.scene.height() - 1;
  const auto column_sees = [&](int x) {
    for (int y = top; y <= bottom; ++y)
      if (!sees_inside(x, y)) return false;
    return true;
  };
  const auto row_sees = [&](int y) {
    for (int x = left; x <= right; ++x)
      if (!sees_inside(x, y)) return false;
    return true;
  };
  for (bool changed = true; changed && left <= right && top <= bottom;) {
    changed = false;
    if (!column_sees(left)) ++left, changed = true;
    if (!column_sees(right)) --right, changed = true;
    if (!row_sees(top)) ++top, changed = true;
    if (!row_sees(bottom)) --bottom, changed = true;
  }
  if (left > right || top > bottom)
    throw UserError(name + ": every pixel sees the outside of the frame; the recording moves too far");
  return {left, top, right - left + 1, bottom - top + 1};
}

RealClip RealClip::part(double from, double to) const {
  RealClip clip = *this;
  clip.start_s += from * duration_s, clip.duration_s *= to - from;
  const TimeNs first = to_ns(from * duration_s), last = to_ns(to * duration_s);
  clip.events.clear();
  if (frames) clip.frames = frames->since(first);
  for (const Event& event : events_within(events, {first, last}))
    clip.events.push_back({event.t - first, event.x, event.y, event.polarity});
  return clip;
}

RealClip read_real_clip(const fs::path& folder) {
  RealClip clip;
  clip.name = folder.filename().string();
  const Array flow = read_doubles(folder / "flow.npy");
  if (flow.shape.size() != 4 || flow.shape[0] != 1 || flow.shape[1] != 2 || flow.shape[2] > 4096 ||
      flow.shape[3] > 4096)
    throw UserError((folder / "flow.npy").string() + ": its shape must be (1, 2, height, width)");
  const auto height = static_cast<int>(flow.shape[2]), width = static_cast<int>(flow.shape[3]);
  clip.flow_x = Image<float>(width, height), clip.flow_y = Image<float>(width, height);
  const std::size_t pixels = clip.flow_x.pixels().size();
  for (std::size_t i = 0; i < pixels; ++i) {
    clip.flow_x.pixels()[i] = static_cast<float>(flow.values[i]);
    clip.flow_y.pixels()[i] = static_cast<float>(flow.values[pixels + i]);
  }
  const std::optional<fs::path> png = only_png(folder);
  if (!png) throw UserError(folder.string() + ": contains no PNG file");
  clip.frame = read_real_frame(*png, width, height);
  EventsFile file(folder / "events.txt", {SensorSize{width, height}, {}});
  std::vector<Event> events;
  while (file.read(events, std::size_t{1} << 20)) clip.events.insert(clip.events.end(), events.begin(), events.end());
  if (clip.events.size() < 2 || clip.events.front().t == clip.events.back().t)
    throw UserError((folder / "events.txt").string() + ": holds no span of time");
  repair_microseconds(clip.events);
  const TimeNs start = clip.events.front().t;
  for (Event& event : clip.events) event.t -= start;
  clip.duration_s = clip.complete_s = to_seconds(clip.events.back().t);
  clip.frames = find_frames(clip.events);
  return clip;
}

RealNoise read_real_noise(const fs::path& positive) {
  const std::string name = positive.stem().string();
  RealNoise noise;
  noise.name = name;
  const std::size_t at = name.find(kPositive);
  std::string_view level = name;
  if (at == std::string::npos || !level.ends_with("lux") ||
      !parse_number(level.substr(at + 10, level.size() - at - 13), noise.lux)) {
    throw UserError(positive.string() + ": must be called noise_pos_NUMBERlux.npy");
  }
  noise.name.replace(at, 10, "noise_");
  std::string other = positive.filename().string();
  other.replace(at, 10, "noise_neg_");
  noise.on = read_polarity(positive, noise);
  noise.off = read_polarity(positive.parent_path() / other, noise);
  return noise;
}

RealRecordings read_real_recordings(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw UserError(folder.string() + ": is not a folder");
  std::vector<fs::path> folders{folder}, files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory()) folders.push_back(entry.path());
    if (entry.path().extension() == ".npy" && entry.path().filename().string().find(kPositive) != std::string::npos)
      files.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end()), std::sort(files.begin(), files.end());
  RealRecordings recordings;
  for (const fs::path& each : folders) {
    if (fs::exists(each / "events.txt") && fs::exists(each / "flow.npy"))
      recordings.clips.push_back(read_real_clip(each));
  }
  for (const fs::path& file : files) recordings.noise.push_back(read_real_noise(file));
  if (recordings.clips.empty() && recordings.noise.empty()) {
    throw UserError(folder.string() +
                    ": contains neither folders with events.txt and flow.npy nor files noise_pos_NUMBERlux.npy");
  }
  return recordings;
}

}  // namespace esim::inline evaluate
