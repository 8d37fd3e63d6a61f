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

/// The head of a request: the method, the raw target, and the relevant headers. Missing headers are empty.
struct RequestHead {
  std::string method{}, target{};
  std::optional<std::string> host{}, origin{}, cookie{}, authorization{}, content_type{}, fetch_site{};
};

struct Request {
  std::string method{};
  std::string path{};                          ///< decoded, without the query
  std::map<std::string, std::string> query{};  ///< decoded
  std::string body{};
  std::vector<std::string> captured{};  ///< the parts of the path that match * of the route, in order
};

struct Response {
  int status = 200;
  std::string content_type = "application/json";
  std::string body{};
  std::vector<std::pair<std::string, std::string>> headers{};

  /// Replaces the body: returns the text since the last call, which may be empty, or nullopt at the end. Called
  /// periodically; must not block.
  std::function<std::optional<std::string>()> stream{};
};

/// An error response: an HTTP status and a message for users.
class HttpError : public Error {
 public:
  HttpError(int status, const std::string& what) : Error(what), status_(status) {}
  int status() const { return status_; }

 private:
  int status_;
};

/// The path and the query of a request's target, decoded. Throws HttpError 400 for invalid targets and for bytes that
/// are invalid in paths.
std::pair<std::string, std::map<std::string, std::string>> parse_target(std::string_view target);

/// The media type for a file name's extension; "application/octet-stream" for unknown ones.
std::string content_type_of(const std::string& file_name);

}  // namespace esim::studio
