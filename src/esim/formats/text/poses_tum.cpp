#include "esim/formats/text/poses_tum.h"

#include <fmt/format.h>

#include <iterator>

#include "esim/files/number_text.h"

namespace esim::inline formats {

void PosesTumWriter::begin(const RecordingInfo&) {
  file_.emplace(path_);
  file_->append("# timestamp tx ty tz qx qy qz qw\n");
}

void PosesTumWriter::write(const Record& record) {
  const auto* pose = std::get_if<PoseRecord>(&record);
  if (pose == nullptr) return;
  const Eigen::Vector3d& p = pose->body.T_world_body.translation;
  const Eigen::Quaterniond& q = pose->body.T_world_body.rotation;
  append_seconds(file_->buffer(), pose->t);
  fmt::format_to(std::back_inserter(file_->buffer()), " {:.12f} {:.12f} {:.12f} {:.12f} {:.12f} {:.12f} {:.12f}\n",
                 p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  file_->flush_if_full();
}

void PosesTumWriter::end(bool) {
  if (file_) file_->close();
  file_.reset();
}

}  // namespace esim::inline formats
