#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "esim/live/foxglove_server.h"

// Private to live: includes nlohmann/json.hpp.
/// The messages of Foxglove's WebSocket protocol (github.com/foxglove/ws-protocol, docs/spec.md).
namespace esim::inline live {

using Json = nlohmann::json;

// Codes of binary messages, and levels of status messages.
inline constexpr char kMessageData = 1, kTime = 2, kClientMessageData = 1;
enum StatusLevel { kInfo = 0, kWarning = 1, kError = 2 };

Json server_info();
Json advertisement_of(const std::map<std::uint32_t, Channel>& channels);

/// Values of parameters. `only`: of these names; null: all.
Json list_of(const std::vector<Parameter>& parameters, const std::set<std::string>* only);

/// The beginning of a binary message: its code, and the subscription if it has one, and the time.
std::string head_of_message(std::uint32_t subscription, TimeNs t);
std::string head_of_time(TimeNs t);

/// The strings in a list of a client's message.
std::set<std::string> strings_in(const Json& message, const char* key);

/// A number of 32 bits in an object, if there is one.
std::optional<std::uint32_t> number_in(const Json& object, const char* key);

}  // namespace esim::inline live
