#pragma once

#include <optional>
#include <string>

#include "esim/studio/http.h"

namespace esim::studio {

/// Who may ask. A server on a person's own machine can be reached by every page in their browser and every program of
/// theirs; only who knows the token that this start has made is answered:
///   - the Host must be the server's own, so that no name that is made to point here (DNS rebinding) gets in;
///   - an Origin, where there is one, too, and what a browser sends on behalf of another site is refused;
///   - the token stands in a cookie, which GET /?token=... sets, or in "Authorization: Bearer ...";
///   - what changes something must be application/json, which a foreign page's form cannot send.
class Access {
 public:
  /// `host` is what the server listens on: an address, or a name.
  Access(std::string token, std::string host, int port);

  /// The refusal, or the redirection that sets the cookie; nothing where the request may go on.
  std::optional<Response> answer(const RequestHead& head) const;

  std::string cookie_name() const;

 private:
  bool is_own_host(const std::string& host) const;
  bool is_own_origin(const std::string& origin) const;
  bool knows_token(const RequestHead& head) const;

  std::string token_, host_;
  int port_;
};

/// Whether only programs of this machine can reach an address.
bool is_loopback(const std::string& host);

/// 192 random bits from the system, as text that fits into a URL.
std::string random_token();

/// {"error": ...}, as every refusal is.
Response refusal(int status, const std::string& what);

}  // namespace esim::studio
