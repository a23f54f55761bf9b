// The control socket: what clients get over it, whatever other clients do.
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include <catch2/catch.hpp>

#include "daemon/control/control_server.hpp"
#include "daemon/control/request_handler.hpp"
#include "posed/v1/control.pb.h"
#include "proto/zmq/keys.hpp"
#include "tests/support/has.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/daemon/control/requests.hpp"
#include "tests/unit/daemon/control/three_streams.hpp"

namespace posed::control {
namespace {

using namespace std::chrono_literals;
using namespace net;
using pipeline::Ack;
using pipeline::Command;
using test::has;

// The control side of a daemon only: a socket, and a pipeline that acknowledges.
class Booth final : public DaemonControl {
 public:
  explicit Booth(ZapAuthenticator* authenticator = nullptr, std::string secret = {},
                 void* context = nullptr)
      : context_(*open_context()) {
    server_ =
        *ControlServer::start(context == nullptr ? context_.get() : context, "tcp://127.0.0.1:*",
                              {&acks_, wake_.get(), authenticator, std::move(secret)}, handler_);
    started_ = server_.get();
  }
  bool send(const pipeline::DeviceCommand&) override { return true; }
  bool send(const Command& command) override {
    ++commands;
    const bool pushed =
        acks_feed_.push({.ticket = command.ticket, .stream = command.stream, .sequence = commands});
    return pushed;
  }
  // What the pipeline does, on the test's thread.
  void serve() {
    while (acks_feed_.consume([this](const Ack& ack) noexcept { (void)acks_.push(ack); })) {
    }
    wake_->notify();
  }
  void keep_model(std::span<const std::byte>) override {}
  void stages_changed(std::uint32_t, const pipeline::StreamSettings&) override {}
  Result<pipeline::Take> mark_take(const pipeline::TakeMark&) override {
    return fail("not recording");
  }
  void fill(v1::Stats& stats) override {
    while (hold_status) std::this_thread::sleep_for(1ms);
    stats.set_rss_bytes(42);
    const std::scoped_lock lock(mutex);
    if (const ControlServer* server = started_) beats_at_status.insert(server->pulse().beats());
  }
  void stop() override { stopped = true; }
  [[nodiscard]] const std::string& endpoint() const { return server_->endpoint(); }

  std::atomic<std::uint64_t> commands{0};
  std::atomic<bool> stopped{false};
  std::atomic<bool> hold_status{false};
  std::mutex mutex;
  std::set<std::uint64_t> beats_at_status;  // as many as there had been at each status request

 private:
  Context context_;
  std::unique_ptr<system::EventFd> wake_ = *system::EventFd::open();
  pipeline::Ring<Ack> acks_{kMaxUnderWay};
  pipeline::Ring<Ack> acks_feed_{kMaxUnderWay};
  HandlerRig rig_{three_streams(), *this};
  RequestHandler& handler_ = rig_.handler;
  std::atomic<ControlServer*> started_{nullptr};  // for fill(), on the server's thread
  std::unique_ptr<ControlServer> server_;
};

class Client {
 public:
  Client(const std::string& endpoint, int type) : socket_(*open_socket(context_.get(), type)) {
    REQUIRE(connect_socket(socket_.get(), endpoint));
  }
  [[nodiscard]] void* socket() const { return socket_.get(); }
  void send(const v1::ControlRequest& request) const {
    REQUIRE(send_part(socket_.get(), request.SerializeAsString(), false));
  }
  // The next reply; nullopt if none came in time.
  [[nodiscard]] std::optional<v1::ControlReply> receive(std::chrono::milliseconds within) const {
    zmq_pollitem_t wait{socket_.get(), 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&wait, 1, within.count()) <= 0) return std::nullopt;
    Message part;
    while (part.receive(socket_.get()) && part.more()) {
    }
    v1::ControlReply reply;
    REQUIRE(reply.ParseFromArray(part.text().data(), static_cast<int>(part.text().size())));
    return reply;
  }

