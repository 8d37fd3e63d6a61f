#pragma once

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "esim/backends/unrealcv/dialect.h"
#include "esim/backends/unrealcv/session.h"
#include "esim/core/parallel.h"

// Private to backends/unrealcv.
namespace esim::inline backends::inline unrealcv {

/// A program with UnrealCV's protocol, of which one camera is moved. The client connects when a view is first waited
/// for, and again if the connection is lost; it then repeats all requests in progress. Several threads may use it.
class UnrealcvClient {
 public:
  explicit UnrealcvClient(UnrealcvOptions options) : options_(std::move(options)) {}

  const UnrealcvOptions& options() const { return options_; }

  /// The answers to commands, before the first view. Connects. Throws EngineError.
  std::vector<std::string> ask(std::vector<std::string> commands);

  /// A view in progress.
  struct Asked {
    EngineView view;
    EngineBatch batch{};
    bool is_wanted = true;
  };

  /// Requests a view; neither waits nor fails.
  std::shared_ptr<Asked> start(EngineView view);

  /// Waits for a view. Light is decoded while depth and objects are being received; `take_geometry` is called in
  /// parallel when these are in the image, and again if the request had to be repeated. Throws EngineError, which names
  /// the host, the port, the request, and what to do.
  void finish(const std::shared_ptr<Asked>& asked, const Workers& workers, PinholeImage& image,
              const std::function<void()>& take_geometry);

  /// Declares that a view is no longer needed.
  void abandon(const std::shared_ptr<Asked>& asked);

 private:
  void submit(Asked& asked);
  void submit_or_lose(Asked& asked);
  void connect(const EngineView& view, SteadyTime give_up);
  enum class Until { light, all };
  void wait_for(const Asked& asked, Until until);
  template <typename Work>
  void until_connected(const Work& work);
  void receive(Asked& asked, const Workers& workers, PinholeImage& image, const std::function<void()>& take_geometry);
  [[noreturn]] void fail_to_connect(const std::string& reason) const;
  void forget_answered();

  UnrealcvOptions options_;
  std::mutex mutex_;
  std::list<std::shared_ptr<Asked>> asked_;  // in the order of the requests; outlive the session
  std::optional<EngineSession> session_;
  std::optional<Dialect> dialect_;
  EngineState state_;
};

}  // namespace esim::inline backends::inline unrealcv
