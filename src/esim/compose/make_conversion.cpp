#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/formats/formats.h"
#include "esim/recording/fan_out.h"
#include "esim/recording/keep_on_failure.h"
#include "esim/recording/recording_directory.h"
#include "esim/recording/recording_file.h"
#include "esim/scenario/conversion.h"
#include "esim/stats/between_frames.h"
#include "esim/video/model_process.h"

namespace esim::inline compose {
namespace {

namespace fs = std::filesystem;

/// A conversion from the opened input to the summary.
class Converter {
 public:
  Converter(const ConversionOptions& options, ConversionOutput& output, const Monitor& monitor)
      : options_(options),
        monitor_(monitor),
        workers_(output.threads),
        frames_(options.input, options.video, options.bayer),
        images_(std::move(output.interpolator)) {
    if (images_ == nullptr && !options.interpolator.empty())
      images_ = start_model_process(options.interpolator, frames_.width(), frames_.height(), options.bayer);
  }

  ConversionSummary run(std::unique_ptr<Sink> out) {
    Interpolator interpolator(options_.interpolation, options_.event_camera.dark_light(), std::move(images_));
    EventCamera event_camera(options_.event_camera, frames_.width(), frames_.height(), options_.seed, 0);
    auto watching = std::make_unique<BetweenFrames>();
    const BetweenFrames& between_frames = *watching;
    FanOut both;
    both.add(std::move(out));
    both.add(std::move(watching));
    ConversionSummary summary =
        convert({frames_, interpolator, event_camera, workers_}, both, [&](const Progress& progress) {
          has_converted_ = true;
          return monitor_(progress);
        });
    const PhaseTest test = between_frames.test();
    if (test.banding != Banding::unknown) summary.modulation = test.modulation;
    return summary;
  }

  int threads() const { return workers_.threads(); }

  /// Whether anything has been converted.
  const bool& has_converted() const { return has_converted_; }

 private:
  const ConversionOptions& options_;
  const Monitor& monitor_;
  Workers workers_;
  FrameSequence frames_;
  std::unique_ptr<FrameInterpolator> images_;
  bool has_converted_ = false;
};

void check(const ConversionOptions& options, const ConversionOutput& output, const Format* file_format) {
  const bool has_interpolator = output.interpolator != nullptr || !options.interpolator.empty();
  if (has_interpolator && !options.interpolation.interpolation)
    throw UserError("interpolator: must not be given if interpolation is off");
  if (file_format != nullptr && options.event_camera.labels && !file_format->can_hold(Content::event_labels)) {
    throw UserError(
        fmt::format("event_camera.labels: {} cannot hold the labels of events; choose another format, such "
                    "as dsec or npz, or a folder",
                    file_format->name));
  }
}

}  // namespace

MadeConversion make_conversion(const ConversionOptions& options, ConversionOutput output, const Notices& notify,
                               const Monitor& monitor) {
  std::vector<std::string> given;
  const Notices notices = keeping(notify, given);
  std::ranges::for_each(warnings_of_filters(options.event_camera), notices.warning);
  warn_of_noise("", options.event_camera, notices);
  const auto comment = [&](const ConversionSummary& summary) {
    output.comment(summary, notices);
    std::ranges::for_each(losses(options, summary), notices.warning);
  };

  const Format* format = find_format_for(output.out);
  if (format != nullptr && !format->folder) {
    check(options, output, format);
    RecordingFile file(output.out, output.replace);
    Converter converter(options, output, monitor);
    return keep_on_failure(file, converter.has_converted(), [&] {
      const ConversionSummary summary = converter.run(build_conversion_sink(file.path(), *format));
      file.finish();
      comment(summary);
      return MadeConversion{summary, report_json(options, summary, converter.threads(), given)};
    });
  }

  check(options, output, nullptr);
  RecordingDirectory directory(output.out, output.replace);
  ProvenanceRecorder provenance(output.repetition);
  const UsedFilesListener listener([&](const UsedFile& file) { provenance.add(file); });
  Converter converter(options, output, monitor);
  write_file_atomically(directory.path() / "video.yaml", write_conversion(options));
  return keep_on_failure(directory, converter.has_converted(), [&] {
    const ConversionSummary summary = converter.run(build_conversion_sink(directory.path()));
    comment(summary);
    const std::string report =
        report_json(options, summary, converter.threads(), given, provenance.finish(summary.complete));
    directory.finish(report);
    return MadeConversion{summary, report};
  });
}

}  // namespace esim::inline compose