 private:
  Context context_ = *open_context();
  Socket socket_;
};

v1::ControlRequest status_request() {
  v1::ControlRequest request;
  request.mutable_status();
  return request;
}

TEST_CASE("the control socket answers REQ and DEALER clients") {
  Booth booth;
  const Client req(booth.endpoint(), ZMQ_REQ);
  req.send(status_request());
  const auto status = req.receive(5s);
  REQUIRE(status);
  CHECK(status->status().rss_bytes() == 42);

  const Client dealer(booth.endpoint(), ZMQ_DEALER);
  dealer.send(alpha_request("walker", 0.5F));
  while (booth.commands == 0) std::this_thread::sleep_for(1ms);
  booth.serve();
  const auto done = dealer.receive(5s);
  REQUIRE(done);
  CHECK(done->ok());
  CHECK(done->sequence() == 1);
}

TEST_CASE("each request is a sign of life, also where many wait") {
  Booth booth;
  booth.hold_status = true;
  const Client client(booth.endpoint(), ZMQ_DEALER);
  constexpr int kRequests = 12;
  for (int i = 0; i < kRequests; ++i) client.send(status_request());
  std::this_thread::sleep_for(100ms);  // most of them wait behind the first now
  booth.hold_status = false;
  for (int i = 0; i < kRequests; ++i) REQUIRE(client.receive(5s));
  const std::scoped_lock lock(booth.mutex);
  CHECK(booth.beats_at_status.size() == kRequests);
}

TEST_CASE("clients that are silent, never read, send garbage or flood do not delay others") {
  Booth booth;
  // One client sends invalid bytes and never reads; one sends an endless envelope; one floods with
  // requests that get no reply because the pipeline does not run.
  const Client wild(booth.endpoint(), ZMQ_DEALER);
  const Client endless(booth.endpoint(), ZMQ_DEALER);
  const Client flood(booth.endpoint(), ZMQ_DEALER);
  for (int i = 0; i < 2000; ++i) {
    (void)send_part(wild.socket(), std::string(100, '\xff'), false);
    (void)send_part(endless.socket(), "x", i % 50 != 49);
    (void)send_part(flood.socket(), alpha_request("walker", 1.0F).SerializeAsString(), false);
  }
  const Client good(booth.endpoint(), ZMQ_REQ);
  for (int i = 0; i < 20; ++i) {
    good.send(status_request());
    const auto reply = good.receive(5s);
    REQUIRE(reply);
    CHECK(reply->ok());
  }
}

// Each reply counts as unread until libzmq hears that its own thread has taken it.
TEST_CASE("a client that asks quickly beside one that floods gets every reply") {
  Booth booth;
  const Client flood(booth.endpoint(), ZMQ_DEALER);
  std::atomic<bool> enough{false};
  std::thread flooding([&] {
    const std::string request = alpha_request("walker", 1.0F).SerializeAsString();
    while (!enough.load()) (void)send_part(flood.socket(), request, false);
  });
  const Client good(booth.endpoint(), ZMQ_REQ);
  bool all = true;
  for (int i = 0; all && i < 5000; ++i) {
    good.send(status_request());
    all = good.receive(5s).has_value();
  }
  enough = true;
  flooding.join();
  CHECK(all);
}

TEST_CASE("a controller's key is checked at every message") {
  const test::TempFolder folder;
  const auto server = *write_new_keys("server", folder.path());
  const auto director = *write_new_keys("director", folder.path());
  const Context context = *open_context();
  const auto authenticator = *ZapAuthenticator::start(
      context.get(), AccessList({{"d", director.public_z85, false, true}}));
  Booth booth(authenticator.get(), server.secret_z85, context.get());

  const Context there = *open_context();
  const Socket dealer = *open_socket(there.get(), ZMQ_DEALER);
  REQUIRE(
      secure_client(dealer.get(), folder.path() / "director.key", folder.path() / "server.pub"));
  REQUIRE(connect_socket(dealer.get(), booth.endpoint()));
  const auto ask = [&] {
    REQUIRE(send_part(dealer.get(), status_request().SerializeAsString(), false));
    zmq_pollitem_t wait{dealer.get(), 0, ZMQ_POLLIN, 0};
    REQUIRE(zmq_poll(&wait, 1, 5000) == 1);
    Message message;
    REQUIRE(message.receive(dealer.get()));
    v1::ControlReply reply;
    REQUIRE(reply.ParseFromArray(message.text().data(), static_cast<int>(message.text().size())));
    return reply;
  };
  CHECK(ask().ok());
  (void)authenticator->replace(AccessList{});
  const auto after = ask();
  CHECK_FALSE(after.ok());
  CHECK(has(after.error(), "your key may no longer control"));
}

}  // namespace
}  // namespace posed::control
