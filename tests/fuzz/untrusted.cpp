// What an untrusted client can send to both sockets, as our code receives it from libzmq:
// subscriptions of several peers, authentication requests, pieces of models. With
// POSED_FUZZ_SOCKETS=1 the bytes go through real loopback connections instead, before and after the
// handshake (slow).
#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

#include "daemon/control/control_server.hpp"
#include "daemon/control/uploads.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/publish/subscriptions.hpp"
#include "daemon/system/clock.hpp"
#include "tests/fuzz/demand.hpp"
#include "tests/support/raw_peer.hpp"

namespace {

using posed::fuzz::demand;
using namespace posed;

std::string topic(FuzzedDataProvider& data) {
  constexpr std::array<const char*, 8> kBegins{"",       "pose/", "skeleton/", "sensor/",
                                               "event/", "stats", "pose/a",    "x"};
  return data.PickValueInArray(kBegins) + data.ConsumeRandomLengthString(40);
}

void try_subscriptions(FuzzedDataProvider& data) {
  publish::Subscriptions subscriptions(
      [](std::string_view prefix) { return std::string_view("pose/a").starts_with(prefix); });
  std::int64_t now_ns = 0;
  while (data.remaining_bytes() > 0) {
    const int peer = data.ConsumeIntegralInRange(0, 3);
    now_ns += data.ConsumeIntegral<std::uint32_t>();
    if (data.ConsumeIntegralInRange(0, 15) == 0) {
      subscriptions.forget(peer);
    } else if (!subscriptions.ask(peer, topic(data), data.ConsumeBool(), now_ns)) {
      subscriptions.forget(peer);  // the publisher cuts it off
    }
    demand(subscriptions.wanted() <= publish::kMaxWanted);
  }
  for (const int peer : {0, 1, 2, 3}) subscriptions.forget(peer);
  demand(subscriptions.wanted() == 0);
}

void try_gatekeeper(FuzzedDataProvider& data) {
  std::vector<std::string> parts{"1.0", "1", "posed.control", "127.0.0.1", "", "CURVE"};
  const std::size_t wrong = data.ConsumeIntegralInRange<std::size_t>(0, 7);
  if (wrong < parts.size()) parts[wrong] = data.ConsumeRandomLengthString(40);
  while (data.remaining_bytes() > 0) parts.push_back(data.ConsumeRandomLengthString(40));
  const auto request = net::read_zap_request(parts);
  if (request) demand(request->key_z85.empty() || request->key_z85.size() == 40);
}

void try_uploads(FuzzedDataProvider& data) {
  control::Uploads uploads;
  const std::string sha256(64, 'a');
  const std::string bytes(control::kMaxPiece + 1, 'b');
  std::int64_t now_ns = 0;
  std::array<std::uint64_t, 4> offset{};
  while (data.remaining_bytes() > 0) {
    const auto client = data.ConsumeIntegralInRange<std::size_t>(0, 3);
    now_ns += data.ConsumeIntegral<std::uint32_t>();
    control::ModelPiece piece{
        .stream = "s",
        .sha256 = sha256,
        .total = control::kMaxModel,
        .offset = offset[client],
        .bytes = std::string_view(bytes).substr(0, data.ConsumeIntegral<std::uint16_t>())};
    if (data.ConsumeIntegralInRange(0, 7) == 0)
      piece.offset = data.ConsumeIntegral<std::uint64_t>();
    if (data.ConsumeIntegralInRange(0, 7) == 0) piece.total = data.ConsumeIntegral<std::uint64_t>();
    const auto taken = uploads.add(std::to_string(client), piece, now_ns);
    demand(!taken || !*taken);  // no piece has the right checksum
    offset[client] = taken ? piece.offset + piece.bytes.size() : 0;
    demand(uploads.bytes() <= control::kMaxModel);
  }
  (void)uploads.forget_old(now_ns + 1'000'000'000'000);
  demand(uploads.bytes() == 0);
}

// Both sockets of a daemon without keys, without a pipeline.
class Sockets final : public control::DaemonControl {
 public:
  Sockets() {
    publish::PublisherOptions options;
    options.context = context_.get();
    options.endpoint = "tcp://127.0.0.1:*";
    options.authenticator = authenticator_.get();
    options.clock = system::monotonic_ns;
    publisher_ = publish::Publisher::open(std::move(options), items_, *wake_).value();
    control::ControlPorts ports;
    ports.acks = &acks_;
    ports.wake = control_wake_.get();
    ports.authenticator = authenticator_.get();
    server_ =
        control::ControlServer::start(context_.get(), "tcp://127.0.0.1:*", ports, handler_).value();
  }
  void attack(FuzzedDataProvider& data) {
    const bool subscriber = data.ConsumeBool();
    const test::RawPeer peer(subscriber ? publisher_->endpoint() : server_->endpoint());
    if (data.ConsumeBool()) {
      (void)peer.send(test::zmtp::greeting());
      if (data.ConsumeBool()) (void)peer.send(test::zmtp::ready(subscriber ? "SUB" : "DEALER"));
    }
    const bool framed = data.ConsumeBool();
    while (data.remaining_bytes() > 0) {
      std::string bytes = data.ConsumeRandomLengthString(300);
      if (framed) bytes = test::zmtp::frame(bytes, data.ConsumeIntegralInRange(0, 7));
      if (!peer.send(bytes, std::chrono::milliseconds(5))) break;
    }
    for (int i = 0; i < 3; ++i) {
      (void)publisher_->turn(system::monotonic_ns());
      (void)peer.receive(1, std::chrono::milliseconds(1));
    }
  }
  bool send(const pipeline::Command&) override { return true; }
  bool send(const pipeline::DeviceCommand&) override { return true; }
  void keep_model(std::span<const std::byte>) override {}
  void stages_changed(std::uint32_t, const posed::pipeline::StreamSettings&) override {}
  Result<pipeline::Take> mark_take(const pipeline::TakeMark&) override {
    return fail("not recording");
  }
  void fill(v1::Stats&) override {}
  void stop() override {}

 private:
  net::Context context_ = net::open_context().value();
  std::unique_ptr<net::ZapAuthenticator> authenticator_ =
      net::ZapAuthenticator::start(context_.get(), std::nullopt).value();
  pipeline::Ring<pipeline::Item> items_{64};
  pipeline::Ring<pipeline::Ack> acks_{64};
  std::unique_ptr<system::EventFd> wake_ = system::EventFd::open().value();
  std::unique_ptr<system::EventFd> control_wake_ = system::EventFd::open().value();
  devices::KeptSettings kept_;
  control::RequestHandler handler_{*this, kept_};
  std::unique_ptr<publish::Publisher> publisher_;
  std::unique_ptr<control::ControlServer> server_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider data(bytes, size);
  static const bool through_sockets = std::getenv("POSED_FUZZ_SOCKETS") != nullptr;
  if (through_sockets) {
    static auto* sockets = new Sockets;  // never destroyed, because its threads outlive main
    sockets->attack(data);
    return 0;
  }
  switch (data.ConsumeIntegralInRange(0, 2)) {
    case 0:
      try_subscriptions(data);
      break;
    case 1:
      try_gatekeeper(data);
      break;
    default:
      try_uploads(data);
      break;
  }
  return 0;
}
