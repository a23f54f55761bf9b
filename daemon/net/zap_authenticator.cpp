#include "daemon/net/zap_authenticator.hpp"

#include <array>
#include <string>
#include <vector>

#include <zmq.h>

#include "daemon/system/clock.hpp"
#include "proto/frame/time.hpp"

namespace posed::net {
namespace {

constexpr std::size_t kKey = 32;  // bytes of a CURVE key

std::optional<Domain> domain_of(std::string_view name) {
  for (const Domain domain : {Domain::kPublish, Domain::kControl}) {
    if (name == domain_name(domain)) return domain;
  }
  return std::nullopt;
}

std::string to_z85(const std::string& key) {
  std::array<char, 41> z85{};
  const auto* raw = reinterpret_cast<const std::uint8_t*>(key.data());
  return zmq_z85_encode(z85.data(), raw, kKey) == nullptr ? std::string() : std::string(z85.data());
}

constexpr const char* kZapEndpoint = "inproc://zeromq.zap.01";
constexpr long kPause_ms = 50;
constexpr std::size_t kMaxRequestParts = 16;  // parts; RFC 27 needs 7 for CURVE

// All parts of one message; parts beyond kMaxRequestParts are dropped.
std::vector<std::string> read_parts(void* handler, Message& part) {
  std::vector<std::string> parts;
  do {
    if (parts.size() < kMaxRequestParts) parts.emplace_back(part.text());
  } while (part.more() && part.receive(handler, 0));
  return parts;
}

}  // namespace

// version, request id, domain, address, routing id, mechanism, credentials...
std::optional<ZapRequest> read_zap_request(std::span<const std::string> parts) {
  if (parts.size() < 6 || parts[0] != "1.0") return std::nullopt;
  ZapRequest request{
      .id = parts[1], .mechanism = parts[5], .key_z85 = {}, .domain = domain_of(parts[2])};
  if (request.mechanism == "CURVE" && parts.size() == 7 && parts[6].size() == kKey) {
    request.key_z85 = to_z85(parts[6]);
  }
  return request;
}

Result<std::unique_ptr<ZapAuthenticator>> ZapAuthenticator::start(void* context,
                                                                  std::optional<AccessList> list) {
  auto handler = open_socket(context, ZMQ_REP);
  auto stop_in = open_socket(context, ZMQ_PAIR);
  auto stop_out = open_socket(context, ZMQ_PAIR);
  for (const auto* socket : {&handler, &stop_in, &stop_out}) {
    if (!*socket) return std::unexpected(socket->error());
  }
  const std::string bell = "inproc://posed.authenticator";
  if (auto done = bind_socket(handler->get(), kZapEndpoint); !done) {
    return fail("this ZeroMQ context has an authenticator already");
  }
  TRY(bind_socket(stop_in->get(), bell));
  TRY(connect_socket(stop_out->get(), bell));
  return std::unique_ptr<ZapAuthenticator>(new ZapAuthenticator(
      std::move(*handler), std::move(*stop_in), std::move(*stop_out), std::move(list)));
}

ZapAuthenticator::ZapAuthenticator(Socket handler, Socket stop_in, Socket stop_out,
                                   std::optional<AccessList> list)
    : handler_(std::move(handler)),
      stop_in_(std::move(stop_in)),
      stop_out_(std::move(stop_out)),
      list_(std::move(list)),
      thread_([this] { serve(); }) {}

ZapAuthenticator::~ZapAuthenticator() {
  zmq_send(stop_out_.get(), "", 0, 0);
  thread_.join();
}

bool ZapAuthenticator::replace(AccessList list) {
  const std::scoped_lock lock(mutex_);
  if (!list_) return false;
  const bool revokes = list_->revokes_any(list, Domain::kPublish);
  list_ = std::move(list);
  return revokes;
}

bool ZapAuthenticator::allows(std::string_view user_id, Domain domain) const {
  const std::scoped_lock lock(mutex_);
  return !list_ || list_->find(user_id, domain) != nullptr;
}

void ZapAuthenticator::serve() {
  std::array<zmq_pollitem_t, 2> wait{
      {{handler_.get(), 0, ZMQ_POLLIN, 0}, {stop_in_.get(), 0, ZMQ_POLLIN, 0}}};
  for (;;) {
    if (zmq_poll(wait.data(), 2, -1) < 0) {
      if (zmq_errno() == EINTR) continue;
      return;  // the context is being terminated
    }
    if ((wait[1].revents & ZMQ_POLLIN) != 0) return;
    Message part;
    if ((wait[0].revents & ZMQ_POLLIN) != 0 && part.receive(handler_.get())) {
      answer(part);
      pause();
    }
  }
}

void ZapAuthenticator::slow_down() noexcept {
  slow_until_ns_.store(system::monotonic_ns() + kNanosPerSecond);
}

// Requests that come meanwhile wait in the socket; only the stop message is read.
void ZapAuthenticator::pause() {
  if (system::monotonic_ns() >= slow_until_ns_.load()) return;
  zmq_pollitem_t bell{stop_in_.get(), 0, ZMQ_POLLIN, 0};
  zmq_poll(&bell, 1, kPause_ms);
}

bool ZapAuthenticator::welcomes(const ZapRequest& request) const {
  if (!request.domain) return false;
  const std::scoped_lock lock(mutex_);
  if (!list_) return request.mechanism == "NULL";
  return !request.key_z85.empty() && list_->find(request.key_z85, *request.domain) != nullptr;
}

void ZapAuthenticator::answer(Message& part) {
  const auto request = read_zap_request(read_parts(handler_.get(), part));
  const bool welcome = request && welcomes(*request);
  if (!welcome) refused_.fetch_add(1);
  // version, request id, status, text, user id, metadata
  const std::array<std::string_view, 6> reply{"1.0",
                                              request ? std::string_view(request->id) : "",
                                              welcome ? "200" : "400",
                                              welcome ? "welcome" : "not on the allow-list",
                                              welcome ? std::string_view(request->key_z85) : "",
                                              ""};
  for (std::size_t i = 0; i < reply.size(); ++i) {
    (void)send_part(handler_.get(), reply[i], i + 1 < reply.size());
  }
}

}  // namespace posed::net
