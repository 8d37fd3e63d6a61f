#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "esim/geometry/se3.h"

// Private to studio: includes nlohmann/json.hpp.

namespace esim::studio {

/// Members keep their order.
using Json = nlohmann::ordered_json;

/// What a request says. Throws HttpError 400 for what is no JSON object, or nested deeper than any request needs.
Json parse_object(const std::string& body);

/// One line; bytes that are no UTF-8 are replaced.
std::string text_of(const Json& json);

/// [x, y, z, qx, qy, qz, qw]
Json json_of(const SE3& pose);
Json json_of(const Eigen::Vector3d& vector);

/// A member of a request. Throw HttpError 400 naming it where it is missing or of another type.
std::string text_member(const Json& object, const char* name);
std::string text_member(const Json& object, const char* name, const std::string& otherwise);
double number_member(const Json& object, const char* name, double otherwise, double low, double high);
bool flag_member(const Json& object, const char* name);

}  // namespace esim::studio
