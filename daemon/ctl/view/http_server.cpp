#include "daemon/ctl/view/http_server.hpp"

#include <fmt/core.h>
#include <libwebsockets.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr std::size_t kMaxConnections = 64;
// Connections, those that make room for them, the listening socket, the library's own.
constexpr unsigned kMaxDescriptors = 2 * kMaxConnections + 32;
constexpr unsigned short kMaxHeader = 4096;  // NOLINT(google-runtime-int): the library's type
constexpr int kStallSeconds = 30;
constexpr std::size_t kMaxPiece = 16384;  ///< bytes written at once
constexpr std::size_t kMaxBacklog = 262144;

constexpr std::array<std::pair<const char*, const char*>, 7> kHeaders{{
    {"content-security-policy:",
     "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' "
     "blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"x-content-type-options:", "nosniff"},
    {"x-frame-options:", "DENY"},
    {"referrer-policy:", "no-referrer"},
    {"cross-origin-resource-policy:", "same-origin"},
    {"cross-origin-opener-policy:", "same-origin"},
    {"cache-control:", "no-store"},
}};

std::string header_of(lws* connection, lws_token_indexes token) {
  const int length = lws_hdr_total_length(connection, token);
  if (length <= 0) return {};
  std::vector<char> text(static_cast<std::size_t>(length) + 1);
  const int copied = lws_hdr_copy(connection, text.data(), static_cast<int>(text.size()), token);
  return copied < 0 ? std::string() : std::string(text.data(), static_cast<std::size_t>(copied));
}

/// The library keeps its parts apart.
std::string query_of(lws* connection) {
  std::array<char, kMaxHeader> part{};
  std::string query;
  for (int i = 0; lws_hdr_copy_fragment(connection, part.data(), static_cast<int>(part.size()),
                                        WSI_TOKEN_HTTP_URI_ARGS, i) > 0;
       ++i)
    query += (query.empty() ? "" : "&") + std::string(part.data());
  return query;
}

HttpRequest request_of(lws* connection, std::string path) {
  return {.is_get = lws_hdr_total_length(connection, WSI_TOKEN_GET_URI) > 0,
          .is_post = lws_hdr_total_length(connection, WSI_TOKEN_POST_URI) > 0,
          .path = std::move(path),
          .query = query_of(connection),
          .host = header_of(connection, WSI_TOKEN_HOST),
          .origin = header_of(connection, WSI_TOKEN_ORIGIN),
          .authorization = header_of(connection, WSI_TOKEN_HTTP_AUTHORIZATION)};
}

unsigned char* bytes_of(char* text) {
  return reinterpret_cast<unsigned char*>(text);  // NOLINT(*-reinterpret-cast): the library's type
}

/// False if the connection must be closed.
bool write_head(lws* connection, const HttpReply& reply) {
  std::array<char, LWS_PRE + 2048> buffer{};
  unsigned char* const start = bytes_of(buffer.data() + LWS_PRE);
  unsigned char* const end = bytes_of(buffer.data() + buffer.size() - 1);
  unsigned char* next = start;
  const lws_filepos_t length =
      reply.topic ? LWS_ILLEGAL_HTTP_CONTENT_LEN : static_cast<lws_filepos_t>(reply.body.size());
  if (lws_add_http_common_headers(connection, static_cast<unsigned>(reply.status),
                                  reply.type.c_str(), length, &next, end) != 0)
    return false;
  for (const auto& [name, value] : kHeaders) {
    std::string text(value);
    std::string key(name);
    if (lws_add_http_header_by_name(connection, bytes_of(key.data()), bytes_of(text.data()),
                                    static_cast<int>(text.size()), &next, end) != 0)
      return false;
  }
  return lws_finalize_write_http_header(connection, start, &next, end) == 0;
}

}  // namespace

/// What the library calls back; it stays where it is.
struct HttpServer::State {
  /// A reply on its way, or a stream.
  struct Reply {
    std::string text;
    std::size_t sent = 0;
    std::optional<std::size_t> topic;
    HttpRequest request;     ///< of a stream
    bool is_behind = false;  ///< it has missed something

    [[nodiscard]] std::size_t left() const { return text.size() - sent; }
  };

  /// A connection without a reply on its way.
  struct Waiting {
    lws* connection = nullptr;
    lws_usec_t until = 0;
  };

  /// First, so that the library's timer leads back to the state.
  struct Timer {
    lws_sorted_usec_list_t entry{};
    State* state = nullptr;
  };

