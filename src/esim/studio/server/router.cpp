#include "esim/studio/server/router.h"

#include <fmt/format.h>

#include <new>

#include "esim/files/output_file.h"
#include "esim/scenario/read.h"
#include "esim/studio/editor/scenario_check.h"
#include "esim/studio/server/access.h"

namespace esim::studio {
namespace {

std::vector<std::string> parts_of(const std::string& path) {
  std::vector<std::string> parts;
  for (std::size_t begin = 1; begin <= path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    parts.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// Whether an error means that the disk is full.
bool is_about_room(const std::string& message) {
  for (const int error : {ENOSPC, EDQUOT, EFBIG}) {
    if (message.find(system_reason(error)) != std::string::npos) return true;
  }
  return false;
}

Response failure(int status, const std::string& what, const std::string& where) {
  Response response = refusal(status, what);
  if (!where.empty()) response.body = text_of(Json{{"error", what}, {"where", where}});
  return response;
}

}  // namespace

void Router::add(const std::string& method, const std::string& path, Answer answer) {
  routes_.push_back({method, parts_of(path), std::move(answer)});
}

Response Router::find(Request& request) const {
  const std::vector<std::string> parts = parts_of(request.path);
  bool known = false;
  for (const Route& route : routes_) {
    if (route.parts.size() != parts.size()) continue;
    request.captured.clear();
    bool fits = true;
    for (std::size_t i = 0; i < parts.size() && fits; ++i) {
      if (route.parts[i] == "*") {
        request.captured.push_back(parts[i]);
      } else {
        fits = route.parts[i] == parts[i];
      }
    }
    if (!fits) continue;
    known = true;
    if (route.method == request.method) return route.answer(request);
  }
  if (known) throw HttpError(405, fmt::format("method {} is not supported for {}", request.method, request.path));
  if (request.method == "GET" && rest_ && !request.path.starts_with("/api/")) return rest_(request);
  throw HttpError(404, request.path + ": no such address");
}

Response Router::answer(Request request) const {
  try {
    return find(request);
  } catch (const HttpError& error) {
    return refusal(error.status(), error.what());
  } catch (const OptionError& error) {
    return failure(400, error.what(), error.key());
  } catch (const OutputError& error) {
    return refusal(is_about_room(error.what()) ? 507 : 400, error.what());
  } catch (const UserError& error) {
    return failure(400, error.what(), option_in(error.what()));
  } catch (const std::bad_alloc&) {
    return refusal(507, "out of memory; use smaller images, a smaller scene, or a machine with more memory");
  } catch (const std::exception& error) {
    return refusal(500, std::string("internal error of esim: ") + error.what());
  }
}

Response json_response(const Json& json) {
  Response response;
  response.body = text_of(json);
  return response;
}

Response png_response(std::string png) {
  Response response;
  response.content_type = "image/png";
  response.body = std::move(png);
  return response;
}

}  // namespace esim::studio
