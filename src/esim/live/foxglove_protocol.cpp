#include "esim/live/foxglove_protocol.h"

#include <bit>
#include <limits>

namespace esim::inline live {
namespace {

template <typename T>
void append_number(std::string& out, T value) {
  static_assert(std::endian::native == std::endian::little);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

Json server_info() {
  return {{"op", "serverInfo"},
          {"name", "esim"},
          {"capabilities", {"time", "clientPublish", "parameters", "parametersSubscribe"}},
          {"supportedEncodings", {"cdr", "json"}},
          {"metadata", Json::object()}};
}

Json advertisement_of(const std::map<std::uint32_t, Channel>& channels) {
  Json list = Json::array();
  for (const auto& [id, channel] : channels) {
    list.push_back({{"id", id},
                    {"topic", channel.topic},
                    {"encoding", "cdr"},
                    {"schemaName", channel.schema_name},
                    {"schema", channel.schema},
                    {"schemaEncoding", "ros2msg"}});
  }
  return {{"op", "advertise"}, {"channels", list}};
}

Json list_of(const std::vector<Parameter>& parameters, const std::set<std::string>* only) {
  Json list = Json::array();
  for (const Parameter& parameter : parameters) {
    if (only != nullptr && !only->contains(parameter.name)) continue;
    Json one = {{"name", parameter.name}};
    std::visit([&](const auto& value) { one["value"] = value; }, parameter.value);
    if (std::holds_alternative<double>(parameter.value)) one["type"] = "float64";
    list.push_back(std::move(one));
  }
  return list;
}

std::string head_of_message(std::uint32_t subscription, TimeNs t) {
  std::string head(1, kMessageData);
  append_number(head, subscription);
  append_number(head, static_cast<std::uint64_t>(t));
  return head;
}

std::string head_of_time(TimeNs t) {
  std::string head(1, kTime);
  append_number(head, static_cast<std::uint64_t>(t));
  return head;
}

std::set<std::string> strings_in(const Json& message, const char* key) {
  std::set<std::string> strings;
  if (!message.contains(key) || !message[key].is_array()) return strings;
  for (const Json& one : message[key])
    if (one.is_string()) strings.insert(one.get<std::string>());
  return strings;
}

std::optional<std::uint32_t> number_in(const Json& object, const char* key) {
  if (!object.is_object() || !object.contains(key) || !object[key].is_number_unsigned()) return std::nullopt;
  const auto number = object[key].get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

}  // namespace esim::inline live
