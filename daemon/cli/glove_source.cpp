#include "daemon/cli/glove_source.hpp"

#include <poll.h>

#include <algorithm>
#include <chrono>

#include "posed/v1/posed.pb.h"
#include "proto/frame/sink.hpp"

namespace posed::cli {
namespace {

using Clock = std::chrono::steady_clock;
using drivers::glove::Model;

constexpr double kGlovePatience_s = 5.0;  // without a value: the glove or the daemon is gone

std::unexpected<Error> nothing_came() {
  return fail("no values come from the glove: is it switched on and worn?");
}

std::unexpected<Error> interrupted() { return fail("stopped; no calibration was written"); }

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())
      .count();
}

// Raw values of a glove's samples: sensors first, then their raw values.
class RawSink final : public Sink {
 public:
  RawSink(std::size_t sensors, const GloveSource::Take& take) : sensors_(sensors), take_(take) {}
  void frame(Frame& /*frame*/) noexcept override {}
  void outcome(Outcome /*outcome*/) noexcept override {}
  void sample(Sample& sample) noexcept override {
    GloveSource::Raw raw{};
    GloveSource::Valid valid;
    for (std::size_t i = 0; i < sensors_ && sensors_ + i < sample.value_count; ++i) {
      raw[i] = sample.value[sensors_ + i];
      valid[i] = sample.valid[sensors_ + i];
    }
    take_(raw, valid);
    ++count;
  }
  std::size_t count = 0;

 private:
  std::size_t sensors_;
  const GloveSource::Take& take_;
};

class OpenedGlove final : public GloveSource {
 public:
  OpenedGlove(Model model, drivers::Device device, std::unique_ptr<drivers::Ports> ports)
      : GloveSource(std::move(model), device.description.identity),
        ports_(std::move(ports)),
        device_(std::move(device)) {}

  Result<> listen(double seconds, const Take& take) override {
    RawSink sink(model().sensors.size(), take);
    const std::int64_t start_ns = now_ns();
    const std::int64_t end_ns = start_ns + static_cast<std::int64_t>(seconds * 1e9);
    const bool polled = !device_.poll.request.empty();
    for (std::int64_t now = start_ns, asked = 0; now < end_ns; now = now_ns()) {
      if (Interrupt::came()) return interrupted();
      if (polled && now - asked >= device_.poll.period_ns) {
        asked = now;
        (void)device_.transport->send(device_.poll.request);
      }
      pollfd wanted{.fd = device_.transport->poll_fd(), .events = POLLIN, .revents = 0};
      (void)::poll(&wanted, 1, polled ? 2 : static_cast<int>(kLookAround.count()));
      if (auto ok = read(now, sink); !ok) return ok;
    }
    if (sink.count == 0) return nothing_came();
    return {};
  }

 private:
  Result<> read(std::int64_t now, Sink& sink) {
    for (;;) {
      const drivers::Chunk chunk = device_.transport->read(now);
      if (chunk.lost || chunk.end) return fail("the glove has gone: plug it in and begin again");
      if (chunk.bytes.empty()) return {};
      device_.decoder->feed(chunk.bytes, now, sink);
    }
  }

  std::unique_ptr<drivers::Ports> ports_;
  drivers::Device device_;
};

// The places of a model's raw values in the samples of a stream; none when it is another glove's.
std::optional<std::vector<int>> places_of(const Model& model, const v1::Sample& sample) {
  std::vector<int> places;
  for (const auto& sensor : model.sensors) {
    const auto at = std::ranges::find(sample.name(), "raw_" + sensor.name);
    if (at == sample.name().end()) return std::nullopt;
    places.push_back(static_cast<int>(at - sample.name().begin()));
  }
  return places;
}

class PublishedGlove final : public GloveSource {
 public:
  PublishedGlove(Model model, Connection connection, std::string topic)
      : GloveSource(std::move(model), {}),
        connection_(std::move(connection)),
        topic_(std::move(topic)) {}

