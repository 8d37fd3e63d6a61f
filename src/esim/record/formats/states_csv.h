#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <utility>

#include "esim/record/formats/csv.h"
#include "esim/record/record.h"

namespace esim {

/// How everything moves, at the times of the poses: the body in `folder`/states.csv, with the biases of its IMU where
/// it has one, and each moving object in `folder`/objects/NAME.csv, with `folder`/objects/names.txt: lines of the
/// file's name and the object's, in the order of their numbers. Columns: time (ns), p_W (m), q (Hamilton, x y z w), v_W
/// (m/s), omega_B (rad/s), a_W (m/s², without gravity), alpha_B (rad/s²); B is the body's, or the object's, frame.
class StatesCsvWriter final : public Sink {
 public:
  explicit StatesCsvWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Objects whose names are no file names, or the same, get ones that are: other characters than letters, digits, dot,
  /// underscore and hyphen become underscores, and names already taken get an appended number.
  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  std::filesystem::path folder_;
  std::optional<CsvFile> body_;
  std::deque<CsvFile> objects_;  // as in the recording's info
};

}  // namespace esim
