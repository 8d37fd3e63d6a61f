#include "esim/evaluate/realism/realism.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>

#include "esim/characterise/bench.h"
#include "esim/core/error.h"
#include "esim/core/parallel.h"
#include "esim/evaluate/realism/real_recordings.h"
#include "esim/event_camera/event_camera.h"
#include "esim/files/codecs/image_codecs.h"
#include "esim/files/output_file.h"
#include "esim/formats/events_file.h"

namespace esim::inline evaluate {
namespace {

namespace fs = std::filesystem;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A temporary folder that is removed at the end.
class Scratch {
 public:
  Scratch() {
    std::string name = (fs::temp_directory_path() / "esim-realism-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw UserError("cannot create a folder in " + name);
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// The times of the images, s after the start of the clip, from its history to its end.
std::vector<double> image_times(const RealClip& clip, const RealismOptions& options) {
  const auto steps_in = [](double s, double step_s) {
    return static_cast<std::int64_t>(std::floor(s / step_s + 1e-9));
  };
  std::vector<double> times;
  const double before_s = static_cast<double>(steps_in(options.before_s, options.frame_step_s)) * options.frame_step_s;
  for (std::int64_t k = steps_in(options.history_s - before_s, options.history_step_s); k > 0; --k)
    times.push_back(-before_s - static_cast<double>(k) * options.history_step_s);
  for (double s = -before_s; s < clip.duration_s + options.frame_step_s; s += options.frame_step_s) times.push_back(s);
  return times;
}

/// When the clip starts, s: so late that no time stamp of its history is negative.
double start_of_clip(const RealismOptions& options) { return std::ceil(options.history_s); }

/// Calls see(image, t) for the frames of a clip, from its history to its end.
template <typename See>
void for_each_frame(const RealClip& clip, const RealismOptions& options, const See& see) {
  for (const double s : image_times(clip, options)) see(clip.image_at(s), to_ns(start_of_clip(options) + s));
}

/// A sensor whose chip takes frames when that of the clip did, as far as this is known.
EventCameraOptions with_frames_of(const RealClip& clip, EventCameraOptions sensor, double first_image_s) {
  if (!sensor.circuit || !clip.frames) return sensor;
  constexpr double kRest_ms = 0.1;  // between exposures
  const auto ms = [](const std::optional<TimeNs>& time, double otherwise) {
    return time ? 1e3 * to_seconds(*time) : otherwise;
  };
  CircuitOptions& circuit = *sensor.circuit;
  const FrameTimes& frames = *clip.frames;
  double period_ms = ms(frames.period, circuit.frame_period_ms()),
         exposure_ms = ms(frames.exposure(), circuit.exposure_ms());
  if (exposure_ms > period_ms - kRest_ms) {
    if (frames.period)
      exposure_ms = period_ms - kRest_ms;
    else
      period_ms = exposure_ms + kRest_ms;
  }
  const double middle_ms =
      frames.start ? ms(frames.start, 0) + 0.5 * exposure_ms : ms(frames.end, 0) - 0.5 * exposure_ms;
  const double offset_ms = middle_ms - 1e3 * first_image_s;
  circuit.frame_rate_hz = 1e3 / period_ms, circuit.frame_exposure_ms = exposure_ms;
  circuit.frame_offset_ms = offset_ms - period_ms * std::floor(offset_ms / period_ms);
  return sensor;
}

std::vector<Event> simulate(const SensorModel& model, const RealClip& clip, const RealismOptions& options) {
  const Workers workers(options.threads);
  EventCamera camera(with_frames_of(clip, model.options, image_times(clip, options).front()), clip.frame.scene.width(),
                     clip.frame.scene.height(), options.seed);
  std::vector<Event> events;
  for_each_frame(clip, options,
                 [&](const Image<float>& image, TimeNs t) { camera.process(image, t, events, workers); });
  return events;
}

/// Writes the frames for other programs.
void write_frames(const RealClip& clip, const RealismOptions& options, const fs::path& folder) {
  fs::create_directories(folder);
  std::string list;
  int k = 0;
  for_each_frame(clip, options, [&](const Image<float>& image, TimeNs t) {
    std::vector<std::uint16_t> pixels;
    for (const float value : image.pixels())
      pixels.push_back(static_cast<std::uint16_t>(std::lround(65535 * static_cast<double>(value))));
    const std::string name = fmt::format("{:05}.png", k++);
    const auto width = static_cast<std::size_t>(image.width());
    write_file_atomically(
        folder / name, encode_png({pixels.data(), 2 * width, image.width(), image.height(), 1, 16}, PngEffort::fast));
    list += fmt::format("{},{}\n", t, name);
  });
  write_file_atomically(folder / "images.csv", list);
}

std::string replaced(std::string text, const std::string& name, const std::string& value) {
  for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + value.size()))
    text.replace(at, name.size(), value);
  return text;
}

std::vector<Event> run_command(const SensorModel& model, const RealClip& clip, const fs::path& frames,
                               const fs::path& output) {
  const std::string command = replaced(replaced(model.command, "{frames}", "'" + frames.string() + "'"), "{events}",
                                       "'" + output.string() + "'");
  const int status = std::system(command.c_str());
  if (status != 0) {
    throw UserError(fmt::format("the command of {} failed with status {}: {}", model.name,
                                WIFEXITED(status) ? WEXITSTATUS(status) : status, command));
  }
  EventsFile file(output, {SensorSize{clip.frame.scene.width(), clip.frame.scene.height()}, {}});
  std::vector<Event> all, events;
  while (file.read(events, std::size_t{1} << 20)) all.insert(all.end(), events.begin(), events.end());
  return all;
}

/// Of the pixels whose simulation sees only what the frame shows, during the clip.
ClipStatistics statistics_of(EventSpan events, const RealClip& clip) {
  const auto [left, top, width, height] = clip.region_inside();
  std::vector<Event> compared;
  for (const Event& event : events) {
    const int x = event.x - left, y = event.y - top;
    if (x >= 0 && x < width && y >= 0 && y < height)
      compared.push_back({event.t, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), event.polarity});
  }
  SensorStatisticsCounter counter(SensorSize{width, height});
  counter.add(compared);
  ClipStatistics statistics{std::move(counter).finish(), {}};
  if (clip.frames) statistics.bursts = count_burst_events(compared, *clip.frames);
  return statistics;
}

/// The events of the clip's own time, from 0 on.
std::vector<Event> within_clip(const std::vector<Event>& events, const RealClip& clip, const RealismOptions& options) {
  const TimeNs start = to_ns(start_of_clip(options)), end = start + to_ns(clip.duration_s);
  std::vector<Event> kept;
  for (const Event& event : events) {
    if (event.t >= start && event.t <= end) kept.push_back({event.t - start, event.x, event.y, event.polarity});
  }
  return kept;
}

/// The Kolmogorov-Smirnov distance of intervals, at the limits of the recording's bins.
double ks_of_intervals(const RealNoise::Polarity& real, std::vector<double> rates_hz) {
  if (rates_hz.empty() || real.fraction.back() == 0) return kNaN;
  std::sort(rates_hz.begin(), rates_hz.end());
  double distance = 0;
  for (std::size_t k = 0; k < real.rates_hz.size(); ++k) {
    const auto below = std::lower_bound(rates_hz.begin(), rates_hz.end(), real.rates_hz[k]) - rates_hz.begin();
    distance = std::max(distance,
                        std::abs(real.fraction[k] - static_cast<double>(below) / static_cast<double>(rates_hz.size())));
  }
  return distance;
}

double mean_of(const IntegerHistogram& counts) {
  double sum = 0;
  for (std::size_t i = 0; i < counts.bins().size(); ++i)
    sum += static_cast<double>(counts.bins()[i]) * static_cast<double>(IntegerHistogram::edge(i));
  return sum / static_cast<double>(std::max<std::uint64_t>(1, counts.total()));
}

/// 10 s of constant light, after as many to settle.
NoiseResult compare_noise(const RealNoise& real, const SensorModel& model, const RealismOptions& options) {
  const SensorUnderTest sensor =
      simulated_sensor(model.options, real.width, real.height, options.seed, options.threads);
  Light light(real.lux);
  light.keep(RealNoise::kDuration_s);
  const TimeNs start = light.points().back().t;
  light.keep(RealNoise::kDuration_s);
  struct Pixel {
    TimeNs last[2] = {-1, -1};
    std::uint64_t events[2] = {0, 0};
  };
  std::vector<Pixel> pixels(static_cast<std::size_t>(real.width) * static_cast<std::size_t>(real.height));
  std::vector<double> rates_hz[2];
  for (const Event& event : sensor.record(light.points())) {
    if (event.t <= start) continue;
    Pixel& pixel = pixels[event.y * static_cast<std::size_t>(real.width) + event.x];
    const std::size_t side = event.polarity > 0 ? 1 : 0;
    if (pixel.last[side] >= 0)
      rates_hz[side].push_back(1 / to_seconds(std::max<TimeNs>(1, event.t - pixel.last[side])));
    pixel.last[side] = event.t;
    ++pixel.events[side];
  }
  IntegerHistogram on, off;
  for (const Pixel& pixel : pixels) on.add(pixel.events[1]), off.add(pixel.events[0]);
  return {real.name,
          model.name,
          real.lux,
          mean_of(real.on.counts),
          mean_of(real.off.counts),
          mean_of(on),
          mean_of(off),
          ks_distance(real.on.counts, on),
          ks_distance(real.off.counts, off),
          ks_of_intervals(real.on, std::move(rates_hz[1])),
          ks_of_intervals(real.off, std::move(rates_hz[0]))};
}

}  // namespace

double ClipResult::sum_of_deviations() const {
  double sum = 0;
  for (const ComparedStatistic& statistic : statistics) {
    if (!std::isnan(statistic.deviations)) sum += std::min(kCap, statistic.deviations);
  }
  return sum;
}

namespace {

/// The part of a clip that is compared.
RealClip compared_part(const RealClip& clip, const std::optional<ClipPart>& fitted) {
  if (!fitted || fitted->clip != clip.name) return clip;
  return fitted->from > 0 ? clip.part(0, fitted->from) : clip.part(fitted->to, 1);
}

struct Interrupted {};

/// The part of a clip that sensors are fitted to.
RealClip part_to_fit(const RealRecordings& real, const ClipPart& part) {
  const auto clip =
      std::find_if(real.clips.begin(), real.clips.end(), [&](const RealClip& c) { return c.name == part.clip; });
  if (clip == real.clips.end()) throw UserError("there is no clip " + part.clip + " to fit to");
  const bool at_an_end = part.from == 0 ? part.to > 0 && part.to < 1 : part.from > 0 && part.from < 1 && part.to == 1;
  if (!at_an_end)
    throw UserError(
        "sensors can be fitted to the beginning of a clip, from 0, or to its end, to 1, but not to all of it");
  return clip->part(part.from, part.to);
}

/// Fits an event camera to a part of a clip, by simulation of this part, with a shorter history: it is simulated tens
/// of times.
SimulationFit fit_to_clip(const SensorModel& model, const RealClip& clip, RealismOptions options,
                          const std::function<bool(const std::string&)>& goes_on) {
  constexpr double kHistory_s = 1;
  options.history_s = std::min(options.history_s, kHistory_s);
  const auto simulated = [&](const EventCameraOptions& sensor) {
    if (!goes_on(model.name + ": fit to " + clip.name)) throw Interrupted();
    return statistics_of(within_clip(simulate({model.name, sensor, {}}, clip, options), clip, options), clip);
  };
  return fit_by_simulation(model.options, statistics_of(clip.events, clip), simulated);
}

}  // namespace

RealismEvaluation evaluate_realism(const fs::path& folder, const std::vector<SensorModel>& given,
                                   const RealismOptions& options,
                                   const std::function<bool(double, const std::string&)>& progress) {
  const RealRecordings real = read_real_recordings(folder);
  RealismEvaluation evaluation;
  for (const RealClip& clip : real.clips) {
    if (clip.frames) evaluation.frames.push_back({clip.name, *clip.frames});
  }
  std::vector<SensorModel> models = given;  // and after each event camera the fitted one
  if (options.fit_to) {
    const RealClip seen = part_to_fit(real, *options.fit_to);
    models.clear();
    for (const SensorModel& model : given) {
      models.push_back(model);
      if (!model.command.empty()) continue;
      try {
        const auto goes_on = [&](const std::string& what) { return !progress || progress(0, what); };
        evaluation.fitted.push_back({model.name, fit_to_clip(model, seen, options, goes_on)});
      } catch (const Interrupted&) {
        return evaluation;
      }
      models.push_back({model.name + kFitted, evaluation.fitted.back().fit.options, {}});
    }
  }
  const std::size_t steps = (real.clips.size() + real.noise.size()) * models.size();
  auto goes_on = [&, done = std::size_t{0}](const std::string& recording, const SensorModel& model) mutable {
    return !progress ||
           progress(static_cast<double>(done++) / static_cast<double>(steps), recording + ", " + model.name);
  };
  for (const RealClip& whole : real.clips) {
    const RealClip clip = compared_part(whole, options.fit_to);
    const SensorStatistics truth = statistics_of(clip.events, clip).sensor;
    std::unique_ptr<Scratch> scratch;  // with the frames for other programs
    for (const SensorModel& model : models) {
      if (!goes_on(clip.name, model)) return evaluation;
      if (!model.command.empty() && !scratch) {
        scratch = std::make_unique<Scratch>();
        write_frames(clip, options, scratch->path() / "frames");
      }
      const auto begin = std::chrono::steady_clock::now();
      const std::vector<Event> events =
          model.command.empty() ? simulate(model, clip, options)
                                : run_command(model, clip, scratch->path() / "frames",
                                              scratch->path() / fmt::format("events{}.txt", evaluation.clips.size()));
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      evaluation.clips.push_back(
          {clip.name, model.name,
           compare_sensors(truth, statistics_of(within_clip(events, clip, options), clip).sensor), seconds});
    }
  }
  for (const RealNoise& noise : real.noise) {
    for (const SensorModel& model : models) {
      if (!model.command.empty()) continue;
      if (!goes_on(noise.name, model)) return evaluation;
      evaluation.noise.push_back(compare_noise(noise, model, options));
    }
  }
  return evaluation;
}

}  // namespace esim::inline evaluate
