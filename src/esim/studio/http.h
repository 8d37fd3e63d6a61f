#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "esim/core/error.h"

namespace esim::studio {

/// What is known of a request before its body: the method, the target as it was sent, and the headers that matter.
/// Headers that are not there are nothing.
struct RequestHead {
  std::string method{}, target{};
  std::optional<std::string> host{}, origin{}, cookie{}, authorization{}, content_type{}, fetch_site{};
};

struct Request {
  std::string method{};
  std::string path{};                          ///< decoded, without the query
  std::map<std::string, std::string> query{};  ///< decoded
  std::string body{};
  std::vector<std::string> captured{};  ///< the parts of the path that a route leaves open, in their order
};

struct Response {
  int status = 200;
  std::string content_type = "application/json";
  std::string body{};
  std::vector<std::pair<std::string, std::string>> headers{};

  /// Instead of a body: what has come since the last call, often nothing; without a value it is over. Called now and
  /// then, must not wait.
  std::function<std::optional<std::string>()> stream{};
};

/// An answer other than success: a status of HTTP, and what a person can do about it.
class HttpError : public Error {
 public:
  HttpError(int status, const std::string& what) : Error(what), status_(status) {}
  int status() const { return status_; }

 private:
  int status_;
};

/// The path and the query of a request's target, decoded. Throws HttpError 400 for what is no target, and for bytes
/// that no path has.
std::pair<std::string, std::map<std::string, std::string>> parse_target(std::string_view target);

/// "application/json" and the like, by a file name's extension; "application/octet-stream" where it says nothing.
std::string content_type_of(const std::string& file_name);

}  // namespace esim::studio
