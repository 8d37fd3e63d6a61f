#include "esim/studio/server/server.h"

#include <fmt/format.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <thread>
#include <unordered_set>

#include "esim/studio/server/access.h"

namespace esim::studio {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using Tcp = asio::ip::tcp;
using Failure = beast::error_code;

constexpr int kHandlers = 6;  // threads, so that loading a scene does not delay images
constexpr auto kStreamPace = std::chrono::milliseconds(50);
constexpr auto kHeartbeat = std::chrono::seconds(15);

/// The content security policy of every answer: scripts, styles and data come from this server only; three.js passes
/// images of scenes as blobs, and the scripts may contain WebAssembly, which sorts splats.
constexpr const char* kPolicy =
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; img-src 'self' blob: data:; "
    "connect-src 'self' blob: data:; worker-src 'self' blob:; "
    "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

}  // namespace

struct HttpServer::Impl {
  class Session;

  Impl(const Place& place, const ServerLimits& limits);
  void accept();
  void forget(Session& session) { sessions.erase(&session); }

  ServerLimits limits;
  std::unordered_set<Session*>
      sessions;  // used only by the thread of `io`; outlives it, as do the connections that it ends
  asio::io_context io;
  Tcp::acceptor acceptor{io};
  asio::steady_timer pause{io};  // after a failed accept, for example without free descriptors
  asio::thread_pool handlers{kHandlers};
  Admit admit;
  Handle handle;
  std::thread thread;
};

/// One connection. Everything except the handlers runs on the thread of `io`.
class HttpServer::Impl::Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Tcp::socket socket, Impl& server) : stream_(std::move(socket)), server_(server), timer_(server.io) {
    server_.sessions.insert(this);
  }
  ~Session() { server_.forget(*this); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void read_head() {
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(server_.limits.head_bytes));
    parser_->body_limit(server_.limits.body_bytes);
    stream_.expires_after(server_.limits.head_time);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](Failure failure, std::size_t) { self->on_head(failure); });
  }

  void close() {
    Failure ignored;
    timer_.cancel();
    stream_.socket().shutdown(Tcp::socket::shutdown_both, ignored);
    stream_.close();
  }

 private:
  void on_head(Failure failure) {
    if (failure) return refuse(failure);
    const auto& message = parser_->get();
    const auto field = [&](auto name) -> std::optional<std::string> {
      const auto found = message.find(name);
      return found == message.end() ? std::nullopt : std::optional<std::string>(found->value());
    };
    const RequestHead head{
        std::string(message.method_string()), std::string(message.target()), field(http::field::host),
        field(http::field::origin),           field(http::field::cookie),    field(http::field::authorization),
        field(http::field::content_type),     field("Sec-Fetch-Site")};
    if (auto answer = server_.admit(head)) return respond(std::move(*answer), false);
    stream_.expires_after(server_.limits.body_time);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](Failure error, std::size_t) { self->on_body(error); });
  }

  void on_body(Failure failure) {
    if (failure) return refuse(failure);
    stream_.expires_never();
    Request request;
    try {
      request.method = std::string(parser_->get().method_string());
      std::tie(request.path, request.query) =
          parse_target(std::string_view(parser_->get().target().data(), parser_->get().target().size()));
    } catch (const HttpError& error) {
      return respond(refusal(error.status(), error.what()), false);
    }
    request.body = std::move(parser_->get().body());
    const bool keep = parser_->get().keep_alive();
    asio::post(server_.handlers, [self = shared_from_this(), request = std::move(request), keep]() mutable {
      auto response = std::make_shared<Response>(self->server_.handle(request));
      auto& io = self->server_.io;
      asio::post(io, [self = std::move(self), response, keep] { self->respond(std::move(*response), keep); });
    });
  }

  /// Answers an unreadable request if the client can still understand it.
  void refuse(Failure failure) {
    if (failure == http::error::body_limit) return respond(refusal(413, "the request is too large"), false);
    if (failure == http::error::header_limit || failure == http::error::buffer_overflow)
      return respond(refusal(431, "the request's headers are too large"), false);
    const bool cut = failure == http::error::end_of_stream || failure == http::error::partial_message;
    if (!cut && failure.category() == http::make_error_code(http::error::bad_method).category())
      return respond(refusal(400, "invalid HTTP request: " + failure.message()), false);
    close();
  }

  template <typename Message>
  void set_headers(Message& message, const Response& response, bool keep) {
    message.result(static_cast<unsigned>(response.status));
    message.set(http::field::content_type, response.content_type);
    message.set(http::field::cache_control, "no-store");
    message.set("Content-Security-Policy", kPolicy);
    message.set("X-Content-Type-Options", "nosniff");
    message.set("Referrer-Policy", "no-referrer");
    message.set("Cross-Origin-Resource-Policy", "same-origin");
    for (const auto& [name, value] : response.headers) message.set(name, value);
    message.keep_alive(keep);
  }

  void respond(Response response, bool keep) {
    if (response.stream) return stream(std::move(response));
    answer_.emplace();
    answer_->version(11);
    set_headers(*answer_, response, keep);
    answer_->body() = std::move(response.body);
    answer_->prepare_payload();
    stream_.expires_after(server_.limits.write_time);
    http::async_write(stream_, *answer_, [self = shared_from_this(), keep](Failure failure, std::size_t) {
      self->answer_.reset();
      if (failure || !keep) return self->finish();
      self->read_head();
    });
  }

  /// Ends sending and lets the client read the answer: closing at once with unread input would discard it.
  void finish() {
    Failure ignored;
    stream_.socket().shutdown(Tcp::socket::shutdown_send, ignored);
    constexpr auto kLinger = std::chrono::seconds(2);
    stream_.expires_after(kLinger);
    drain();
  }

  void drain() {
    stream_.async_read_some(asio::buffer(waste_), [self = shared_from_this()](Failure failure, std::size_t bytes) {
      constexpr std::size_t kMaxWaste = std::size_t{1} << 20;
      self->wasted_ += bytes;
      if (failure || self->wasted_ > kMaxWaste) return self->close();
      self->drain();
    });
  }

  // --- streams ---

  void stream(Response response) {
    source_ = std::move(response.stream);
    head_.emplace();
    head_->version(11);
    set_headers(*head_, response, false);
    serializer_.emplace(*head_);
    stream_.expires_after(server_.limits.write_time);
    http::async_write_header(stream_, *serializer_, [self = shared_from_this()](Failure failure, std::size_t) {
      if (failure) return self->close();
      self->last_sent_ = std::chrono::steady_clock::now();
      self->pass_on();
    });
  }

  void pass_on() {
    const auto now = std::chrono::steady_clock::now();
    std::optional<std::string> text = source_();
    if (!text) return finish();
    if (text->empty() && now - last_sent_ > kHeartbeat) text = ": still here\n\n";
    if (text->empty()) return wait();
    last_sent_ = now;
    sent_ = std::move(*text);
    stream_.expires_after(server_.limits.write_time);
    asio::async_write(stream_, asio::buffer(sent_), [self = shared_from_this()](Failure failure, std::size_t) {
      if (failure) return self->close();
      self->wait();
    });
  }

  void wait() {
    stream_.expires_never();
    timer_.expires_after(kStreamPace);
    timer_.async_wait([self = shared_from_this()](Failure failure) {
      if (!failure) self->pass_on();
    });
  }

  beast::tcp_stream stream_;
  Impl& server_;
  asio::steady_timer timer_;
  beast::flat_buffer buffer_{std::size_t{128} << 10};
  std::optional<http::request_parser<http::string_body>> parser_;
  std::optional<http::response<http::string_body>> answer_;
  std::array<char, 4096> waste_{};
  std::size_t wasted_ = 0;

  std::function<std::optional<std::string>()> source_;
  std::optional<http::response<http::empty_body>> head_;
  std::optional<http::response_serializer<http::empty_body>> serializer_;
  std::string sent_;
  std::chrono::steady_clock::time_point last_sent_;
};

