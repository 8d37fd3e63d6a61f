#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "esim/geometry/se3.h"

// Private to studio: includes nlohmann/json.hpp.
namespace esim::studio {

/// Members keep their order.
using Json = nlohmann::ordered_json;

/// Parses the body of a request. Throws HttpError 400 if it is not a JSON object, or is nested too deeply.
Json parse_object(const std::string& body);

/// JSON on one line; invalid UTF-8 is replaced.
std::string text_of(const Json& json);

/// [x, y, z, qx, qy, qz, qw]
Json json_of(const SE3& pose);
Json json_of(const Eigen::Vector3d& vector);

/// A member of a request. Throws HttpError 400 with its name if it is missing or has another type.
std::string text_member(const Json& object, const char* name);
std::string text_member(const Json& object, const char* name, const std::string& otherwise);
double number_member(const Json& object, const char* name, double otherwise, double low, double high);
bool flag_member(const Json& object, const char* name);

}  // namespace esim::studio
