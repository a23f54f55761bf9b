#include "daemon/tools/devices/glove_source.hpp"

#include <poll.h>

#include <algorithm>
#include <chrono>

#include "daemon/system/clock.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/transport/cold_writer.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/sink.hpp"
#include "proto/message/bounded_parse.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

using Clock = std::chrono::steady_clock;
using drivers::glove::Model;

// without a value for this long, the glove or the daemon is gone
constexpr double kGlovePatience_s = 5.0;

std::unexpected<Error> nothing_came() {
  return fail("no values come from the glove: is it switched on and worn?");
}

std::unexpected<Error> gone() { return fail("the glove has gone: plug it in and begin again"); }

std::unexpected<Error> no_such_stream(const std::string& stream, const v1::Stats& stats) {
  const std::string names = joined(stats.stream(), ", ", &v1::StreamStats::stream);
  return misuse("there is no stream " + in_quotes(stream) + "; there is: " + names);
}

std::unexpected<Error> interrupted() { return fail("stopped; no calibration was written"); }

// Collects raw values from a glove's samples: calibrated sensors come first, then their raw values.
class RawSink final : public Sink {
 public:
  RawSink(std::size_t sensors, const GloveSource::Accept& accept)
      : sensors_(sensors), accept_(accept) {}
  void frame(std::size_t /*body*/, Frame& /*frame*/) noexcept override {}
  void outcome(Outcome /*outcome*/) noexcept override {}
  void sample(std::size_t /*body*/, Sample& sample) noexcept override {
    GloveSource::Raw raw{};
    GloveSource::Valid valid;
    for (std::size_t i = 0; i < sensors_ && sensors_ + i < sample.value_count; ++i) {
      raw[i] = sample.value[sensors_ + i];
      valid[i] = sample.valid[sensors_ + i];
    }
    accept_(raw, valid);
    ++count;
  }
  std::size_t count = 0;

 private:
  std::size_t sensors_;
  const GloveSource::Accept& accept_;
};

class OpenedGlove final : public GloveSource {
 public:
  using GloveSource::known;
  using GloveSource::listen;
  OpenedGlove(Glove glove, drivers::Device device, std::unique_ptr<drivers::TransportFactory> ports)
      : GloveSource(std::move(glove)), ports_(std::move(ports)), device_(std::move(device)) {}

  Result<> listen(double seconds, const Accept& accept,
                  const std::function<bool()>& enough) override {
    RawSink sink(model().sensors.size(), accept);
    const std::int64_t start_ns = system::monotonic_ns();
    const std::int64_t end_ns = start_ns + static_cast<std::int64_t>(seconds * 1e9);
    const bool polled = !device_.poll.request.empty();
    for (std::int64_t now = start_ns, asked = 0; now < end_ns; now = system::monotonic_ns()) {
      if (Interrupt::came()) return interrupted();
      if (enough()) return {};
      if (polled && now - asked >= device_.poll.period_ns) {
        asked = now;
        (void)device_.transport->send(device_.poll.request);
        auto* slow = dynamic_cast<drivers::ColdWriter*>(device_.transport.get());
        if (slow != nullptr) slow->write_waiting();
      }
      pollfd wanted{.fd = device_.transport->poll_fd(), .events = POLLIN, .revents = 0};
      (void)::poll(&wanted, 1, polled ? 2 : static_cast<int>(kLookAround.count()));
      TRY(read(now, sink));
    }
    if (sink.count == 0) return nothing_came();
    return {};
  }

 private:
  Result<> read(std::int64_t now, Sink& sink) {
    for (;;) {
      const drivers::Chunk chunk = device_.transport->read(now);
      if (chunk.lost || chunk.end) return gone();
      if (chunk.bytes.empty()) return {};
      device_.decoder->feed_socket(chunk.socket, chunk.bytes, now, sink);
    }
  }

  std::unique_ptr<drivers::TransportFactory> ports_;
  drivers::Device device_;
};

// One message of the daemon about the stream; both are empty if nothing came within kLookAround.
struct Received {
  std::optional<v1::Sample> sample;
  std::optional<v1::Stats> stats;
};

// What a daemon publishes about one of its streams.
class Subscription {
 public:
  static Result<Subscription> open(const ClientOptions& client, const std::string& stream) {
    auto connection = TRY(Connection::open(client, ZMQ_SUB));
    for (const std::string& topic : {sensor_topic(stream), std::string("stats")}) {
      TRY(connection.subscribe(topic));
    }
    return Subscription(std::move(connection), stream);
  }

  Result<Received> next() {
    if (Interrupt::came()) return interrupted();
    if (auto refused = connection_.refusal()) return std::unexpected(*refused);
    Received received;
    if (!connection_.wait(kLookAround)) return received;
    net::Message topic, body;
    if (!connection_.receive(topic, body)) return received;
    if (topic.text() == "stats") {
      if (!message::parse_bounded(received.stats.emplace(), body.bytes())) received.stats.reset();
    } else if (topic.text() == sensor_topic(stream_)) {
      if (!message::parse_bounded(received.sample.emplace(), body.bytes())) received.sample.reset();
    }
    return received;
  }

