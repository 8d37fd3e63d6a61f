#include "esim/backends/unrealcv/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

#include "esim/core/engine_error.h"

namespace esim::inline backends::inline unrealcv {
namespace {

constexpr const char* kOneAtATime = "an UnrealCV server serves one client at a time";
constexpr std::uint32_t kMaxIds = 100'000'000;  // eight digits

/// The id at the beginning of an answer, and the position of its body. Notifications have no id.
std::optional<std::pair<std::uint32_t, std::size_t>> id_of(std::string_view message) {
  constexpr std::size_t kMaxDigits = 8;
  const std::size_t digits = std::min(message.find_first_not_of("0123456789"), message.size());
  if (digits == 0 || digits > kMaxDigits || digits == message.size() || message[digits] != ':') return std::nullopt;
  std::uint32_t id = 0;
  std::from_chars(message.data(), message.data() + digits, id);
  return std::pair{id, digits + 1};
}

}  // namespace

void fail(const UnrealcvOptions& options, const std::string& problem, const std::string& remedy) {
  throw EngineError(fmt::format("{} {}:{}: {}; {}", options.name, options.host, options.port, problem, remedy));
}

EngineSession::EngineSession(const UnrealcvOptions& options, SteadyTime deadline)
    : options_(options), connection_(options.host, options.port, deadline) {
  try {
    require_greeting(deadline);
  } catch (const ProtocolError& error) {
    fail(options, error.what(), "change renderer.host and renderer.port");
  }
}

void EngineSession::require_greeting(SteadyTime deadline) {
  constexpr std::size_t kMaxGreeting = 4096;
  bool came = false;
  try {
    came = connection_.receive(message_, kMaxGreeting, deadline);
  } catch (const ConnectionLost&) {
    throw ConnectionLost(std::string("it closed the connection at once; ") + kOneAtATime);
  }
  if (!came)
    throw ConnectionLost(fmt::format("it sent no greeting within {:g} s; {}", options_.timeout_s, kOneAtATime));
  if (!message_.starts_with("connected")) throw ProtocolError("did not send UnrealCV's greeting");
}

void EngineSession::send(EngineBatch& batch) {
  for (EngineRequest& request : batch) waiting_.push_back(&request);
  send_waiting();
}

void EngineSession::send_waiting() {
  while (!waiting_.empty() && (options_.pipelined || pending_.empty())) {
    last_id_ = (last_id_ + 1) % kMaxIds;
    EngineRequest& request = *waiting_.front();
    waiting_.pop_front();
    pending_[last_id_] = &request;
    connection_.send(fmt::format("{}:{}", last_id_, request.command));
  }
}

/// Assigns an answer to its request; false if the message is not an answer.
bool EngineSession::take(std::string& message) {
  const auto id = id_of(message);
  if (!id) return false;
  const auto found = pending_.find(id->first);
  if (found == pending_.end()) throw ProtocolError(fmt::format("answered request {}, which was not sent", id->first));
  message.erase(0, id->second);
  found->second->answer = std::move(message);
  pending_.erase(found);
  return true;
}

void EngineSession::wait_for(std::span<const EngineRequest> batch) {
  SteadyTime patience = seconds_from_now(options_.timeout_s);
  for (const EngineRequest& request : batch) {
    while (!request.answer) {
      bool is_answer = false, came = false;
      try {
        send_waiting();
        came = connection_.receive(message_, max_bytes_, patience);
        is_answer = came && take(message_);
      } catch (const ProtocolError& error) {
        fail(options_, fmt::format("after the request '{}', it {}", request.command, error.what()),
             "restart it, and check that it is an UnrealCV server");
      }
      if (is_answer) patience = seconds_from_now(options_.timeout_s);
      if (!came || std::chrono::steady_clock::now() >= patience) {
        fail(options_, fmt::format("it did not answer '{}' within {:g} s", request.command, options_.timeout_s),
             "restart it, or increase renderer.timeout_s if it is slow");
      }
    }
  }
}

EngineBatch EngineSession::ask(std::vector<std::string> commands) {
  EngineBatch batch;
  for (std::string& command : commands) batch.push_back({std::move(command)});
  send(batch);
  wait_for(batch);
  return batch;
}

}  // namespace esim::inline backends::inline unrealcv
