#pragma once

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <mutex>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "esim/backends/unrealcv/unreal_pose.h"
#include "esim/render/pinhole_lookup.h"

namespace esim::test {

/// What a client has set.
struct ServedView {
  int width = 64, height = 48;
  double fov_deg = 90;
  UnrealPose camera{};
  std::map<std::string, UnrealPose> objects{};

  Camera model() const { return Camera::from_fov(width, height, fov_deg * std::numbers::pi / 180); }
};

/// A server of UnrealCV's protocol on a separate thread. A function gives its images; it can be told to give wrong
/// answers.
class UnrealcvServer {
 public:
  using Show = std::function<PinholeImage(const ServedView&)>;

  /// What the version of the server offers.
  struct Version {
    bool pose = true, plane_depth = true, npy_light = true, npy_mask = true, horizontal_fieldofview = true;
    bool size = false;  ///< as the newest have, whose depth is planar, in centimetres
  };

  /// May change the bytes that answer a command, and hang up after them.
  using Tamper = std::function<void(const std::string& command, std::string& bytes, bool& hang_up)>;

  explicit UnrealcvServer(Show show, std::vector<std::string> objects = {})
      : UnrealcvServer(show, objects, Version{}) {}
  UnrealcvServer(Show show, std::vector<std::string> objects, Version offered, int port = 0)
      : version(offered), show_(std::move(show)), names_(std::move(objects)) {
    for (const std::string& name : names_) view_.objects[name] = {};
    open(port);
    start();
  }
  ~UnrealcvServer() { stop(); }
  UnrealcvServer(const UnrealcvServer&) = delete;
  UnrealcvServer& operator=(const UnrealcvServer&) = delete;

  int port() const { return port_; }
  int connections() const { return connections_; }
  std::vector<std::string> commands() const {
    const std::lock_guard lock(mutex_);
    return commands_;
  }

  void stop() {
    if (!thread_.joinable()) return;
    is_stopping_ = true;
    thread_.join();
    close_all();
  }

  /// A message as it goes over the wire.
  static std::string framed(const std::string& payload, std::uint32_t magic = 0x9E2B83C1) {
    return little_endian(magic) + little_endian(static_cast<std::uint32_t>(payload.size())) + payload;
  }
  static std::string little_endian(std::uint32_t number) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(number >> 8 * i & 0xFF);
    return bytes;
  }

  /// A NumPy array file.
  static std::string npy(const std::string& type, const std::string& shape, const void* data, std::size_t bytes) {
    std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
    header.resize(118 - 1, ' ');
    return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(118) + '\0' + header + '\n' +
           std::string(static_cast<const char*>(data), bytes);
  }
  template <typename T>
  static std::string npy(const std::string& type, const Image<T>& image) {
    return npy(type, std::to_string(image.height()) + ", " + std::to_string(image.width()), image.data(),
               image.size() * sizeof(T));
  }

  static std::string png(const cv::Mat& image) {
    std::vector<unsigned char> bytes;
    cv::imencode(".png", image, bytes);
    return {bytes.begin(), bytes.end()};
  }

  /// sRGB, with an alpha of 0, as Unreal leaves it.
  static std::string lit_png(const Image<float>& light) {
    cv::Mat image(light.height(), light.width(), CV_8UC4, cv::Scalar(0, 0, 0, 0));
    for (int y = 0; y < light.height(); ++y) {
      for (int x = 0; x < light.width(); ++x) {
        const float e = std::clamp(light(x, y), 0.0F, 1.0F);
        const float coded = e <= 0.0031308F ? 12.92F * e : 1.055F * std::pow(e, 1 / 2.4F) - 0.055F;
        const auto code = static_cast<unsigned char>(std::lround(255 * coded));
        image.at<cv::Vec4b>(y, x) = {code, code, code, 0};
      }
    }
    return png(image);
  }

  // To be set before the first client comes.
  Version version;
  Tamper tamper;
  std::string greeting = "connected to test";
  bool greets = true;
  std::map<std::string, std::string> ready;  ///< answers that are ready, by request: "lit npy"

