#pragma once

#include <filesystem>
#include <optional>
#include <utility>

#include "esim/formats/text/csv.h"
#include "esim/recording/record.h"

namespace esim::inline formats {

/// The IMU's measurements in the layout of the EuRoC dataset, in `folder`/imu.csv: time (ns), angular rate (rad/s),
/// specific force (m/s²), in the IMU's frame; and their biases at the same times in `folder`/imu_truth.csv.
class ImuCsvWriter final : public Sink {
 public:
  explicit ImuCsvWriter(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void begin(const RecordingInfo& info) override;
  void write(const Record& record) override;
  void end(bool complete) override;

 private:
  std::filesystem::path folder_;
  std::optional<CsvFile> measured_, bias_;
};

}  // namespace esim::inline formats