HttpServer::Impl::Impl(const Place& place, const ServerLimits& bounds) : limits(bounds) {
  Failure failure;
  const Tcp::resolver::results_type found = Tcp::resolver(io).resolve(place.host, "", failure);
  if (failure || found.empty()) throw UserError(fmt::format("--host {}: cannot resolve this address", place.host));
  const asio::ip::address address = found.begin()->endpoint().address();
  for (int i = 0; i < place.ports; ++i) {
    const Tcp::endpoint endpoint(address, static_cast<std::uint16_t>(place.port + i));
    acceptor.open(endpoint.protocol());
    acceptor.set_option(asio::socket_base::reuse_address(true));
    acceptor.bind(endpoint, failure);
    if (!failure) acceptor.listen(asio::socket_base::max_listen_connections, failure);
    if (!failure) return;
    acceptor.close();
    if (failure != asio::error::address_in_use) break;
  }
  if (failure == asio::error::address_in_use) {
    throw UserError(place.ports == 1
                        ? fmt::format("--port {}: in use by another program; give another port, or none", place.port)
                        : fmt::format("ports {} to {}: in use by other programs; give a free port with --port",
                                      place.port, place.port + place.ports - 1));
  }
  throw UserError(fmt::format("cannot listen on {} port {}: {}", place.host, place.port, failure.message()));
}

void HttpServer::Impl::accept() {
  acceptor.async_accept([this](Failure failure, Tcp::socket socket) {
    if (failure == asio::error::operation_aborted) return;
    if (failure) {
      pause.expires_after(std::chrono::milliseconds(100));
      return pause.async_wait([this](Failure stopped) {
        if (!stopped) accept();
      });
    }
    if (static_cast<int>(sessions.size()) < limits.connections)
      std::make_shared<Session>(std::move(socket), *this)->read_head();
    accept();
  });
}

HttpServer::HttpServer(const Place& place, const ServerLimits& limits) : impl_(new Impl(place, limits)) {}

HttpServer::~HttpServer() { stop(); }

int HttpServer::port() const { return impl_->acceptor.local_endpoint().port(); }

void HttpServer::start(Admit admit, Handle handle) {
  impl_->admit = std::move(admit);
  impl_->handle = std::move(handle);
  impl_->accept();
  impl_->thread = std::thread([this] { impl_->io.run(); });
}

void HttpServer::stop() {
  if (!impl_->thread.joinable()) return;
  asio::post(impl_->io, [this] {
    impl_->acceptor.close();
    impl_->pause.cancel();
    for (Impl::Session* session : impl_->sessions) session->close();
  });
  impl_->handlers.join();
  impl_->io.stop();
  impl_->thread.join();
}

}  // namespace esim::studio
