#pragma once

#include <functional>
#include <string>
#include <vector>

#include "esim/studio/server/http.h"
#include "esim/studio/server/json.h"

// Private to studio.
namespace esim::studio {

/// Maps requests to handlers.
class Router {
 public:
  using Answer = std::function<Response(const Request&)>;

  /// `path` is the path of requests; * matches any one part.
  void add(const std::string& method, const std::string& path, Answer answer);

  /// The handler of GET requests that match no route.
  void add_rest(Answer answer) { rest_ = std::move(answer); }

  /// Answers any request; exceptions become {"error": ..., "where": ...}.
  Response answer(Request request) const;

 private:
  struct Route {
    std::string method;
    std::vector<std::string> parts;
    Answer answer;
  };
  Response find(Request& request) const;

  std::vector<Route> routes_;
  Answer rest_;
};

Response json_response(const Json& json);
Response png_response(std::string png);

}  // namespace esim::studio