 private:
  void open(int port) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int on = 1;
    ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 8) != 0)
      throw std::runtime_error("the test's server cannot listen");
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
  }

  void start() {
    thread_ = std::thread([this] {
      while (!is_stopping_) turn();
    });
  }

  void close_all() {
    for (int* socket : {&listener_, &client_}) {
      if (*socket >= 0) ::close(std::exchange(*socket, -1));
    }
  }

  void turn() {
    pollfd sockets[] = {{listener_, POLLIN, 0}, {client_, POLLIN, 0}};
    constexpr int kPatience_ms = 10;
    if (::poll(sockets, client_ < 0 ? 1 : 2, kPatience_ms) <= 0) return;
    if (client_ >= 0 && sockets[1].revents != 0) receive();
    if (sockets[0].revents != 0) accept();
  }

  void accept() {
    const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (socket < 0) return;
    if (client_ >= 0) {  // one at a time
      ::close(socket);
      return;
    }
    const int on = 1;
    ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    client_ = socket;
    ++connections_;
    incoming_.clear();
    if (greets) put(framed(greeting));
  }

  void receive() {
    char bytes[4096];
    const ssize_t count = ::recv(client_, bytes, sizeof bytes, 0);
    if (count <= 0) return hang_up();
    incoming_.append(bytes, static_cast<std::size_t>(count));
    while (client_ >= 0 && incoming_.size() >= 8) {
      std::uint32_t size = 0;
      std::memcpy(&size, incoming_.data() + 4, 4);
      if (incoming_.size() < 8 + size) return;
      const std::string payload = incoming_.substr(8, size);
      incoming_.erase(0, 8 + size);
      handle(payload);
    }
  }

  void handle(const std::string& payload) {
    const std::size_t colon = payload.find(':');
    const std::string id = payload.substr(0, colon), command = payload.substr(colon + 1);
    {
      const std::lock_guard lock(mutex_);
      commands_.push_back(command);
    }
    if (const auto found = ready.find(asked_of_a_camera(command)); found != ready.end()) {
      const auto size = static_cast<std::uint32_t>(id.size() + 1 + found->second.size());
      put(little_endian(0x9E2B83C1) + little_endian(size) + id + ":");
      return put(found->second);
    }
    std::string bytes = framed(id + ":" + answer(command));
    bool ends = false;
    if (tamper) tamper(command, bytes, ends);
    put(bytes);
    if (ends) hang_up();
  }

  /// "lit npy" of "vget /camera/0/lit npy".
  static std::string asked_of_a_camera(const std::string& command) {
    constexpr std::string_view kBefore = "vget /camera/0/";
    return command.starts_with(kBefore) ? command.substr(kBefore.size()) : "";
  }

  void put(const std::string& bytes) {
    for (std::size_t sent = 0; sent < bytes.size() && !is_stopping_;) {
      const ssize_t count = ::send(client_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;
      sent += static_cast<std::size_t>(count);
    }
  }

  void hang_up() {
    if (client_ >= 0) ::close(std::exchange(client_, -1));
  }

  static std::string colour_of(std::size_t object) {
    return "(R=" + std::to_string(object + 1) + ",G=200,B=" + std::to_string(7 * object) + ",A=255)";
  }

  std::string answer(const std::string& command) {
    static const std::regex kCamera("(vget|vset) /camera/0/(\\w+) ?(.*)"), kSize("vrun r.setres (\\d+)x(\\d+)");
    static const std::regex kObject("(vget|vset) /object/(\\w+)/(\\w+) ?(.*)");
    std::smatch match;
    if (std::regex_match(command, match, kCamera)) return of_camera(match[1], match[2], match[3]);
    if (std::regex_match(command, match, kObject)) return of_object(match[1], match[2], match[3], match[4]);
    if (std::regex_match(command, match, kSize) && !version.size) {
      view_.width = std::stoi(match[1]), view_.height = std::stoi(match[2]);
      image_.reset();
      return "ok";
    }
    if (command == "vget /objects") {
      std::string names;
      for (const std::string& name : names_) names += name + " ";
      return names;
    }
    return "error no such command";
  }

  std::string of_camera(const std::string& verb, const std::string& what, const std::string& arguments) {
    const bool sets = verb == "vset";
    std::istringstream numbers(arguments);
    UnrealPose& pose = view_.camera;
    Eigen::Vector3d& p = pose.location_cm;
    const bool is_set = what == "pose" || what == "location" || what == "rotation" || what == "size" || what == "fov" ||
                        what == "horizontal_fieldofview";
    if ((what == "pose" && !version.pose) || (what == "size" && !version.size) ||
        (what == "horizontal_fieldofview" && !version.horizontal_fieldofview) || (what == "fov" && !version.size))
      return "error no such command";
    if (is_set && !sets) return "1 2 3 4 5 6";
    if (is_set) {
      image_.reset();
      if (what == "pose") numbers >> p.x() >> p.y() >> p.z() >> pose.pitch_deg >> pose.yaw_deg >> pose.roll_deg;
      if (what == "location") numbers >> p.x() >> p.y() >> p.z();
      if (what == "rotation") numbers >> pose.pitch_deg >> pose.yaw_deg >> pose.roll_deg;
      if (what == "size") numbers >> view_.width >> view_.height;
      if (what.starts_with("fov") || what.starts_with("hor")) numbers >> view_.fov_deg;
      return numbers.fail() ? "error bad arguments" : "ok";
    }
    return image_answer(what + " " + arguments);
  }

  std::string of_object(const std::string& verb, const std::string& name, const std::string& what,
                        const std::string& arguments) {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end()) return "error Can not find object";
    UnrealPose& pose = view_.objects[name];
    Eigen::Vector3d& p = pose.location_cm;
    std::istringstream numbers(arguments);
    if (what == "color") return colour_of(static_cast<std::size_t>(found - names_.begin()));
    if (verb == "vget") return "0 0 0";
    image_.reset();
    if (what == "location") numbers >> p.x() >> p.y() >> p.z();
    if (what == "rotation") numbers >> pose.pitch_deg >> pose.yaw_deg >> pose.roll_deg;
    return numbers.fail() ? "error bad arguments" : "ok";
  }

  std::string image_answer(const std::string& what) {
    if (!image_) image_ = show_(view_);
    if (what == "lit npy" && version.npy_light) return npy("<f4", image_->irradiance);
    if (what == "lit png") return lit_png(image_->irradiance);
    if (what == "plane_depth npy" && version.plane_depth) return npy("<f4", image_->depth);
    if (what == "depth npy") return npy("<f4", other_depth());
    if (what == "object_mask npy" && version.npy_mask) return npy("<i4", codes());
    if (what == "object_mask png") return mask_png();
    return "error no such image";
  }

  /// Ray length in metres, or planar in centimetres.
  Image<float> other_depth() const {
    Image<float> depth = image_->depth;
    const Camera model = view_.model();
    for (int y = 0; y < depth.height(); ++y) {
      for (int x = 0; x < depth.width(); ++x) {
        const double norm = model.back_project(Eigen::Vector2d(x, y))->bearing.norm();
        depth(x, y) *= version.size ? 100.0F : static_cast<float>(norm);
      }
    }
    return depth;
  }

  Image<std::int32_t> codes() const {
    Image<std::int32_t> codes(image_->irradiance.width(), image_->irradiance.height(), 12345);
    for (std::size_t i = 0; i < codes.size(); ++i) {
      const int object = image_->object.empty() ? 0 : image_->object.data()[i];
      if (object > 0) codes.data()[i] = object | 200 << 8 | 7 * (object - 1) << 16;
    }
    return codes;
  }

  std::string mask_png() const {
    const Image<std::int32_t> all = codes();
    cv::Mat image(all.height(), all.width(), CV_8UC3);
    for (int y = 0; y < all.height(); ++y) {
      for (int x = 0; x < all.width(); ++x) {
        const int code = all(x, y);
        image.at<cv::Vec3b>(y, x) = {static_cast<unsigned char>(code >> 16), static_cast<unsigned char>(code >> 8),
                                     static_cast<unsigned char>(code)};
      }
    }
    return png(image);
  }

  Show show_;
  std::vector<std::string> names_;
  ServedView view_;
  std::optional<PinholeImage> image_;  // of the view, after the first request

  int listener_ = -1, client_ = -1, port_ = 0;
  std::string incoming_;
  mutable std::mutex mutex_;
  std::vector<std::string> commands_;
  std::atomic<int> connections_ = 0;
  std::atomic<bool> is_stopping_ = false;
  std::thread thread_;
};

/// Shows what a renderer that is made for the client's camera shows.
inline UnrealcvServer::Show show_with(std::function<std::unique_ptr<Renderer>(const Camera&)> make,
                                      std::vector<std::string> objects = {}) {
  return [=](const ServedView& view) {
    const Camera model = view.model();
    RenderRequest request;
    request.camera.T_world_body = camera_pose_of(view.camera);
    request.tiles = {{0, 0, model.width, model.height}};
    request.which_objects = true;
    for (const std::string& name : objects) {
      request.objects.emplace_back();
      request.objects.back().T_world_body = actor_pose_of(view.objects.at(name));
    }
    Sample sample;
    make(model)->render(request, sample);
    return PinholeImage{sample.irradiance, sample.depth, sample.object};
  };
}

}  // namespace esim::test
