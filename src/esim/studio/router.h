#pragma once

#include <functional>
#include <string>
#include <vector>

#include "esim/studio/http.h"
#include "esim/studio/json.h"

namespace esim::studio {

/// Which function answers which request.
class Router {
 public:
  using Answer = std::function<Response(const Request&)>;

  /// `path` is that of requests, with * for a part that is left open.
  void add(const std::string& method, const std::string& path, Answer answer);

  /// What no other route answers, with GET.
  void add_rest(Answer answer) { rest_ = std::move(answer); }

  /// Answers anything: what is thrown becomes {"error": ..., "where": ...}.
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
