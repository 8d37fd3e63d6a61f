#pragma once

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "esim/backends/unrealcv/dialect.h"
#include "esim/backends/unrealcv/session.h"
#include "esim/core/parallel.h"

namespace esim {

/// A program that speaks UnrealCV's protocol, of which one camera is sent about. It is connected to when it is first
/// waited for, and again when the connection is lost: then it is told and asked anew what is under way. May be used by
/// several threads.
class UnrealcvClient {
 public:
  explicit UnrealcvClient(UnrealcvOptions options) : options_(std::move(options)) {}

  const UnrealcvOptions& options() const { return options_; }

  /// A view that is under way.
  struct Asked {
    EngineView view;
    EngineBatch batch{};
    bool is_wanted = true;
  };

  /// Asks for a view; neither waits nor fails.
  std::shared_ptr<Asked> start(EngineView view);

  /// Waits for it. Light is decoded while depth and objects are on their way; meanwhile `take_geometry` is called, once
  /// these are in the image, and again where the program had to be asked again. Throws EngineError naming the host, the
  /// port, what was asked, and what to do.
  void finish(const std::shared_ptr<Asked>& asked, const Workers& workers, PinholeImage& image,
              const std::function<void()>& take_geometry);

  /// It need not be finished.
  void abandon(const std::shared_ptr<Asked>& asked);

 private:
  void submit(Asked& asked);
  void submit_or_lose(Asked& asked);
  void connect(const EngineView& view, SteadyTime give_up);
  enum class Until { light, all };
  void wait_for(const Asked& asked, Until until);
  void receive(Asked& asked, const Workers& workers, PinholeImage& image, const std::function<void()>& take_geometry);
  [[noreturn]] void fail_to_connect(const std::string& reason) const;
  void forget_answered();

  UnrealcvOptions options_;
  std::mutex mutex_;
  std::list<std::shared_ptr<Asked>> asked_;  // in the order in which the program is told of them; outlive the session
  std::optional<EngineSession> session_;
  std::optional<Dialect> dialect_;
  EngineState state_;
};

}  // namespace esim