  Timer timer;
  Answer answer;
  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  std::map<lws*, Reply> replies;
  std::map<lws*, HttpReply> deferred;  ///< to requests that announce a body
  std::vector<Waiting> waiting;        ///< the oldest first
  std::vector<lws*> closing;           ///< the library closes them later in its turn
  std::size_t connections = 0;         ///< without those
  lws_usec_t period_us = 0;
  lws_usec_t request_us = 0;
  std::function<bool()> on_tick;
  bool is_done = false;
  std::string address;
  std::string name;
  std::array<lws_protocols, 2> protocols{};

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  State(State&&) = delete;
  State& operator=(State&&) = delete;
  ~State() {
    if (context != nullptr) lws_context_destroy(context);
  }

  static int on_event(lws* connection, lws_callback_reasons reason, void* user, void* in,
                      std::size_t length);
  static void on_timer(lws_sorted_usec_list_t* entry);

  /// The library's own timeouts begin anew with each byte.
  void await_request(lws* connection);
  void end_wait(lws* connection);
  void close_longest_waiting();
  void close_overdue();
  /// A connection that asks for nothing makes room for one that may; false if all are in use.
  bool make_room();
  /// The library may still ask about it in the same turn; it is not to be kept by a reply.
  [[nodiscard]] bool is_closing(lws* connection) const {
    return std::ranges::count(closing, connection) > 0;
  }
  /// These return nonzero where the library must close the connection.
  int begin_reply(lws* connection, std::string path);
  int send_deferred(lws* connection);
  int send_reply(lws* connection, HttpReply reply, HttpRequest request);
  int continue_reply(lws* connection);
};

void HttpServer::State::await_request(lws* connection) {
  waiting.push_back({connection, lws_now_usecs() + request_us});
}

void HttpServer::State::end_wait(lws* connection) {
  std::erase_if(waiting, [&](const Waiting& each) { return each.connection == connection; });
}

