// Sends whatever libFuzzer makes up to the server of `esim studio`, as all that a connection brings: it is answered or
// closed, in bounded memory and time. Requests that know the token and go to port 8391 get past the door, whichever
// port it is; behind it are a folder, a scenario, and a recording that is open.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "esim/studio/studio.h"

namespace {

namespace fs = std::filesystem;

constexpr const char* kToken = "0123456789abcdef";
constexpr std::string_view kUsualPort = ":8391";

void require(bool holds) {
  if (!holds) std::abort();
}

/// The studio, and a folder that is its whole world.
class Server {
 public:
  Server() : folder_(make_folder()), studio_(options()) {
    const std::string url = studio_.url();
    const std::size_t colon = url.rfind(':');
    port_ = url.substr(colon, url.find('/', colon) - colon);
    require(port_.size() == kUsualPort.size());
    send(
        "POST /api/recordings HTTP/1.1\r\nHost: 127.0.0.1:8391\r\nAuthorization: Bearer 0123456789abcdef\r\n"
        "Content-Type: application/json\r\nContent-Length: 29\r\n\r\n{\"path\":\"project/events.txt\"}");
  }
  ~Server() { fs::remove_all(folder_); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Returns when the server has closed the connection.
  void send(std::string bytes) {
    for (std::size_t at = 0; (at = bytes.find(kUsualPort, at)) != std::string::npos; ++at)
      bytes.replace(at, port_.size(), port_);
    const int connection = connect();
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t more = ::send(connection, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (more <= 0) break;  // it has heard enough
      sent += static_cast<std::size_t>(more);
    }
    ::shutdown(connection, SHUT_WR);
    char answer[65536];
    while (::recv(connection, answer, sizeof answer, 0) > 0) {
    }
    ::close(connection);
    tidy();
  }

 private:
  static fs::path make_folder() {
    std::string name = (fs::temp_directory_path() / "esim-fuzz-XXXXXX").string();
    require(::mkdtemp(name.data()) != nullptr);
    const fs::path folder = name;
    fs::create_directories(folder / "page");
    fs::create_directories(folder / "project");
    std::ofstream(folder / "page/index.html") << "<!doctype html>";
    std::ofstream(folder / "project/scene.yaml") << "renderer: {type: plane, image: none.png}\n"
                                                    "trajectory: {type: static}\nduration_s: 1\n"
                                                    "camera: {width: 32, height: 24}\n";
    std::ofstream(folder / "project/events.txt") << "0.001 1 2 1\n0.002 3 4 0\n0.003 15 11 1\n";
    return folder;
  }

  esim::studio::StudioOptions options() const {
    esim::studio::StudioOptions options;
    options.roots = {folder_ / "project"};
    options.pages = folder_ / "page";
    options.token = kToken;
    options.threads = 1;
    return options;
  }

  int connect() const {
    const int connection = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(port_.substr(1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    require(::connect(connection, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    // Closes at once: thousands a second would use up the ports otherwise.
    const linger none{1, 0};
    ::setsockopt(connection, SOL_SOCKET, SO_LINGER, &none, sizeof none);
    return connection;
  }

  /// What has been saved goes again before it is much; nothing may have been saved elsewhere.
  void tidy() const {
    constexpr int kMaxFiles = 20;
    const auto count = [](const fs::path& folder) {
      return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
    };
    require(count(folder_) == 2 && count(folder_ / "page") == 1);
    if (count(folder_ / "project") < kMaxFiles) return;
    for (const auto& entry : fs::directory_iterator(folder_ / "project")) {
      if (entry.path().filename() != "scene.yaml" && entry.path().filename() != "events.txt")
        fs::remove_all(entry.path());
    }
  }

  fs::path folder_;
  esim::studio::Studio studio_;
  std::string port_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Server server;
  server.send({reinterpret_cast<const char*>(data), size});
  return 0;
}
