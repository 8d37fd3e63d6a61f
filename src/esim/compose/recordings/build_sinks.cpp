#include <fmt/format.h>

#include <set>

#include "esim/compose/compose.h"
#include "esim/core/error.h"
#include "esim/files/output_file.h"
#include "esim/formats/formats.h"
#include "esim/formats/hdf5/dsec.h"
#include "esim/formats/hdf5/truth.h"
#include "esim/formats/images/frames_png.h"
#include "esim/formats/images/images_png.h"
#include "esim/formats/recording_folder/calibration_files.h"
#include "esim/formats/recording_folder/event_points_ply.h"
#include "esim/formats/text/imu_csv.h"
#include "esim/formats/text/poses_tum.h"
#include "esim/formats/text/states_csv.h"
#include "esim/preview/preview_writer.h"
#include "esim/recording/adapters.h"
#include "esim/recording/background_sink.h"
#include "esim/recording/fan_out.h"

namespace esim::inline compose {
namespace {

Compression compression_of(EventCompression compression) {
  switch (compression) {
    case EventCompression::gzip:
      return Compression::gzip;
    case EventCompression::none:
      return Compression::none;
    default:
      return Compression::blosc;
  }
}

const Format& written(const std::string& name) {
  try {
    const Format& format = format_named(name);
    if (format.create && format.name != "recording") return format;
  } catch (const UserError& error) {
    throw UserError(fmt::format("output.formats: {}", error.what()));
  }
  throw UserError(fmt::format("output.formats: {} cannot be written in addition to a recording; remove it", name));
}

/// The path of a format's file: `stem` plus the extension, with the format's name in between if that path is taken.
std::filesystem::path place_for(const Format& format, const std::filesystem::path& stem,
                                std::set<std::filesystem::path>& taken) {
  if (format.folder) return stem.parent_path() / format.name;
  std::filesystem::path path = stem.string() + format.extension();
  if (!taken.insert(path).second) path = fmt::format("{}.{}{}", stem.string(), format.name, format.extension());
  return path;
}

/// The folder of the files of an event sensor.
std::filesystem::path folder_of(const std::filesystem::path& folder, const CameraOptions& camera,
                                const SensorOptions& sensor) {
  return sensor.name.empty() ? folder / camera.name : folder / camera.name / sensor.name;
}

/// The formats of output.formats: formats for several cameras at the top, others in the folders of the event sensors,
/// each with the images of its camera.
void add_formats(const Scenario& scenario, const std::filesystem::path& folder, const WriteOptions& options,
                 FanOut& sinks) {
  std::set<std::filesystem::path> taken;
  const std::vector<std::vector<int>> numbers = sensor_numbers(scenario);
  for (const CameraOptions& camera : scenario.cameras) {
    for (const SensorOptions& sensor : camera.sensors()) taken.insert(folder_of(folder, camera, sensor) / "events.h5");
  }
  for (const std::string& name : scenario.output.formats) {
    const Format& format = written(name);
    if (format.several_cameras) {
      sinks.add(format.create(place_for(format, folder / "recording", taken), options));
      continue;
    }
    const bool events_alone = format.holds == std::vector{Content::events};
    for (std::size_t i = 0; i < scenario.cameras.size(); ++i) {
      const CameraOptions& camera = scenario.cameras[i];
      const auto add = [&](const std::filesystem::path& place, int sensor) {
        sinks.add(std::make_unique<OneCamera>(format.create(place_for(format, place / "events", taken), options),
                                              static_cast<int>(i), sensor));
      };
      for (std::size_t k = 0; k < numbers[i].size(); ++k)
        add(folder_of(folder, camera, camera.sensors()[k]), numbers[i][k]);
      if (!camera.events && !events_alone) add(folder / camera.name, static_cast<int>(i));
    }
  }
}

}  // namespace

void check_output(const Scenario& scenario) {
  for (const std::string& name : scenario.output.formats) written(name);
}

std::unique_ptr<Sink> build_sink(const Scenario& scenario, const std::filesystem::path& folder) {
  const TruthOptions& truth = scenario.truth;
  const OutputOptions& output = scenario.output;
  const Compression compression = compression_of(output.compression);
  const TimeUnit unit = output.time_unit == EventTimeUnit::us ? TimeUnit::us : TimeUnit::ns;

  const std::vector<std::vector<int>> numbers = sensor_numbers(scenario);
  auto sinks = std::make_unique<FanOut>();
  sinks->add(std::make_unique<CalibrationWriter>(folder / "calibration"));
  if (scenario.imu) sinks->add(std::make_unique<ImuCsvWriter>(folder));
  if (truth.pose_rate_hz > 0) {
    sinks->add(std::make_unique<PosesTumWriter>(folder / "poses.txt"));
    sinks->add(std::make_unique<StatesCsvWriter>(folder));
  }
  for (std::size_t i = 0; i < scenario.cameras.size(); ++i) {
    const int camera = static_cast<int>(i);
    const auto place = folder / scenario.cameras[i].name;
    create_folder(place);
    for (std::size_t k = 0; k < numbers[i].size(); ++k) {
      const auto of_sensor = folder_of(folder, scenario.cameras[i], scenario.cameras[i].sensors()[k]);
      create_folder(of_sensor);
      sinks->add(std::make_unique<EventsHdf5Writer>(of_sensor / "events.h5", numbers[i][k],
                                                    EventsHdf5Options{unit, compression}));
      if (truth.event_points)
        sinks->add(std::make_unique<EventPointsPlyWriter>(of_sensor / "event_points.ply", numbers[i][k]));
    }
    if (const auto& frames = scenario.cameras[i].frame_camera) {
      const bool in_colour = scenario.cameras[i].colour != ColourFilters::none && frames->demosaic;
      sinks->add(std::make_unique<FramesPngWriter>(place, camera, in_colour));
    }
    if (truth.rate_hz <= 0) continue;
    if (truth.images) sinks->add(std::make_unique<ImagesPngWriter>(place / "images", camera));
    const TruthHdf5Options datasets{truth.depth, truth.motion_field, compression, truth.objects, truth.optical_flow};
    if (datasets.depth || datasets.motion_field || datasets.objects || datasets.optical_flow)
      sinks->add(std::make_unique<TruthHdf5Writer>(place / "truth.h5", camera, datasets));
    if (!output.preview) continue;
    const int shown = numbers[i].empty() ? camera : numbers[i].front();  // the events of the first sensor
    sinks->add(std::make_unique<OneCamera>(std::make_unique<PreviewWriter>(place, 0), camera, shown));
  }
  add_formats(scenario, folder, {unit, compression}, *sinks);
  return std::make_unique<BackgroundSink>(std::move(sinks));
}

std::unique_ptr<Sink> build_conversion_sink(const std::filesystem::path& folder) {
  const auto place = folder / kConversionCamera;
  create_folder(place);
  auto sinks = std::make_unique<FanOut>();
  sinks->add(std::make_unique<EventsHdf5Writer>(place / "events.h5", 0));
  sinks->add(std::make_unique<PreviewWriter>(place, 0));
  return std::make_unique<BackgroundSink>(std::move(sinks));
}

std::unique_ptr<Sink> build_conversion_sink(const std::filesystem::path& file, const Format& format) {
  return std::make_unique<BackgroundSink>(format.create(file, {}));
}

}  // namespace esim::inline compose
