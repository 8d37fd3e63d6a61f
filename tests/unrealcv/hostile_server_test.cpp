// Servers that are slow, broken or missing: each gives one clear error, in time.
#include <chrono>

#include "unrealcv/shown.h"

namespace esim {
namespace {

using test::UnrealcvServer;

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

class HostileServer : public testing::Test {
 protected:
  static constexpr double kTimeout_s = 0.4;

  /// The error for the current server; checks that it comes in time: the connection, the first answers and the image
  /// may each take the complete timeout.
  std::string problem(const Camera& camera = test::small_camera()) {
    UnrealcvOptions options = test::options_for(*server_, kTimeout_s);
    options.objects = objects_;
    const auto renderer = test::renderer_for(options, camera);
    RenderRequest request{0, {}, {{0, 0, camera.width, camera.height}}, std::vector<Kinematics>(objects_.size())};
    Sample sample;
    const double start = now_s();
    const std::string message = test::message_of<EngineError>([&] { renderer->render(request, sample); });
    EXPECT_LT(now_s() - start, 3 * kTimeout_s + 2);
    EXPECT_TRUE(test::contains(message, "unrealcv 127.0.0.1:" + std::to_string(server_->port())));
    EXPECT_TRUE(test::contains(message, "; ")) << "what to do";
    return message;
  }

  /// The same with a manipulated answer.
  std::string problem_of(const std::string& part, const UnrealcvServer::Tamper& tamper) {
    server_.emplace(test::show_ramp, objects_);
    server_->tamper = [=](const std::string& command, std::string& bytes, bool& hang_up) {
      if (command.find(part) != std::string::npos) tamper(command, bytes, hang_up);
    };
    return problem();
  }

  /// The same with another body of an answer.
  std::string problem_of_body(const std::string& part, const std::string& body) {
    return problem_of(part, [=](const std::string&, std::string& bytes, bool&) {
      const std::string payload = bytes.substr(8);
      bytes = UnrealcvServer::framed(payload.substr(0, payload.find(':') + 1) + body);
    });
  }

