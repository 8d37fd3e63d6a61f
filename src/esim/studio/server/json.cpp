#include "esim/studio/server/json.h"

#include <fmt/format.h>

#include <cmath>

#include "esim/studio/server/http.h"

namespace esim::studio {

Json parse_object(const std::string& body) {
  constexpr int kMaxDeep = 64;
  bool too_deep = false;
  const auto watch = [&](int depth, Json::parse_event_t, Json&) {
    too_deep |= depth > kMaxDeep;
    return !too_deep;
  };
  const Json json = Json::parse(body, watch, false);
  if (too_deep || !json.is_object()) throw HttpError(400, "the request must be a JSON object");
  return json;
}

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json json_of(const SE3& pose) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

Json json_of(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

std::string text_member(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || !found->is_string()) throw HttpError(400, fmt::format("{}: must be a text", name));
  return found->get<std::string>();
}

std::string text_member(const Json& object, const char* name, const std::string& otherwise) {
  const auto found = object.find(name);
  return found == object.end() || found->is_null() ? otherwise : text_member(object, name);
}

double number_member(const Json& object, const char* name, double otherwise, double low, double high) {
  const auto found = object.find(name);
  if (found == object.end() || found->is_null()) return otherwise;
  const double value = found->is_number() ? found->get<double>() : std::nan("");
  if (!(value >= low && value <= high))
    throw HttpError(400, fmt::format("{} must be a number from {} to {}", name, low, high));
  return value;
}

bool flag_member(const Json& object, const char* name) {
  const auto found = object.find(name);
  if (found == object.end() || found->is_null()) return false;
  if (!found->is_boolean()) throw HttpError(400, fmt::format("{} must be true or false", name));
  return found->get<bool>();
}

}  // namespace esim::studio
