#include "esim/live/foxglove_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <unordered_set>

#include "esim/core/error.h"
#include "esim/live/foxglove_protocol.h"

namespace esim::inline live {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using Tcp = asio::ip::tcp;
using Failure = beast::error_code;

constexpr std::size_t kMaxClientMessage = std::size_t{1} << 20;  // bytes
constexpr std::size_t kMaxClientChannels = 1000;
constexpr auto kHandshakeTime = std::chrono::seconds(15);
constexpr auto kReportInterval = std::chrono::seconds(1);  // of lost messages

}  // namespace

struct FoxgloveServer::Impl {
  class Client;

  /// A message on its way to clients.
  struct Message {
    std::uint32_t channel;
    TimeNs t;
    std::string payload;
  };

  Impl(const Place& place, const Limits& given, Handlers answers);
  void accept();
  void to_all(const Json& message);

  Limits limits;
  Handlers handlers;
  std::unordered_set<Client*> clients;  // used only by the thread of `io`; outlives it
  asio::io_context io;
  Tcp::acceptor acceptor{io};
  asio::steady_timer pause{io};  // after a failed accept, for example without free descriptors
  std::map<std::uint32_t, Channel> channels;
  std::map<std::uint32_t, std::shared_ptr<const Message>> last;  // of latched channels
  std::mutex advertised_mutex;
  std::vector<Channel> advertised;  // channel i + 1
  std::atomic<std::int64_t> dropped{0};
  std::thread thread;
};

