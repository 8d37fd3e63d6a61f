#include "esim/studio/server/access.h"

#include <gtest/gtest.h>

namespace esim::studio {
namespace {

const std::string kToken = "0123456789abcdef";

RequestHead get(const std::string& target) {
  RequestHead head;
  head.method = "GET";
  head.target = target;
  head.host = "127.0.0.1:8391";
  head.cookie = "other=1; esim_studio_8391=" + kToken;
  return head;
}

int status(const RequestHead& head, const std::string& host = "127.0.0.1") {
  const auto answer = Access(kToken, host, 8391).answer(head);
  return answer ? answer->status : 200;
}

TEST(Access, WhoKnowsTheTokenGetsIn) {
  EXPECT_EQ(status(get("/")), 200);
  RequestHead bearer = get("/api/session");
  bearer.cookie.reset();
  bearer.authorization = "Bearer " + kToken;
  EXPECT_EQ(status(bearer), 200);
}

TEST(Access, WhoDoesNotKnowItDoesNot) {
  for (const char* cookie :
       {"", "esim_studio_8391=", "esim_studio_8391=0123456789abcdeF", "esim_studio_8392=0123456789abcdef",
        "xesim_studio_8391=0123456789abcdef", "esim_studio_8391=0123456789abcdef0", ";;;", "="}) {
    RequestHead head = get("/api/session");
    head.cookie = cookie;
    EXPECT_EQ(status(head), 401) << cookie;
  }
  RequestHead wrong = get("/");
  wrong.authorization = "Bearer x";  // beside a right cookie: what is said last counts
  EXPECT_EQ(status(wrong), 401);
}

TEST(Access, TheAddressThatIsPrintedSetsACookieThatScriptsCannotRead) {
  RequestHead head = get("/?token=" + kToken);
  head.cookie.reset();
  const auto answer = Access(kToken, "127.0.0.1", 8391).answer(head);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 303);
  EXPECT_EQ(answer->headers[0].second, "/");
  EXPECT_EQ(answer->headers[1].second, "esim_studio_8391=" + kToken + "; HttpOnly; SameSite=Strict; Path=/");
  head.target = "/?token=0123456789abcdeX";
  EXPECT_EQ(status(head), 401);
  head.target = "/api/session?token=" + kToken;
  EXPECT_EQ(status(head), 401);
}

TEST(Access, NamesThatWereMadeToPointHereAreRefused) {
  for (const char* host : {"127.0.0.1:8391", "localhost:8391", "[::1]:8391"}) {
    RequestHead head = get("/");
    head.host = host;
    EXPECT_EQ(status(head), 200) << host;
  }
  for (const char* host : {"evil.example:8391", "127.0.0.1", "127.0.0.1:80", "localhost.evil.example:8391", "", "8391",
                           ":8391", "127.0.0.1:8391.evil.example", "127.0.0.1:8391:8391"}) {
    RequestHead head = get("/");
    head.host = host;
    EXPECT_EQ(status(head), 403) << host;
  }
  RequestHead none = get("/");
  none.host.reset();
  EXPECT_EQ(status(none), 403);
}

TEST(Access, OnAllAddressesOnlyAddressesAreNames) {
  RequestHead head = get("/");
  head.host = "192.168.1.5:8391";
  EXPECT_EQ(status(head, "0.0.0.0"), 200);
  EXPECT_EQ(status(head), 403);
  head.host = "evil.example:8391";
  EXPECT_EQ(status(head, "0.0.0.0"), 403);
}

TEST(Access, OtherSitesAreRefused) {
  for (const char* origin : {"http://evil.example", "null", "https://127.0.0.1:8391", "http://127.0.0.1:8392", ""}) {
    RequestHead head = get("/api/session");
    head.origin = origin;
    EXPECT_EQ(status(head), 403) << origin;
  }
  RequestHead own = get("/api/session");
  own.origin = "http://127.0.0.1:8391";
  own.fetch_site = "same-origin";
  EXPECT_EQ(status(own), 200);
  for (const char* site : {"cross-site", "same-site"}) {  // other ports of this machine are of the same site
    RequestHead head = get("/api/session");
    head.fetch_site = site;
    EXPECT_EQ(status(head), 403) << site;
    head.target = "/";  // a link may lead here
    EXPECT_EQ(status(head), 200) << site;
  }
}

TEST(Access, WhatChangesSomethingIsJson) {
  for (const char* method : {"POST", "PUT", "DELETE"}) {
    RequestHead head = get("/api/runs");
    head.method = method;
    EXPECT_EQ(status(head), 400) << method;
    head.content_type = "text/plain";
    EXPECT_EQ(status(head), 400) << method;
    head.content_type = "application/json; charset=utf-8";
    EXPECT_EQ(status(head), 200) << method;
  }
  for (const char* method : {"HEAD", "OPTIONS", "TRACE", "PATCH", ""}) {
    RequestHead head = get("/");
    head.method = method;
    EXPECT_EQ(status(head), 405) << method;
  }
}

TEST(Access, TokensAreRandom) {
  EXPECT_EQ(random_token().size(), 48U);
  EXPECT_NE(random_token(), random_token());
}

}  // namespace
}  // namespace esim::studio
