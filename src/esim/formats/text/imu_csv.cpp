#include "esim/formats/text/imu_csv.h"

namespace esim::inline formats {
namespace {

void append_line(CsvFile& file, TimeNs t, const InertialSignals& signals) {
  file.begin_line(t);
  file.append(signals.angular_rate);
  file.append(signals.specific_force);
  file.end_line();
}

}  // namespace

void ImuCsvWriter::begin(const RecordingInfo&) {
  measured_.emplace(folder_ / "imu.csv",
                    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
                    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]");
  bias_.emplace(folder_ / "imu_truth.csv",
                "#timestamp [ns],b_w_RS_S_x [rad s^-1],b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],"
                "b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],b_a_RS_S_z [m s^-2]");
}

void ImuCsvWriter::write(const Record& record) {
  const auto* imu = std::get_if<ImuRecord>(&record);
  if (imu == nullptr) return;
  append_line(*measured_, imu->t, imu->measured);
  append_line(*bias_, imu->t, imu->bias);
}

void ImuCsvWriter::end(bool) {
  if (measured_) measured_->close();
  if (bias_) bias_->close();
  measured_.reset();
  bias_.reset();
}

}  // namespace esim::inline formats
