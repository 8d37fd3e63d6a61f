#include "esim/backends/unrealcv/client.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <exception>
#include <span>
#include <utility>

#include "esim/backends/unrealcv/engine_image.h"
#include "esim/core/error.h"

namespace esim::inline backends::inline unrealcv {
namespace {

using Clock = std::chrono::steady_clock;

bool is_answered(const EngineBatch& batch) {
  return !batch.empty() &&
         std::all_of(batch.begin(), batch.end(), [](const EngineRequest& request) { return request.answer; });
}

}  // namespace

/// Sets a view and requests its images. Throws ConnectionLost.
void UnrealcvClient::submit(Asked& asked) {
  // Four channels of eight bytes for each pixel.
  constexpr std::size_t kPixel = 32;
  session_->expect_up_to(kPixel * static_cast<std::size_t>(asked.view.width) *
                         static_cast<std::size_t>(asked.view.height));
  asked.batch = dialect_->commands_for(asked.view, state_);
  session_->send(asked.batch);
}

std::shared_ptr<UnrealcvClient::Asked> UnrealcvClient::start(EngineView view) {
  const std::lock_guard lock(mutex_);
  forget_answered();
  auto asked = std::make_shared<Asked>(Asked{std::move(view)});
  asked_.push_back(asked);
  if (session_ && dialect_) submit_or_lose(*asked);
  return asked;
}

/// Lost requests are submitted again after the next connection.
void UnrealcvClient::submit_or_lose(Asked& asked) {
  try {
    submit(asked);
  } catch (const ConnectionLost&) {
    session_.reset();
  }
}

void UnrealcvClient::abandon(const std::shared_ptr<Asked>& asked) {
  const std::lock_guard lock(mutex_);
  asked->is_wanted = false;
  if (!session_) asked_.remove(asked);
  forget_answered();
}

/// Requests without an answer are kept, since the session writes their answers.
void UnrealcvClient::forget_answered() {
  asked_.remove_if([](const auto& asked) { return !asked->is_wanted && is_answered(asked->batch); });
}

/// Connects, and repeats requests without an answer.
void UnrealcvClient::connect(const EngineView& view, SteadyTime give_up) {
  if (!session_) session_.emplace(options_, give_up);
  state_ = {};
  if (!dialect_) dialect_.emplace(options_, *session_, view, state_);
  asked_.remove_if([](const auto& asked) { return !asked->is_wanted; });
  for (const auto& asked : asked_) {
    if (!is_answered(asked->batch)) submit(*asked);
  }
}

/// Calls work(deadline of connecting) until the connection is not lost meanwhile.
template <typename Work>
void UnrealcvClient::until_connected(const Work& work) {
  SteadyTime give_up = seconds_from_now(options_.timeout_s);
  while (true) {
    const bool was_connected = session_.has_value();
    try {
      return work(give_up);
    } catch (const ConnectionLost& lost) {
      session_.reset();
      if (const auto why = options_.why_ended())
        fail(options_, *why, "check its messages about the scene, and whether the memory was sufficient");
      if (was_connected) give_up = seconds_from_now(options_.timeout_s);
      const bool is_absent = !dialect_ && dynamic_cast<const ConnectionRefused*>(&lost) != nullptr;
      if (is_absent || Clock::now() >= give_up) fail_to_connect(lost.what());
      constexpr int kBetweenTries_ms = 20;
      ::poll(nullptr, 0, kBetweenTries_ms);
    } catch (...) {
      session_.reset();
      throw;
    }
  }
}

/// Waits for the answers, and connects as often as necessary.
void UnrealcvClient::wait_for(const Asked& asked, Until until) {
  until_connected([&](SteadyTime give_up) {
    if (!session_ || !dialect_) connect(asked.view, give_up);
    const std::size_t later = until == Until::light ? dialect_->images() - 1 : 0;
    session_->wait_for(std::span(asked.batch).first(asked.batch.size() - later));
  });
}

std::vector<std::string> UnrealcvClient::ask(std::vector<std::string> commands) {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> answers;
  until_connected([&](SteadyTime give_up) {
    if (!session_) session_.emplace(options_, give_up);
    for (EngineRequest& request : session_->ask(commands)) answers.push_back(std::move(*request.answer));
  });
  return answers;
}

void UnrealcvClient::fail_to_connect(const std::string& reason) const {
  if (!dialect_) {
    fail(options_, "cannot connect: " + reason, "start the program, or change renderer.host and renderer.port");
  }
  fail(options_,
       fmt::format("the connection was lost ({}) and could not be restored within {:g} s", reason, options_.timeout_s),
       "check why the program ended");
}

/// Waits for a view once. Throws OtherSize. Errors of the connection or the depth take precedence over errors of the
/// light.
void UnrealcvClient::receive(Asked& asked, const Workers& workers, PinholeImage& image,
                             const std::function<void()>& take_geometry) {
  wait_for(asked, Until::light);
  // Moved out, since the batch is replaced if the connection is lost now.
  const EngineRequest light = dialect_->take_light(asked.batch);
  std::exception_ptr failed[2];
  workers.for_each(2, [&](int part) {
    try {
      if (part == 0) return dialect_->decode_light(light, asked.view, image);
      wait_for(asked, Until::all);
      dialect_->decode_geometry(asked.batch, asked.view, image);
      take_geometry();
    } catch (...) {
      failed[part] = std::current_exception();
    }
  });
  for (const int part : {1, 0}) {
    if (failed[part]) std::rethrow_exception(failed[part]);
  }
}

void UnrealcvClient::finish(const std::shared_ptr<Asked>& asked, const Workers& workers, PinholeImage& image,
                            const std::function<void()>& take_geometry) {
  const std::lock_guard lock(mutex_);
  const SteadyTime give_up = seconds_from_now(options_.timeout_s);
  for (bool first = true;; first = false) {
    try {
      receive(*asked, workers, image, take_geometry);
      break;
    } catch (const OtherSize& other) {
      // The window may change its size only after some frames.
      if (!first && Clock::now() >= give_up) {
        fail(options_,
             fmt::format("its image size was set to {} x {} pixels, but it sent images of {} x {} pixels for {:g} s",
                         asked->view.width, asked->view.height, other.width, other.height, options_.timeout_s),
             "allow its window to have any size, or change the size of the camera");
      }
      state_ = {};
      submit_or_lose(*asked);
    }
  }
  asked_.remove(asked);
}

}  // namespace esim::inline backends::inline unrealcv