  // The stats of the stream; null if there is no such stream.
  [[nodiscard]] const v1::StreamStats* part_of(const v1::Stats& stats) const {
    const auto at = std::ranges::find(stats.stream(), stream_, &v1::StreamStats::stream);
    return at == stats.stream().end() ? nullptr : &*at;
  }

  [[nodiscard]] const std::string& stream() const { return stream_; }
  [[nodiscard]] Error no_answer() const {
    if (!connection_.established()) return connection_.no_answer();
    return fail("the daemon sends no stats: is it posed that answers there?").error();
  }

 private:
  Subscription(Connection connection, std::string stream)
      : connection_(std::move(connection)), stream_(std::move(stream)) {}
  static std::string sensor_topic(const std::string& stream) { return "sensor/" + stream; }

  Connection connection_;
  std::string stream_;
};

class PublishedGlove final : public GloveSource {
 public:
  using GloveSource::known;
  using GloveSource::listen;
  PublishedGlove(Glove glove, Subscription subscription)
      : GloveSource(std::move(glove)), subscription_(std::move(subscription)) {}

  Result<> listen(double seconds, const Accept& accept,
                  const std::function<bool()>& enough) override {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    std::size_t count = 0;
    while (Clock::now() < end) {
      if (enough()) return {};
      const auto received = TRY(subscription_.next());
      if (received.stats && !still_there(*received.stats)) return gone();
      if (received.sample && pass_on(*received.sample, accept)) ++count;
    }
    if (count == 0) return nothing_came();
    return {};
  }

 private:
  // Data of another glove on the same port must not be mixed with those of the one that went.
  [[nodiscard]] bool still_there(const v1::Stats& stats) const {
    const v1::StreamStats* stream = subscription_.part_of(stats);
    return stream != nullptr && !stream->away() && stream->identity() == identity();
  }

  [[nodiscard]] bool pass_on(const v1::Sample& sample, const Accept& accept) const {
    Raw raw{};
    Valid valid;
    for (std::size_t i = 0; i < model().sensors.size(); ++i) {
      const auto at = std::ranges::find(sample.name(), "raw_" + model().sensors[i].name);
      const std::size_t place = at - sample.name().begin();
      if (place >= static_cast<std::size_t>(sample.value_size())) return false;
      raw[i] = sample.value(static_cast<int>(place));
      valid[i] = place < sample.validity().size() && sample.validity()[place] != 0;
    }
    accept(raw, valid);
    return true;
  }

  Subscription subscription_;
};

}  // namespace

Result<GloveSource::Glove> GloveSource::known(const drivers::Driver& driver,
                                              const drivers::Description& description) {
  const auto hand = description.skeleton ? hand_side(*description.skeleton) : std::nullopt;
  if (driver.glove == nullptr || !hand) {
    return misuse("driver " + in_quotes(driver.name) + " is not for gloves");
  }
  auto model = TRY(driver.glove->glove_model(description));
  return Glove{.model = std::move(model), .identity = description.identity, .hand = *hand};
}

Result<std::unique_ptr<GloveSource>> GloveSource::open(const drivers::Driver& driver,
                                                       const drivers::Options& options) {
  auto ports = std::make_unique<drivers::TransportFactory>();
  auto device = TRY(driver.open(options, *ports));
  auto glove = TRY(known(driver, device.description));
  TRY(device.transport->start(system::monotonic_ns()));
  return std::make_unique<OpenedGlove>(std::move(glove), std::move(device), std::move(ports));
}

Result<std::unique_ptr<GloveSource>> GloveSource::connect(const ClientOptions& client,
                                                          const std::string& stream) {
  auto subscription = TRY(Subscription::open(client, stream));
  const auto end = Clock::now() + std::chrono::duration<double>(kGlovePatience_s);
  while (Clock::now() < end) {
    const auto received = TRY(subscription.next());
    if (!received.stats) continue;
    const v1::StreamStats* stats = subscription.part_of(*received.stats);
    if (stats == nullptr) return no_such_stream(stream, *received.stats);
    const drivers::Driver* driver = drivers::find_driver(stats->driver());
    if (driver == nullptr || stats->device_info().empty()) {
      return misuse("stream " + in_quotes(stream) + " is of driver " + in_quotes(stats->driver()) +
                    ", which has no sensors that can be calibrated");
    }
    if (stats->away()) {
      return fail("the glove of stream " + in_quotes(stream) +
                  " is away: plug it in and begin again");
    }
    const auto description = TRY(driver->describe(stats->device_info(), stats->identity()));
    auto glove = TRY(known(*driver, description));
    return std::make_unique<PublishedGlove>(std::move(glove), std::move(subscription));
  }
  return std::unexpected(subscription.no_answer());
}

}  // namespace posed::tools