/// One connection, on the thread of `io`.
class FoxgloveServer::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Tcp::socket socket, Impl& server) : stream_(std::move(socket)), server_(server), report_(server.io) {
    server_.clients.insert(this);
  }
  ~Client() { server_.clients.erase(this); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void start() {
    beast::get_lowest_layer(stream_).expires_after(kHandshakeTime);
    http::async_read(beast::get_lowest_layer(stream_), buffer_, upgrade_,
                     [self = shared_from_this()](Failure failure, std::size_t) { self->on_upgrade(failure); });
  }

  void close() {
    report_.cancel();
    beast::get_lowest_layer(stream_).close();
  }

  void send_text(const Json& message) {
    queue(
        {false, {}, std::make_shared<const std::string>(message.dump(-1, ' ', false, Json::error_handler_t::replace))});
  }

  /// Drops the message if too many wait.
  void send(const std::shared_ptr<const Message>& message) {
    for (const auto& [subscription, channel] : subscriptions_)
      if (channel == message->channel) send(subscription, message);
  }

  void send_time(TimeNs t) {
    if (waiting_bytes_ <= server_.limits.queue_bytes)
      queue({true, head_of_time(t), std::make_shared<const std::string>()});
  }

  void send_parameters(const std::vector<Parameter>& parameters) {
    if (!watched_) return;
    const Json list = list_of(parameters, watched_->empty() ? nullptr : &*watched_);
    if (!list.empty()) send_text({{"op", "parameterValues"}, {"parameters", list}});
  }

  bool is_open() const { return open_; }

 private:
  struct Outgoing {
    bool binary;
    std::string head;
    std::shared_ptr<const std::string> body;
  };

  void on_upgrade(Failure failure) {
    if (failure) return close();
    std::string chosen;
    const beast::string_view offered = upgrade_[http::field::sec_websocket_protocol];
    for (const char* name : {"foxglove.sdk.v1", "foxglove.websocket.v1"})
      if (chosen.empty() && offered.find(name) != beast::string_view::npos) chosen = name;
    if (!websocket::is_upgrade(upgrade_) || chosen.empty()) return refuse();
    beast::get_lowest_layer(stream_).expires_never();
    stream_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    stream_.set_option(websocket::stream_base::decorator(
        [chosen](websocket::response_type& response) { response.set(http::field::sec_websocket_protocol, chosen); }));
    stream_.read_message_max(kMaxClientMessage);
    stream_.auto_fragment(false);
    stream_.async_accept(upgrade_, [self = shared_from_this()](Failure error) { self->on_open(error); });
  }

  /// Tells a browser or another program what is expected here.
  void refuse() {
    auto answer = std::make_shared<http::response<http::string_body>>(http::status::upgrade_required, 11);
    answer->set(http::field::content_type, "text/plain");
    answer->set(http::field::upgrade, "websocket");
    answer->body() =
        "This is a server of Foxglove's WebSocket protocol: open it in Foxglove, Lichtblick or PlotJuggler.\n";
    answer->prepare_payload();
    answer->keep_alive(false);
    http::async_write(beast::get_lowest_layer(stream_), *answer,
                      [self = shared_from_this(), answer](Failure, std::size_t) { self->close(); });
  }

  void on_open(Failure failure) {
    if (failure) return close();
    open_ = true;
    send_text(server_info());
    if (!server_.channels.empty()) send_text(advertisement_of(server_.channels));
    read();
  }

  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](Failure failure, std::size_t) {
      if (failure) return self->close();
      const auto data = self->buffer_.cdata();
      const std::string message(static_cast<const char*>(data.data()), data.size());
      self->buffer_.consume(self->buffer_.size());
      self->stream_.got_text() ? self->on_text(message) : self->on_binary(message);
      self->read();
    });
  }

  void complain(const std::string& problem) { send_text({{"op", "status"}, {"level", kError}, {"message", problem}}); }

  void on_text(const std::string& text) {
    const Json message = Json::parse(text, nullptr, false);
    if (!message.is_object() || !message.contains("op") || !message["op"].is_string())
      return complain("a message is not a JSON object with an \"op\"");
    const auto op = message["op"].get<std::string>();
    const auto each = [&](const char* key, const auto& body) {
      if (message.contains(key) && message[key].is_array())
        for (const Json& one : message[key]) body(one);
    };
    if (op == "subscribe") {
      each("subscriptions", [&](const Json& one) { subscribe(number_in(one, "id"), number_in(one, "channelId")); });
    } else if (op == "unsubscribe") {
      each("subscriptionIds", [&](const Json& one) {
        if (one.is_number_unsigned()) subscriptions_.erase(one.get<std::uint32_t>());
      });
    } else if (op == "advertise") {
      each("channels", [&](const Json& one) { add_channel(one); });
    } else if (op == "unadvertise") {
      each("channelIds", [&](const Json& one) {
        if (one.is_number_unsigned()) published_.erase(one.get<std::uint32_t>());
      });
    } else if (op == "getParameters") {
      const std::set<std::string> names = strings_in(message, "parameterNames");
      answer_parameters(message, names.empty() ? nullptr : &names);
    } else if (op == "setParameters") {
      each("parameters", [&](const Json& one) { set_parameter(one); });
      answer_parameters(message, nullptr);
      const std::vector<Parameter> values = server_.handlers.parameters();
      for (Client* client : server_.clients) client->send_parameters(values);
    } else if (op == "subscribeParameterUpdates") {
      watched_ = strings_in(message, "parameterNames");
    } else if (op == "unsubscribeParameterUpdates") {
      watched_.reset();
    } else {
      complain(fmt::format("\"{}\" is not supported", op.substr(0, 100)));
    }
  }

  void subscribe(std::optional<std::uint32_t> id, std::optional<std::uint32_t> channel) {
    if (!id || !channel || !server_.channels.contains(*channel))
      return complain("a subscription names no channel of this server");
    subscriptions_[*id] = *channel;
    const auto latest = server_.last.find(*channel);
    if (latest != server_.last.end()) send(*id, latest->second);
  }

  void add_channel(const Json& one) {
    const auto id = number_in(one, "id");
    const auto text = [&](const char* key) {
      return one.contains(key) && one[key].is_string() ? one[key].get<std::string>() : std::string();
    };
    if (!id || text("topic").empty()) return complain("an advertised channel has no id or no topic");
    if (published_.size() >= kMaxClientChannels) return complain("too many channels are advertised");
    published_[*id] = {text("topic"), text("encoding"), text("schemaName"), {}};
  }

  void set_parameter(const Json& one) {
    if (!one.is_object() || !one.contains("name") || !one["name"].is_string() || !one.contains("value"))
      return complain("a parameter has no name or no value");
    Parameter parameter{one["name"].get<std::string>(), {}};
    if (one["value"].is_boolean()) {
      parameter.value = one["value"].get<bool>();
    } else if (one["value"].is_number()) {
      parameter.value = one["value"].get<double>();
    } else {
      return complain(fmt::format("parameter {}: must be a number, or true or false", parameter.name.substr(0, 100)));
    }
    const std::string problem = server_.handlers.set(parameter);
    if (!problem.empty()) complain(problem);
  }

  void answer_parameters(const Json& request, const std::set<std::string>* only) {
    Json answer = {{"op", "parameterValues"}, {"parameters", list_of(server_.handlers.parameters(), only)}};
    if (request.contains("id") && request["id"].is_string()) answer["id"] = request["id"];
    send_text(answer);
  }

  void on_binary(const std::string& message) {
    if (message.size() < 5 || message[0] != kClientMessageData) return complain("a binary message has an unknown code");
    std::uint32_t id = 0;
    std::memcpy(&id, message.data() + 1, sizeof id);
    const auto channel = published_.find(id);
    if (channel == published_.end()) return complain(fmt::format("channel {} was not advertised", id));
    ClientMessage published = channel->second;
    published.payload = message.substr(5);
    server_.handlers.message(published);
  }

  void send(std::uint32_t subscription, const std::shared_ptr<const Message>& message) {
    if (waiting_bytes_ + message->payload.size() > server_.limits.queue_bytes) {
      ++server_.dropped, ++lost_;
      return report_losses();
    }
    queue({true, head_of_message(subscription, message->t), {message, &message->payload}});
  }

  /// Tells the client once a second.
  void report_losses() {
    if (reporting_) return;
    reporting_ = true;
    report_.expires_after(kReportInterval);
    report_.async_wait([self = shared_from_this()](Failure failure) {
      self->reporting_ = false;
      if (failure) return;
      self->send_text({{"op", "status"},
                       {"level", kWarning},
                       {"message", fmt::format("{} messages were dropped, because this client reads too slowly; "
                                               "subscribe to fewer topics, or lower the speed",
                                               self->lost_)}});
    });
  }

  void queue(Outgoing outgoing) {
    if (!open_) return;
    waiting_bytes_ += outgoing.head.size() + outgoing.body->size();
    waiting_.push_back(std::move(outgoing));
    if (waiting_.size() == 1) write();
  }

  void write() {
    const Outgoing& next = waiting_.front();
    stream_.binary(next.binary);
    const std::array<asio::const_buffer, 2> buffers = {asio::buffer(next.head), asio::buffer(*next.body)};
    stream_.async_write(buffers, [self = shared_from_this()](Failure failure, std::size_t) {
      if (failure) {
        self->open_ = false;
        return self->close();
      }
      const Outgoing& sent = self->waiting_.front();
      self->waiting_bytes_ -= sent.head.size() + sent.body->size();
      self->waiting_.pop_front();
      if (!self->waiting_.empty()) self->write();
    });
  }

  websocket::stream<beast::tcp_stream> stream_;
  Impl& server_;
  beast::flat_buffer buffer_;
  http::request<http::string_body> upgrade_;
  bool open_ = false;
  std::deque<Outgoing> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  // channel of each
  std::map<std::uint32_t, ClientMessage> published_;      // channels of the client, without payload
  std::optional<std::set<std::string>> watched_;          // parameters; empty: all
  asio::steady_timer report_;
  bool reporting_ = false;
  std::int64_t lost_ = 0;
};

