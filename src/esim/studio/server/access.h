#pragma once

#include <optional>
#include <string>

#include "esim/studio/server/http.h"

namespace esim::studio {

/// Access control. Every page in the user's browser and every program on the machine can reach the server, so that a
/// request needs the token of this start:
///   - the Host must be the server's own, which prevents DNS rebinding;
///   - so must the Origin, if given; requests that a browser sends for another site are refused;
///   - the token is in a cookie, which GET /?token=... sets, or in "Authorization: Bearer ...";
///   - requests that change something must be application/json, which a form of another site cannot send.
class Access {
 public:
  /// `host` is the address or name on which the server listens.
  Access(std::string token, std::string host, int port);

  /// The refusal, or the redirection that sets the cookie; empty if the request is allowed.
  std::optional<Response> answer(const RequestHead& head) const;

  std::string cookie_name() const;

 private:
  bool is_own_host(const std::string& host) const;
  bool is_own_origin(const std::string& origin) const;
  bool knows_token(const RequestHead& head) const;

  std::string token_, host_;
  int port_;
};

/// Whether only programs on this machine can reach an address.
bool is_loopback(const std::string& host);

/// 192 random bits from the system, as URL-safe text.
std::string random_token();

/// An error response: {"error": ...}.
Response refusal(int status, const std::string& what);

}  // namespace esim::studio