  Result<> listen(double seconds, const Take& take) override {
    const auto end = Clock::now() + std::chrono::duration<double>(seconds);
    std::size_t count = 0;
    while (Clock::now() < end) {
      auto sample = next(connection_, topic_);
      if (!sample) return std::unexpected(sample.error());
      if (!*sample) continue;
      const auto places = places_of(model(), **sample);
      if (!places) continue;
      Raw raw{};
      Valid valid;
      for (std::size_t i = 0; i < places->size(); ++i) {
        const int place = (*places)[i];
        if (place >= (*sample)->value_size()) continue;
        raw[i] = (*sample)->value(place);
        valid[i] = is_valid(**sample, place);
      }
      take(raw, valid);
      ++count;
    }
    if (count == 0) return nothing_came();
    return {};
  }

  // The next sample of exactly this topic; none within a look-around.
  static Result<std::optional<v1::Sample>> next(Connection& connection, const std::string& topic) {
    if (Interrupt::came()) return interrupted();
    if (auto refused = connection.refusal()) return std::unexpected(*refused);
    if (!connection.wait(kLookAround)) return std::nullopt;
    control::Message name, body;
    if (!name.receive(connection.socket()) || !name.more()) return std::nullopt;
    if (!body.receive(connection.socket(), 0)) return std::nullopt;
    v1::Sample sample;
    if (name.text() != topic ||
        !sample.ParseFromArray(body.bytes().data(), static_cast<int>(body.bytes().size()))) {
      return std::nullopt;
    }
    return sample;
  }

 private:
  static bool is_valid(const v1::Sample& sample, int place) {
    const auto at = static_cast<std::size_t>(place);
    return at < sample.validity().size() && sample.validity()[at] != 0;
  }

  Connection connection_;
  std::string topic_;
};

Result<Model> model_of(const drivers::Driver& driver, Side hand) {
  if (driver.expect == nullptr || driver.glove_model == nullptr) {
    return misuse("driver '" + std::string(driver.name) + "' is no glove");
  }
  const auto description =
      driver.expect({{"hand", std::string(hand == Side::kLeft ? "left" : "right")}});
  if (!description) return std::unexpected(description.error());
  return driver.glove_model(*description);
}

}  // namespace

Result<std::unique_ptr<GloveSource>> GloveSource::open(const drivers::Driver& driver,
                                                       const drivers::Options& options) {
  auto ports = std::make_unique<drivers::Ports>();
  auto device = driver.open(options, *ports);
  if (!device) return std::unexpected(device.error());
  if (driver.glove_model == nullptr) {
    return misuse("driver '" + std::string(driver.name) + "' is no glove");
  }
  auto model = driver.glove_model(device->description);
  if (!model) return std::unexpected(model.error());
  if (auto ok = device->transport->start(now_ns()); !ok) return std::unexpected(ok.error());
  return std::make_unique<OpenedGlove>(std::move(*model), std::move(*device), std::move(ports));
}

Result<std::unique_ptr<GloveSource>> GloveSource::connect(const ClientOptions& client,
                                                          const std::string& stream,
                                                          const drivers::Driver* driver,
                                                          Side hand) {
  auto connection = Connection::open(client, ZMQ_SUB);
  if (!connection) return std::unexpected(connection.error());
  const std::string topic = "sensor/" + stream;
  if (auto ok = control::set_option(connection->socket(), ZMQ_SUBSCRIBE, topic); !ok) {
    return std::unexpected(ok.error());
  }
  const auto end = Clock::now() + std::chrono::duration<double>(kGlovePatience_s);
  while (Clock::now() < end) {
    auto sample = PublishedGlove::next(*connection, topic);
    if (!sample) return std::unexpected(sample.error());
    if (!*sample) continue;
    for (const drivers::Driver& known : drivers::registry()) {
      if (driver != nullptr ? driver->name != known.name : known.glove_model == nullptr) continue;
      auto model = model_of(known, hand);
      if (!model && driver != nullptr) return std::unexpected(model.error());
      if (model && places_of(*model, **sample)) {
        return std::make_unique<PublishedGlove>(std::move(*model), std::move(*connection), topic);
      }
    }
    return fail("stream '" + stream + "' is not of a glove that posed knows; name its --driver");
  }
  if (!connection->established()) return std::unexpected(connection->no_answer());
  return fail("nothing comes on " + topic + ": is there such a stream, and its glove switched on?");
}

}  // namespace posed::cli
