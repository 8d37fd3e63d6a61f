#include "esim/studio/server/access.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/random.h>

#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>

namespace esim::studio {
namespace {

/// Compares in constant time for texts of the same length.
bool equal_in_constant_time(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

bool is_address(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  if (inet_pton(AF_INET, host.c_str(), bytes.data()) == 1) return true;
  if (host.size() < 2 || host.front() != '[' || host.back() != ']') return false;
  return inet_pton(AF_INET6, host.substr(1, host.size() - 2).c_str(), bytes.data()) == 1;
}

bool listens_everywhere(const std::string& host) { return host == "0.0.0.0" || host == "::"; }

}  // namespace

bool is_loopback(const std::string& host) {
  return host == "localhost" || host == "::1" || (host.starts_with("127.") && is_address(host));
}

std::string random_token() {
  std::array<unsigned char, 24> bytes{};
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t got = ::getrandom(bytes.data() + done, bytes.size() - done, 0);
    if (got < 0 && errno != EINTR) throw InternalError("the system provides no random numbers");
    if (got > 0) done += static_cast<std::size_t>(got);
  }
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

Response refusal(int status, const std::string& what) {
  Response response;
  response.status = status;
  response.body = nlohmann::json{{"error", what}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return response;
}

Access::Access(std::string token, std::string host, int port)
    : token_(std::move(token)), host_(std::move(host)), port_(port) {}

std::string Access::cookie_name() const { return fmt::format("esim_studio_{}", port_); }

bool Access::is_own_host(const std::string& host) const {
  const std::string suffix = fmt::format(":{}", port_);
  if (!host.ends_with(suffix)) return false;
  const std::string name = host.substr(0, host.size() - suffix.size());
  if (name == "127.0.0.1" || name == "localhost" || name == "[::1]") return true;
  if (listens_everywhere(host_))
    return is_address(name);  // a name may point here without permission, an address cannot
  return name == host_ || name == "[" + host_ + "]";
}

bool Access::is_own_origin(const std::string& origin) const {
  constexpr std::string_view kScheme = "http://";
  return origin.starts_with(kScheme) && is_own_host(origin.substr(kScheme.size()));
}

bool Access::knows_token(const RequestHead& head) const {
  constexpr std::string_view kBearer = "Bearer ";
  if (head.authorization && head.authorization->starts_with(kBearer))
    return equal_in_constant_time(std::string_view(*head.authorization).substr(kBearer.size()), token_);
  if (!head.cookie) return false;
  const std::string wanted = cookie_name() + "=";
  std::string_view rest = *head.cookie;
  while (!rest.empty()) {
    while (rest.starts_with(' ')) rest.remove_prefix(1);
    const std::size_t end = std::min(rest.find(';'), rest.size());
    const std::string_view pair = rest.substr(0, end);
    if (pair.starts_with(wanted) && equal_in_constant_time(pair.substr(wanted.size()), token_)) return true;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return false;
}

std::optional<Response> Access::answer(const RequestHead& head) const {
  if (!head.host || !is_own_host(*head.host)) return refusal(403, "the Host header must be this server's address");
  if (head.origin && !is_own_origin(*head.origin)) return refusal(403, "requests from other sites are not allowed");

  const bool reads = head.method == "GET";
  const bool enters = reads && (head.target == "/" || head.target.starts_with("/?"));
  const bool foreign = head.fetch_site && *head.fetch_site != "same-origin" && *head.fetch_site != "none";
  if (foreign && !enters) return refusal(403, "requests from other sites are not allowed");

  constexpr std::string_view kEntry = "/?token=";
  if (enters && head.target.starts_with(kEntry) &&
      equal_in_constant_time(std::string_view(head.target).substr(kEntry.size()), token_)) {
    Response response;
    response.status = 303;
    response.headers = {{"Location", "/"},
                        {"Set-Cookie", fmt::format("{}={}; HttpOnly; SameSite=Strict; Path=/", cookie_name(), token_)}};
    return response;
  }
  if (!knows_token(head))
    return refusal(401, "the token is missing or wrong; open the address that esim studio has printed");
  if (reads) return std::nullopt;
  if (head.method != "POST" && head.method != "PUT" && head.method != "DELETE")
    return refusal(405, "the method must be GET, POST, PUT or DELETE");
  const bool json = head.content_type &&
                    (*head.content_type == "application/json" || head.content_type->starts_with("application/json;"));
  if (!json) return refusal(400, "the Content-Type must be application/json");
  return std::nullopt;
}

}  // namespace esim::studio
