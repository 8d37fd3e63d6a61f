#include "esim/formats/hdf5/m3ed.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "esim/core/remedy.h"
#include "esim/formats/hdf5/event_columns.h"
#include "esim/formats/hdf5/library.h"
#include "esim/formats/hdf5/millisecond_index.h"

namespace esim::inline formats {
namespace {

constexpr EventColumns kColumns = {"prophesee/left/t",
                                   "prophesee/left/x",
                                   "prophesee/left/y",
                                   "prophesee/left/p",
                                   "prophesee/left/calib/resolution",
                                   "prophesee/left/ms_map_idx"};
constexpr std::size_t kChunk = 1 << 16;  // events, and milliseconds
constexpr TimeNs kLatest =
    30 * 86'400 * kNsPerSecond;  // maximum time, for which the millisecond index still fits into memory

void create_text(const hdf5::Output& file, const char* name, const std::string& text) {
  const hdf5::Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  file.check(H5Tset_size(type, text.size()));
  const hdf5::Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const hdf5::Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  file.check(H5Pset_obj_track_times(creation, false));
  const hdf5::Handle dataset(H5Dcreate2(file.id(), name, type, space, H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose);
  file.check(static_cast<hid_t>(dataset));
  file.check(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()));
}

template <typename T>
void create_list(const hdf5::Output& file, const char* name, hid_t type, std::span<const T> numbers) {
  hdf5::Series(file, name, {type, {}, numbers.size(), Compression::none}).append(numbers);
}

class M3edWriter final : public Sink {
 public:
  M3edWriter(std::filesystem::path path, Compression compression) : path_(std::move(path)), compression_(compression) {}
  ~M3edWriter() override {
    const hdf5::Quiet quiet;
    close_series();
  }

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  void write_calibration(const Camera& camera);
  void write_chunk();
  void close_series();

  std::filesystem::path path_;
  Compression compression_;
  TimeNs end_ = 0;

  // Buffers that have not been written yet.
  std::vector<std::int64_t> t_;
  std::vector<std::uint16_t> x_, y_;
  std::vector<std::int8_t> p_;

  // Declared last, so that the series close before the file.
  std::optional<hdf5::Output> file_;
  hdf5::Series t_series_, x_series_, y_series_, p_series_;
  hdf5::MillisecondIndex milliseconds_;
};

void M3edWriter::begin(const RecordingInfo& info) {
  const hdf5::Quiet quiet;
  end_ = std::clamp<TimeNs>(info.end, 0, kLatest);
  file_.emplace(path_);
  for (const char* group : {"prophesee", "prophesee/left", "prophesee/left/calib"}) file_->create_group(group);
  const auto series = [&](const char* name, hid_t type) {
    return hdf5::Series(*file_, name, {type, {}, kChunk, compression_});
  };
  t_series_ = series(kColumns.t, H5T_STD_I64LE);
  x_series_ = series(kColumns.x, H5T_STD_U16LE);
  y_series_ = series(kColumns.y, H5T_STD_U16LE);
  p_series_ = series(kColumns.p, H5T_STD_I8LE);
  milliseconds_.open(series(kColumns.ms_index, H5T_STD_U64LE));
  if (!info.cameras.empty()) write_calibration(info.cameras.front().model);
  file_->flush();
}

void M3edWriter::write_calibration(const Camera& camera) {
  if (camera.width > 0 && camera.height > 0) {
    const std::array<std::int64_t, 2> size = {camera.width, camera.height};
    create_list<std::int64_t>(*file_, kColumns.resolution, H5T_STD_I64LE, size);
  }
  RadialTangential d;
  if (const auto* known = std::get_if<RadialTangential>(&camera.distortion)) d = *known;
  const bool fits = std::holds_alternative<NoDistortion>(camera.distortion) ||
                    (std::holds_alternative<RadialTangential>(camera.distortion) && d.k3 == 0);
  if (camera.fx <= 0 || camera.fy <= 0 || !fits) return;
  const std::array<double, 4> intrinsics = {camera.fx, camera.fy, camera.cx, camera.cy};
  const std::array<double, 4> coefficients = {d.k1, d.k2, d.p1, d.p2};
  create_text(*file_, "prophesee/left/calib/camera_model", "pinhole");
  create_text(*file_, "prophesee/left/calib/distortion_model", "radtan");
  create_list<double>(*file_, "prophesee/left/calib/intrinsics", H5T_IEEE_F64LE, intrinsics);
  create_list<double>(*file_, "prophesee/left/calib/distortion_coeffs", H5T_IEEE_F64LE, coefficients);
}

void M3edWriter::write(const Record& record) {
  const auto* events = std::get_if<EventsRecord>(&record);
  if (events == nullptr || events->camera != 0) return;
  for (const Event& event : events->events) {
    if (event.t < 0 || event.t > kLatest) {
      throw RemediableError(path_.string() + ": M3ED counts times from the start of the recording, so an event at " +
                                std::to_string(event.t / kNsPerSecond) + " s does not fit: choose another format",
                            Remedy::times_from_zero);
    }
    const std::int64_t us = event.t / kNsPerUs;
    milliseconds_.add({&event, 1}, 0);
    t_.push_back(us);
    x_.push_back(event.x), y_.push_back(event.y);
    p_.push_back(event.polarity > 0 ? 1 : 0);
    if (t_.size() == kChunk) write_chunk();
  }
}

void M3edWriter::write_chunk() {
  const hdf5::Quiet quiet;
  t_series_.append(std::span<const std::int64_t>(t_));
  x_series_.append(std::span<const std::uint16_t>(x_));
  y_series_.append(std::span<const std::uint16_t>(y_));
  p_series_.append(std::span<const std::int8_t>(p_));
  t_.clear(), x_.clear(), y_.clear(), p_.clear();
  file_->flush();
}

void M3edWriter::end(bool complete) {
  if (!file_) return;
  const hdf5::Quiet quiet;
  write_chunk();
  milliseconds_.finish(complete ? static_cast<std::uint64_t>(end_) : 0);
  milliseconds_.write();
  close_series();
  file_->close();
  file_.reset();
}

void M3edWriter::close_series() {
  for (hdf5::Series* series : {&t_series_, &x_series_, &y_series_, &p_series_}) *series = hdf5::Series();
  milliseconds_.close();
}

}  // namespace

Format m3ed_format() {
  return {
      .name = "m3ed",
      .description = "HDF5 in M3ED's layout",
      .holds = {Content::events},
      .resolution = kNsPerUs,
      .recognises = [](const auto& path, std::string_view head) { return has_event_columns(kColumns, path, head); },
      .open = [](const auto& path, const ReadOptions& options) { return open_event_columns(kColumns, path, options); },
      .create = [](const auto& path,
                   const WriteOptions& options) { return std::make_unique<M3edWriter>(path, options.compression); },
  };
}

}  // namespace esim::inline formats