  std::vector<std::string> objects_;
  std::optional<UnrealcvServer> server_;
};

TEST_F(HostileServer, NobodyListens) {
  server_.emplace(test::show_ramp);
  server_->stop();
  const std::string message = problem();
  EXPECT_TRUE(test::contains(message, "refused"));
  EXPECT_TRUE(test::contains(message, "renderer.host"));
}

TEST_F(HostileServer, NobodyCanBeReached) {
  UnrealcvOptions options;
  options.host = "192.0.2.1";  // of no network
  options.timeout_s = 0.3;
  const double start = now_s();
  Sample sample;
  const std::string message = test::message_of<EngineError>([&] {
    test::renderer_for(options, test::small_camera())->render({0, {}, {{0, 0, 32, 24}}}, sample);
  });
  EXPECT_LT(now_s() - start, 2.5);
  EXPECT_TRUE(test::contains(message, "192.0.2.1:9000: cannot connect: "));
}

TEST_F(HostileServer, NoSuchHost) {
  UnrealcvOptions options;
  options.host = "no-such-host.invalid";
  Sample sample;
  const std::string message = test::message_of<EngineError>([&] {
    test::renderer_for(options, test::small_camera())->render({0, {}, {{0, 0, 32, 24}}}, sample);
  });
  EXPECT_TRUE(test::contains(message, "no such host"));
}

TEST_F(HostileServer, NoGreeting) {
  server_.emplace(test::show_ramp);
  server_->greets = false;
  EXPECT_TRUE(test::contains(problem(), "sent no greeting within 0.4 s"));
}

TEST_F(HostileServer, AnotherGreeting) {
  server_.emplace(test::show_ramp);
  server_->greeting = "220 mail.example ESMTP";
  EXPECT_TRUE(test::contains(problem(), "did not send UnrealCV's greeting"));
}

TEST_F(HostileServer, AnotherClientIsThere) {
  server_.emplace(test::show_ramp);
  const Camera camera = test::small_camera();
  const auto first = test::renderer_for(test::options_for(*server_), camera);
  test::render(*first, camera, {});
  EXPECT_TRUE(test::contains(problem(), "one client at a time"));
  test::render(*first, camera, {});  // continues
}

TEST_F(HostileServer, NoAnswer) {
  for (const char* command : {"vget /camera/0/location", "vget /camera/0/plane_depth npy"}) {
    const std::string message =
        problem_of(command, [](const std::string&, std::string& bytes, bool&) { bytes.clear(); });
    EXPECT_TRUE(test::contains(message, std::string("did not answer '") + command));
    EXPECT_TRUE(test::contains(message, "within 0.4 s"));
    EXPECT_TRUE(test::contains(message, "renderer.timeout_s"));
  }
}

TEST_F(HostileServer, NotificationsAreNoAnswers) {
  // An endless sequence of them instead of an answer. Before answers they are harmless: see the next test.
  const std::string message = problem_of("lit npy", [](const std::string&, std::string& bytes, bool&) {
    bytes.clear();
    for (int i = 0; i < 20000; ++i) bytes += UnrealcvServer::framed("something has happened: 7");
  });
  EXPECT_TRUE(test::contains(message, "did not answer"));
}

TEST_F(HostileServer, NotificationsDoNoHarm) {
  server_.emplace(test::show_ramp);
  server_->tamper = [](const std::string&, std::string& bytes, bool&) {
    bytes = UnrealcvServer::framed("12345678901: too long for an id") + UnrealcvServer::framed("level loaded") +
            UnrealcvServer::framed("") + bytes;
  };
  const Camera camera = test::small_camera();
  const Sample sample = test::render(*test::renderer_for(test::options_for(*server_), camera), camera, {});
  EXPECT_FLOAT_EQ(sample.depth(0, 0), 2);
}

TEST_F(HostileServer, CutOffMessages) {
  for (const std::size_t keep : {0U, 3U, 8U, 11U, 1000U}) {
    const std::string message = problem_of(
        "lit npy", [=](const std::string&, std::string& bytes, bool&) { bytes.resize(std::min(bytes.size(), keep)); });
    const bool silent = test::contains(message, "did not answer");
    EXPECT_TRUE(silent || test::contains(message, "wrong magic number")) << "of the next message: " << message;
  }
}

TEST_F(HostileServer, WrongFraming) {
  EXPECT_TRUE(
      test::contains(problem_of("lit npy", [](const std::string&, std::string& bytes, bool&) { bytes[0] = 'H'; }),
                     "wrong magic number"));
  const std::string huge = problem_of("lit npy", [](const std::string&, std::string& bytes, bool&) {
    bytes = UnrealcvServer::little_endian(0x9E2B83C1) + UnrealcvServer::little_endian(0xFFFFFFF0) + "1:";
  });
  EXPECT_TRUE(test::contains(huge, "announced a message of 4294967280 bytes"));
  EXPECT_TRUE(test::contains(problem_of("lit npy", [](const std::string&, std::string& bytes,
                                                      bool&) { bytes = UnrealcvServer::framed("4711:ok"); }),
                             "answered request 4711, which was not sent"));
}

TEST_F(HostileServer, Refusals) {
  std::string message = problem_of_body("vset /camera/0/pose", "error cannot move");
  EXPECT_TRUE(test::contains(message, "the answer to 'vset /camera/0/pose "));
  EXPECT_TRUE(test::contains(message, "is 'error cannot move'"));
  message = problem_of_body("vget /camera/0/location", "error Invalid sensor id");
  EXPECT_TRUE(test::contains(message, "renderer.camera"));
  message = problem_of_body("depth npy", "error out of memory");
  EXPECT_TRUE(test::contains(message, "depth npy'"));
  EXPECT_TRUE(test::contains(message, "error out of memory"));
}

TEST_F(HostileServer, NoFieldOfView) {
  server_.emplace(test::show_ramp);
  server_->version.horizontal_fieldofview = false;
  EXPECT_TRUE(test::contains(problem(), "has no command that changes the field of view"));
}

TEST_F(HostileServer, NumbersThatAreNone) {
  const Camera camera = test::small_camera();
  Image<float> light(camera.width, camera.height, 0.5F), depth(camera.width, camera.height, 1.0F);
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    light(3, 2) = bad;
    const std::string message = problem_of_body("lit npy", UnrealcvServer::npy("<f4", light));
    EXPECT_TRUE(test::contains(message, "has light values that are not finite (first in column 3, row 2)"));
    EXPECT_TRUE(test::contains(message, "vget /camera/0/lit npy"));
  }
  for (const float bad : {std::nanf(""), -1.0F, -std::numeric_limits<float>::infinity()}) {
    depth(5, 7) = bad;
    EXPECT_TRUE(test::contains(problem_of_body("depth npy", UnrealcvServer::npy("<f4", depth)),
                               "has depths that are negative or not numbers (first in column 5, row 7)"));
  }
}

TEST_F(HostileServer, OtherSizes) {
  const Image<float> small(16, 12, 1.0F);
  const std::string message = problem_of_body("depth npy", UnrealcvServer::npy("<f4", small));
  EXPECT_TRUE(test::contains(message, "was set to 32 x 24 pixels, but it sent images of 16 x 12"));
  std::string vast = UnrealcvServer::npy("<f4", "4294967296, 4294967296", small.data(), 4);
  EXPECT_TRUE(test::contains(problem_of_body("depth npy", vast), "4294967296 x 4294967296"));
  vast = UnrealcvServer::npy("<f4", "18446744073709551616, 2", small.data(), 4);
  EXPECT_TRUE(test::contains(problem_of_body("depth npy", vast), "its shape is invalid"));
}

TEST_F(HostileServer, DamagedImages) {
  const Camera camera = test::small_camera();
  const PinholeImage image = test::show_ramp({camera.width, camera.height});
  const std::string npy = UnrealcvServer::npy("<f4", image.depth);
  EXPECT_TRUE(test::contains(problem_of_body("depth npy", npy.substr(0, npy.size() - 1)), "is cut off"));
  EXPECT_TRUE(test::contains(problem_of_body("depth npy", npy.substr(0, 40)), "ends within its header"));
  EXPECT_TRUE(test::contains(problem_of_body("depth npy", ""), "is not an image"));
  EXPECT_TRUE(test::contains(problem_of_body("depth npy", "saved to /tmp/depth.npy"), "saved to /tmp/depth.npy"));
  const std::vector<std::pair<std::string, const char*>> headers = {
      {UnrealcvServer::npy("<c8", "24, 32", npy.data(), 3072), "numbers of type <c8"},
      {UnrealcvServer::npy(">f4", "24, 32", npy.data(), 3072), "numbers of type >f4"},
      {UnrealcvServer::npy("<i4", "24, 32", npy.data(), 3072), "must contain depth as 32- or 64-bit"},
      {UnrealcvServer::npy("<f4", "768,", npy.data(), 3072), "is not an array of height x width"},
      {UnrealcvServer::npy("<f4", "24, 32, 9", npy.data(), 3072), "is not an array of height x width"},
      {UnrealcvServer::npy("<f4", "24, x", npy.data(), 3072), "its shape is invalid"}};
  for (const auto& [body, part] : headers) EXPECT_TRUE(test::contains(problem_of_body("depth npy", body), part));

  // PNG, if it is requested.
  server_.emplace(test::show_ramp, objects_, UnrealcvServer::Version{.npy_light = false});
  server_->tamper = [](const std::string& command, std::string& bytes, bool&) {
    if (command.find("lit png") != std::string::npos)
      for (std::size_t i = 60; i < bytes.size(); ++i) bytes[i] = 'x';
  };
  EXPECT_TRUE(test::contains(problem(), "cannot be decoded: it is damaged"));
}

TEST_F(HostileServer, RandomDamageIsNeverMoreThanAnError) {
  // In every byte of the image's header and of its frame. The image may survive, or the server may seem silent.
  const Camera camera = test::small_camera();
  int errors = 0;
  for (std::size_t at = 12; at < 140; at += 9) {
    server_.emplace(test::show_ramp);
    server_->tamper = [at](const std::string& command, std::string& bytes, bool&) {
      if (command.find("plane_depth") != std::string::npos) bytes[at] = static_cast<char>(bytes[at] ^ (1 + at % 255));
    };
    UnrealcvOptions options = test::options_for(*server_, 0.1);
    options.depth = EngineDepth::plane_depth;
    const auto renderer = test::renderer_for(options, camera);
    errors += test::message_of<EngineError>([&] { test::render(*renderer, camera, {}); }) != "nothing was thrown";
  }
  EXPECT_GT(errors, 5);
}

TEST_F(HostileServer, ObjectsThatItDoesNotKnow) {
  server_.emplace(test::show_ramp, std::vector<std::string>{"ball", "cup"});
  objects_ = {"ball", "cube"};
  const std::string message = problem();
  EXPECT_TRUE(test::contains(message, "'vget /object/cube/color' is 'error Can not find object'"));
  EXPECT_TRUE(test::contains(message, "ball cup"));
}

TEST_F(HostileServer, ObjectsWithoutColours) {
  objects_ = {"ball", "cube"};
  EXPECT_TRUE(test::contains(problem_of_body("/color", "unpainted"), "renderer.object_mask: none"));
  EXPECT_TRUE(test::contains(problem_of_body("/color", "(R=1,G=2,B=3,A=255)"), "have the same colour"));
}

TEST_F(HostileServer, RefusesViewsThatArePinholesNot) {
  Camera camera = test::small_camera();
  camera.fx = camera.fy = 12.29;
  camera.distortion = Equidistant{};
  server_.emplace(test::show_ramp);
  const std::string message =
      test::message_of<UserError>([&] { test::renderer_for(test::options_for(*server_), camera); });
  EXPECT_TRUE(test::contains(message, "unrealcv: the field of view is too wide for a pinhole image"));
}

}  // namespace
}  // namespace esim