FoxgloveServer::Impl::Impl(const Place& place, const Limits& given, Handlers answers)
    : limits(given), handlers(std::move(answers)) {
  Failure failure;
  const auto found = Tcp::resolver(io).resolve(place.host, "", failure);
  if (failure || found.empty()) throw UserError(fmt::format("host {}: cannot resolve this address", place.host));
  const Tcp::endpoint endpoint(found.begin()->endpoint().address(), static_cast<std::uint16_t>(place.port));
  acceptor.open(endpoint.protocol());
  acceptor.set_option(asio::socket_base::reuse_address(true));
  acceptor.bind(endpoint, failure);
  if (!failure) acceptor.listen(asio::socket_base::max_listen_connections, failure);
  if (failure == asio::error::address_in_use)
    throw UserError(fmt::format("port {}: in use by another program; give another one", place.port));
  if (failure)
    throw UserError(fmt::format("cannot listen on {} port {}: {}", place.host, place.port, failure.message()));
}

void FoxgloveServer::Impl::accept() {
  acceptor.async_accept([this](Failure failure, Tcp::socket socket) {
    if (failure == asio::error::operation_aborted) return;
    if (failure) {
      pause.expires_after(std::chrono::milliseconds(100));
      return pause.async_wait([this](Failure stopped) {
        if (!stopped) accept();
      });
    }
    Failure ignored;
    socket.set_option(Tcp::no_delay(true), ignored);
    if (static_cast<int>(clients.size()) < limits.clients) std::make_shared<Client>(std::move(socket), *this)->start();
    accept();
  });
}

