#include "daemon/control/gatekeeper.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace posed::control {
namespace {

constexpr const char* kZapEndpoint = "inproc://zeromq.zap.01";
constexpr std::size_t kLongestRequest = 16;  // parts; RFC 27 needs 7 for CURVE

// version, request id, domain, address, routing id, mechanism, credentials...
struct ZapRequest {
  std::string version, id, domain, mechanism, credentials;
};

// Reads all parts of one message; nullopt when it is no request of RFC 27.
std::optional<ZapRequest> read_request(void* door, Message& part) {
  std::vector<std::string> parts;
  bool whole = true;
  for (;;) {
    if (parts.size() < kLongestRequest) parts.emplace_back(part.text());
    if (!part.more()) break;
    if (!part.receive(door, 0)) {
      whole = false;
      break;
    }
  }
  if (!whole || parts.size() < 6) return std::nullopt;
  ZapRequest request{parts[0], parts[1], parts[2], parts[5], {}};
  if (parts.size() == 7) request.credentials = parts[6];
  return request;
}

std::optional<Domain> domain_of(std::string_view name) {
  for (const Domain domain : {Domain::kPublish, Domain::kControl}) {
    if (name == domain_name(domain)) return domain;
  }
  return std::nullopt;
}

// The client key of a CURVE request in Z85; empty for any other mechanism.
std::string key_of(const ZapRequest& request) {
  std::array<char, 41> z85{};
  if (request.mechanism != "CURVE" || request.credentials.size() != 32) return {};
  const auto* raw = reinterpret_cast<const std::uint8_t*>(request.credentials.data());
  return zmq_z85_encode(z85.data(), raw, 32) == nullptr ? std::string{} : std::string(z85.data());
}

}  // namespace

Result<std::unique_ptr<Gatekeeper>> Gatekeeper::start(void* context,
                                                      std::optional<AccessList> list) {
  auto door = open_socket(context, ZMQ_REP);
  auto stop_in = open_socket(context, ZMQ_PAIR);
  auto stop_out = open_socket(context, ZMQ_PAIR);
  for (const auto* socket : {&door, &stop_in, &stop_out}) {
    if (!*socket) return std::unexpected(socket->error());
  }
  const std::string bell = "inproc://posed.gatekeeper";
  if (auto done = bind_socket(door->get(), kZapEndpoint); !done) {
    return fail("this ZeroMQ context has a gatekeeper already");
  }
  if (auto done = bind_socket(stop_in->get(), bell); !done) return std::unexpected(done.error());
  if (auto done = connect_socket(stop_out->get(), bell); !done) {
    return std::unexpected(done.error());
  }
  return std::unique_ptr<Gatekeeper>(
      new Gatekeeper(std::move(*door), std::move(*stop_in), std::move(*stop_out), std::move(list)));
}

Gatekeeper::Gatekeeper(Socket door, Socket stop_in, Socket stop_out, std::optional<AccessList> list)
    : door_(std::move(door)),
      stop_in_(std::move(stop_in)),
      stop_out_(std::move(stop_out)),
      list_(std::move(list)),
      thread_([this] { serve(); }) {}

Gatekeeper::~Gatekeeper() {
  zmq_send(stop_out_.get(), "", 0, 0);
  thread_.join();
}

Gatekeeper::Change Gatekeeper::replace(AccessList list) {
  const std::scoped_lock lock(mutex_);
  if (!list_) return {};
  const Change change{list_->loses_someone(list, Domain::kPublish)};
  list_ = std::move(list);
  return change;
}

bool Gatekeeper::allows(std::string_view user_id, Domain domain) const {
  const std::scoped_lock lock(mutex_);
  return !list_ || list_->find(user_id, domain) != nullptr;
}

void Gatekeeper::serve() {
  std::array<zmq_pollitem_t, 2> wait{
      {{door_.get(), 0, ZMQ_POLLIN, 0}, {stop_in_.get(), 0, ZMQ_POLLIN, 0}}};
  for (;;) {
    if (zmq_poll(wait.data(), 2, -1) < 0) {
      if (zmq_errno() == EINTR) continue;
      return;  // the context is going
    }
    if ((wait[1].revents & ZMQ_POLLIN) != 0) return;
    Message part;
    if ((wait[0].revents & ZMQ_POLLIN) != 0 && part.receive(door_.get())) answer(part);
  }
}

bool Gatekeeper::welcomes(std::string_view mechanism, std::string_view key, Domain domain) const {
  const std::scoped_lock lock(mutex_);
  if (!list_) return mechanism == "NULL";
  return !key.empty() && list_->find(key, domain) != nullptr;
}

void Gatekeeper::answer(Message& part) {
  const auto request = read_request(door_.get(), part);
  const auto domain = request ? domain_of(request->domain) : std::nullopt;
  const std::string key = request ? key_of(*request) : std::string{};
  const bool welcome =
      domain && request->version == "1.0" && welcomes(request->mechanism, key, *domain);
  if (!welcome) refused_.fetch_add(1);
  // version, request id, status, text, user id, metadata
  const std::array<std::string_view, 6> reply{"1.0",
                                              request ? std::string_view(request->id) : "",
                                              welcome ? "200" : "400",
                                              welcome ? "welcome" : "not on the allow-list",
                                              welcome ? std::string_view(key) : "",
                                              ""};
  for (std::size_t i = 0; i < reply.size(); ++i) {
    (void)send_part(door_.get(), reply[i], i + 1 < reply.size());
  }
}

}  // namespace posed::control
