#include "esim/studio/server/server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <random>
#include <thread>

#include "esim/core/error.h"

namespace esim::studio {
namespace {

using std::chrono::milliseconds;

class Client {
 public:
  explicit Client(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    timeval patience{3, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    connected_ = ::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool connected() const { return connected_; }
  void send(const std::string& text) { ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL); }
  void finish() { ::shutdown(socket_, SHUT_WR); }

  /// All that comes until the server closes, or for three seconds.
  std::string receive() {
    std::string all;
    char part[4096];
    ssize_t got = 0;
    while ((got = ::recv(socket_, part, sizeof part, 0)) > 0) all.append(part, static_cast<std::size_t>(got));
    closed_ = got == 0;
    return all;
  }
  bool closed() const { return closed_; }

 private:
  int socket_;
  bool connected_ = false, closed_ = false;
};

class ServerTest : public testing::Test {
 protected:
  void start(const ServerLimits& limits) {
    server_ = std::make_unique<HttpServer>(HttpServer::Place{"127.0.0.1", 0, 1}, limits);
    server_->start([](const RequestHead&) -> std::optional<Response> { return std::nullopt; },
                   [this](const Request& request) {
                     ++answered_;
                     Response response;
                     response.content_type = "text/plain";
                     response.body = request.method + " " + request.path + " " + std::to_string(request.body.size());
                     return response;
                   });
  }

  std::string answer(const std::string& text) {
    Client client(server_->port());
    client.send(text);
    client.finish();
    return client.receive();
  }

  bool is_well() { return answer("GET /well HTTP/1.1\r\nHost: x\r\n\r\n").find("GET /well 0") != std::string::npos; }

  std::unique_ptr<HttpServer> server_;
  std::atomic<int> answered_ = 0;
};

TEST_F(ServerTest, AnswersOneAfterTheOther) {
  start({});
  const std::string two =
      answer("GET /a%20b?x=1 HTTP/1.1\r\nHost: x\r\n\r\nPOST /c HTTP/1.1\r\nHost: x\r\nContent-Length: 3\r\n\r\nabc");
  EXPECT_NE(two.find("GET /a b 0"), std::string::npos) << two;
  EXPECT_NE(two.find("POST /c 3"), std::string::npos) << two;
  EXPECT_NE(two.find("nosniff"), std::string::npos) << two;
}

TEST_F(ServerTest, WhatIsTooLargeIsRefusedBeforeItIsRead) {
  ServerLimits limits;
  limits.body_bytes = 1000;
  start(limits);
  EXPECT_NE(answer("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 1001\r\n\r\n").find(" 413 "), std::string::npos);
  EXPECT_NE(answer("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 18446744073709551615\r\n\r\n").find(" 413 "),
            std::string::npos);
  EXPECT_NE(answer("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999999999999999\r\n\r\n").find(" 400 "),
            std::string::npos);
  EXPECT_NE(answer("GET / HTTP/1.1\r\nHost: x\r\nX: " + std::string(100'000, 'a') + "\r\n\r\n").find(" 431 "),
            std::string::npos);
  std::string chunks = "POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (int i = 0; i < 20; ++i) chunks += "64\r\n" + std::string(100, 'a') + "\r\n";
  EXPECT_NE(answer(chunks + "0\r\n\r\n").find(" 413 "), std::string::npos);
  EXPECT_EQ(answered_, 0);
  EXPECT_TRUE(is_well());
}

TEST_F(ServerTest, SlowClientsAreLetGo) {
  ServerLimits limits;
  limits.head_time = limits.body_time = milliseconds(200);
  start(limits);
  Client silent(server_->port()), slow(server_->port()), waiting(server_->port());
  slow.send("GET / HTTP/1.1\r\nHo");
  waiting.send("POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 10\r\n\r\nabc");
  for (Client* client : {&silent, &slow, &waiting}) {
    client->receive();
    EXPECT_TRUE(client->closed());
  }
  EXPECT_TRUE(is_well());
  EXPECT_EQ(answered_, 1);
}

TEST_F(ServerTest, ManyConnectionsDoNotGrowIntoMore) {
  ServerLimits limits;
  limits.connections = 8;
  limits.head_time = milliseconds(1000);
  start(limits);
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < 30; ++i) clients.push_back(std::make_unique<Client>(server_->port()));
  std::this_thread::sleep_for(milliseconds(100));
  int closed = 0;
  for (int i = 8; i < 30; ++i) {
    clients[static_cast<std::size_t>(i)]->receive();
    closed += clients[static_cast<std::size_t>(i)]->closed();
  }
  EXPECT_EQ(closed, 22);
  clients.clear();
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_TRUE(is_well());
}

// Random bytes, requests cut anywhere and damaged anywhere.
TEST_F(ServerTest, NonsenseIsRefused) {
  ServerLimits limits;
  limits.head_time = limits.body_time = milliseconds(300);
  start(limits);
  const std::string sound =
      "POST /api/x?a=%41&b HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
      "3;x=y\r\nabc\r\n0\r\n\r\n";
  std::mt19937 random(1);
  for (std::size_t cut = 0; cut <= sound.size(); ++cut) answer(sound.substr(0, cut));
  for (int run = 0; run < 500; ++run) {
    std::string damaged = sound;
    for (unsigned i = 0; i <= random() % 4; ++i) damaged[random() % damaged.size()] = static_cast<char>(random());
    if (run % 5 == 0) {
      damaged.resize(random() % 3000);
      for (char& c : damaged) c = static_cast<char>(random());
    }
    answer(damaged);
  }
  EXPECT_TRUE(is_well());
}

TEST_F(ServerTest, TakesTheNextPortWhereOneIsTaken) {
  start({});
  const int taken = server_->port();
  const HttpServer next({"127.0.0.1", taken, 20});
  EXPECT_GT(next.port(), taken);
  try {
    const HttpServer same({"127.0.0.1", taken, 1});
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("in use by another program"), std::string::npos) << error.what();
  }
  EXPECT_THROW(HttpServer({"no such host", 0, 1}), UserError);
}

TEST_F(ServerTest, StopsWhileSomebodyWaits) {
  start({});
  Client idle(server_->port()), half(server_->port());
  half.send("GET / HT");
  std::this_thread::sleep_for(milliseconds(50));
  const auto start = std::chrono::steady_clock::now();
  server_.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
}

}  // namespace
}  // namespace esim::studio