void FoxgloveServer::Impl::to_all(const Json& message) {
  for (Client* client : clients)
    if (client->is_open()) client->send_text(message);
}

FoxgloveServer::FoxgloveServer(const Place& place, const Limits& limits, Handlers handlers)
    : impl_(new Impl(place, limits, std::move(handlers))) {
  impl_->accept();
  impl_->thread = std::thread([impl = impl_.get()] { impl->io.run(); });
}

FoxgloveServer::~FoxgloveServer() {
  asio::post(impl_->io, [impl = impl_.get()] {
    Failure ignored;
    impl->acceptor.close(ignored);
    impl->pause.cancel();
    std::vector<std::shared_ptr<Impl::Client>> all;  // closing one may remove it
    for (Impl::Client* client : impl->clients) all.push_back(client->shared_from_this());
    for (const auto& client : all) client->close();
    impl->io.stop();
  });
  impl_->thread.join();
}

int FoxgloveServer::port() const { return impl_->acceptor.local_endpoint().port(); }

std::uint32_t FoxgloveServer::advertise(Channel channel) {
  const std::lock_guard lock(impl_->advertised_mutex);
  std::vector<Channel>& all = impl_->advertised;
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Channel& one) { return one.topic == channel.topic; });
  const auto id = static_cast<std::uint32_t>(found - all.begin() + 1);
  if (found != all.end()) return id;
  all.push_back(channel);
  asio::post(impl_->io, [impl = impl_.get(), id, channel = std::move(channel)]() mutable {
    impl->channels.emplace(id, std::move(channel));
    impl->to_all(advertisement_of({{id, impl->channels.at(id)}}));
  });
  return id;
}

void FoxgloveServer::publish(std::uint32_t channel, TimeNs t, std::string_view payload) {
  auto message = std::make_shared<const Impl::Message>(Impl::Message{channel, t, std::string(payload)});
  asio::post(impl_->io, [impl = impl_.get(), message = std::move(message)] {
    const auto found = impl->channels.find(message->channel);
    if (found == impl->channels.end()) return;
    if (found->second.latched) impl->last[message->channel] = message;
    for (Impl::Client* client : impl->clients)
      if (client->is_open()) client->send(message);
  });
}

void FoxgloveServer::publish_time(TimeNs t) {
  asio::post(impl_->io, [impl = impl_.get(), t] {
    for (Impl::Client* client : impl->clients)
      if (client->is_open()) client->send_time(t);
  });
}

void FoxgloveServer::send_parameters() {
  asio::post(impl_->io, [impl = impl_.get()] {
    const std::vector<Parameter> values = impl->handlers.parameters();
    for (Impl::Client* client : impl->clients)
      if (client->is_open()) client->send_parameters(values);
  });
}

std::int64_t FoxgloveServer::dropped() const { return impl_->dropped; }

}  // namespace esim::inline live