void HttpServer::State::close_longest_waiting() {
  lws_set_timeout(waiting.front().connection, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
  closing.push_back(waiting.front().connection);
  waiting.erase(waiting.begin());
  --connections;
}

void HttpServer::State::close_overdue() {
  while (!waiting.empty() && waiting.front().until < lws_now_usecs()) close_longest_waiting();
}

bool HttpServer::State::make_room() {
  if (connections < kMaxConnections) return true;
  if (waiting.empty()) return false;
  close_longest_waiting();
  return true;
}

int HttpServer::State::begin_reply(lws* connection, std::string path) {
  HttpRequest request = request_of(connection, std::move(path));
  HttpReply reply = answer(request);
  const bool announces_body =
      request.is_post && lws_hdr_total_length(connection, WSI_TOKEN_HTTP_CONTENT_LENGTH) > 0;
  if (!announces_body) return send_reply(connection, std::move(reply), std::move(request));
  deferred[connection] = std::move(reply);
  return 0;
}

/// The library reads a body first, also an empty one.
int HttpServer::State::send_deferred(lws* connection) {
  auto found = deferred.extract(connection);
  return found.empty() ? -1 : send_reply(connection, std::move(found.mapped()), {});
}

int HttpServer::State::send_reply(lws* connection, HttpReply reply, HttpRequest request) {
  if (!write_head(connection, reply)) return -1;
  end_wait(connection);
  replies[connection] = {.text = std::move(reply.body),
                         .sent = 0,
                         .topic = reply.topic,
                         .request = std::move(request)};
  lws_set_timeout(connection, PENDING_TIMEOUT_HTTP_CONTENT, kStallSeconds);
  lws_callback_on_writable(connection);
  return 0;
}

int HttpServer::State::continue_reply(lws* connection) {
  const auto found = replies.find(connection);
  if (found == replies.end()) return 0;
  Reply& reply = found->second;
  const std::size_t size = std::min(reply.left(), kMaxPiece);
  if (size == 0 && reply.topic) return 0;
  const bool is_last = size == reply.left() && !reply.topic;
  std::vector<char> piece(LWS_PRE + size);
  std::copy_n(reply.text.data() + reply.sent, size, piece.data() + LWS_PRE);
  if (lws_write(connection, bytes_of(piece.data() + LWS_PRE), size,
                is_last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < 0)
    return -1;
  lws_set_timeout(connection, PENDING_TIMEOUT_HTTP_CONTENT, kStallSeconds);
  if (is_last) {
    replies.erase(found);
    await_request(connection);
    return lws_http_transaction_completed(connection) != 0 ? -1 : 0;
  }
  reply.sent += size;
  if (reply.left() == 0) {
    reply.text.clear();
    reply.sent = 0;
  } else {
    lws_callback_on_writable(connection);
  }
  return 0;
}

int HttpServer::State::on_event(lws* connection, lws_callback_reasons reason, void* /*user*/,
                                void* in, std::size_t length) {
  lws_context* const context = connection == nullptr ? nullptr : lws_get_context(connection);
  State* const state =
      context == nullptr ? nullptr : static_cast<State*>(lws_context_user(context));
  if (state == nullptr) return 0;
  switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
      return state->make_room() ? 0 : 1;
    case LWS_CALLBACK_WSI_CREATE:
      ++state->connections;
      state->await_request(connection);
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      state->replies.erase(connection);
      state->deferred.erase(connection);
      state->end_wait(connection);
      if (std::erase(state->closing, connection) == 0 && state->connections > 0)
        --state->connections;
      return 0;
    case LWS_CALLBACK_HTTP:
      if (state->is_closing(connection)) return -1;
      return state->begin_reply(connection, std::string(static_cast<const char*>(in), length));
    case LWS_CALLBACK_HTTP_BODY_COMPLETION:
      return state->is_closing(connection) ? -1 : state->send_deferred(connection);
    case LWS_CALLBACK_HTTP_BODY:
      return length == 0 ? 0 : -1;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
      return -1;
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return state->is_closing(connection) ? -1 : state->continue_reply(connection);
    default:
      return 0;
  }
}

void HttpServer::State::on_timer(lws_sorted_usec_list_t* entry) {
  State* const state = lws_container_of(entry, Timer, entry)->state;
  state->close_overdue();
  state->is_done = !state->on_tick();
  lws_sul_schedule(state->context, 0, entry, &on_timer, state->period_us);
}

HttpServer::HttpServer(std::unique_ptr<State> state) : state_(std::move(state)) {}
HttpServer::HttpServer(HttpServer&&) noexcept = default;
HttpServer& HttpServer::operator=(HttpServer&&) noexcept = default;
HttpServer::~HttpServer() = default;

Result<HttpServer> HttpServer::open(const HttpSettings& settings, Answer answer) {
  lws_set_log_level(0, nullptr);
  auto state = std::make_unique<State>();
  state->timer.state = state.get();
  state->answer = std::move(answer);
  state->address = settings.address;
  state->name = settings.name;
  state->request_us =
      std::chrono::duration_cast<std::chrono::microseconds>(settings.request_time).count();
  state->protocols[0].name = "http-only";
  state->protocols[0].callback = &State::on_event;
  lws_context_creation_info info{};
  info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND;
  info.user = state.get();
  info.protocols = state->protocols.data();
  info.port = settings.port;
  info.iface = state->address.c_str();
  info.server_string = state->name.c_str();
  info.timeout_secs = kStallSeconds;
  info.timeout_secs_ah_idle = kStallSeconds;
  info.keepalive_timeout = kStallSeconds;
  info.max_http_header_data = kMaxHeader;
  info.max_http_header_pool = kMaxDescriptors;  // also for those that are being closed
  info.fd_limit_per_thread = kMaxDescriptors;
  state->context = lws_create_context(&info);
  if (state->context == nullptr) return fail(ErrorCode::kIo, "libwebsockets: cannot be started");
  state->vhost = lws_create_vhost(state->context, &info);
  if (state->vhost == nullptr) {
    return fail(ErrorCode::kIo,
                fmt::format("{} port {}: cannot listen there: in use by another program, or no "
                            "address of this machine (choose another --listen)",
                            settings.address, settings.port));
  }
  return HttpServer(std::move(state));
}

std::uint16_t HttpServer::port() const {
  return static_cast<std::uint16_t>(lws_get_vhost_listen_port(state_->vhost));
}

void HttpServer::serve(Duration period, const std::function<bool()>& on_tick) {
  CREPES_EXPECT(period > Duration{}, "a server ticks at a positive period");
  state_->on_tick = on_tick;
  state_->period_us = std::chrono::duration_cast<std::chrono::microseconds>(period).count();
  state_->is_done = false;
  lws_sul_schedule(state_->context, 0, &state_->timer.entry, &State::on_timer, state_->period_us);
  while (!state_->is_done && lws_service(state_->context, 0) >= 0) {
  }
}

std::size_t HttpServer::readers(std::size_t topic) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      state_->replies,
      [topic](const auto& reply) { return reply.second.topic && *reply.second.topic == topic; }));
}

void HttpServer::publish(std::size_t topic, const std::string& text) {
  for (auto& [connection, reply] : state_->replies) {
    if (!reply.topic || *reply.topic != topic) continue;
    reply.is_behind = reply.is_behind || reply.left() + text.size() > kMaxBacklog;
    if (reply.is_behind && reply.left() > 0) continue;
    if (std::exchange(reply.is_behind, false)) reply.text = state_->answer(reply.request).body;
    reply.text += text;
    lws_callback_on_writable(connection);
  }
}

}  // namespace crepes
