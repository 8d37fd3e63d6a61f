#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <utility>

#include "esim/formats/text/csv.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

/// The motion of everything, at the times of the poses: the body in `folder`/states.csv, with the biases of its IMU if
/// there is one, and each moving object in `folder`/objects/NAME.csv, with `folder`/objects/names.txt: lines of file
/// name and object name, in the order of the object numbers. Columns: time (ns), p_W (m), q (Hamilton, x y z w), v_W
/// (m/s), omega_B (rad/s), a_W (m/s², without gravity), alpha_B (rad/s²); B is the frame of the body or of the object.
class StatesCsvWriter final : public Sink {
 public:
  explicit StatesCsvWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Object names that are not valid or unique file names are changed: characters other than letters, digits, dot,
  /// underscore and hyphen become underscores, and names already taken get a number appended.
  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  std::filesystem::path folder_;
  std::optional<CsvFile> body_;
  std::deque<CsvFile> objects_;  // in the order of RecordingInfo::objects
};

}  // namespace esim::inline formats
