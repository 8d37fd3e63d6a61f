#include "esim/formats/text/states_csv.h"

#include <algorithm>
#include <set>
#include <string>

namespace esim::inline formats {
namespace {

const std::string kHeader =
    "#timestamp [ns],p_W_x [m],p_W_y [m],p_W_z [m],q_x [],q_y [],q_z [],q_w [],"
    "v_W_x [m s^-1],v_W_y [m s^-1],v_W_z [m s^-1],omega_B_x [rad s^-1],omega_B_y [rad s^-1],omega_B_z [rad s^-1],"
    "a_W_x [m s^-2],a_W_y [m s^-2],a_W_z [m s^-2],alpha_B_x [rad s^-2],alpha_B_y [rad s^-2],alpha_B_z [rad s^-2]";

const std::string kBiasHeader =
    ",b_w_x [rad s^-1],b_w_y [rad s^-1],b_w_z [rad s^-1],b_a_x [m s^-2],b_a_y [m s^-2],b_a_z [m s^-2]";

void append(CsvFile& file, const Kinematics& motion) {
  file.append(motion.T_world_body.translation);
  file.append(motion.T_world_body.rotation.coeffs());
  file.append(motion.velocity_world);
  file.append(motion.omega_body);
  file.append(motion.acceleration_world);
  file.append(motion.alpha_body);
}

/// A file name for an object that is not in `taken`, to which it is added.
std::string file_name(std::string name, std::set<std::string>& taken) {
  for (char& c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (!plain && c != '.' && c != '_' && c != '-') c = '_';
  }
  std::string free = name;
  for (int i = 2; !taken.insert(free).second; ++i) free = name + "_" + std::to_string(i);
  return free + ".csv";
}

}  // namespace

void StatesCsvWriter::begin(const RecordingInfo& info) {
  body_.emplace(folder_ / "states.csv", info.imu ? kHeader + kBiasHeader : kHeader);
  if (info.objects.empty()) return;
  create_folder(folder_ / "objects");
  std::set<std::string> taken;
  std::string names;
  for (const std::string& name : info.objects) {
    const std::string file = file_name(name, taken);
    objects_.emplace_back(folder_ / "objects" / file, kHeader);
    std::string line = name;
    std::replace(line.begin(), line.end(), '\n', ' ');
    names.append(file).append(" ").append(line).append("\n");
  }
  write_file_atomically(folder_ / "objects" / "names.txt", names);
}

void StatesCsvWriter::write(const Record& record) {
  const auto* pose = std::get_if<PoseRecord>(&record);
  if (pose == nullptr) return;
  body_->begin_line(pose->t);
  append(*body_, pose->body);
  if (pose->imu_bias) {
    body_->append(pose->imu_bias->angular_rate);
    body_->append(pose->imu_bias->specific_force);
  }
  body_->end_line();
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    objects_[i].begin_line(pose->t);
    append(objects_[i], pose->objects.at(i));
    objects_[i].end_line();
  }
}

void StatesCsvWriter::end(bool) {
  if (body_) body_->close();
  for (CsvFile& file : objects_) file.close();
  body_.reset();
  objects_.clear();
}

}  // namespace esim::inline formats
