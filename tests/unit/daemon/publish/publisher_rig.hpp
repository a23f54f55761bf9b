// A publisher of toy streams on a free port, its thread, and a subscriber to everything.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/publish/publisher.hpp"
#include "daemon/system/clock.hpp"
#include "models/style/live/style_type.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::publish {

class PublisherRig {
 public:
  // `runs`: has a thread; otherwise the test calls turn().
  explicit PublisherRig(bool runs = true, std::vector<FrameOutput*> outputs = {}) {
    StreamInfo info = toy_info("toy");
    info.raw = true;
    PublisherOptions options;
    options.context = context.get();
    options.endpoint = "tcp://127.0.0.1:*";
    options.clock = system::monotonic_ns;
    options.slots = 4;
    options.messages_per_s = 1200.0;
    options.outputs = std::move(outputs);
    publisher = Publisher::open(std::move(options), ring, *wake).value();
    publisher->add(std::move(info));
    subscriber = net::open_socket(context.get(), ZMQ_SUB).value();
    REQUIRE(net::set_option(subscriber.get(), ZMQ_SUBSCRIBE, std::string_view()));
    REQUIRE(net::set_option(subscriber.get(), ZMQ_RCVTIMEO, 20));
    REQUIRE(net::connect_socket(subscriber.get(), publisher->endpoint()));
    if (runs) thread = std::thread([this] { publisher->run(); });
  }
  ~PublisherRig() { stop(); }
  PublisherRig(const PublisherRig&) = delete;
  PublisherRig& operator=(const PublisherRig&) = delete;

  void stop() {
    publisher->stop();
    if (thread.joinable()) thread.join();
  }

  StreamInfo toy_info(const std::string& name, std::uint32_t stream = 0) {
    StreamInfo info;
    info.stream = stream;
    info.name = name;
    info.description.driver = "file";
    info.description.skeleton = std::make_shared<const Skeleton>(test::toy_skeleton());
    info.skeleton = info.description.skeleton;
    info.description.samples = {.names = {"bend"}, .units = {"rad"}};
    info.rate_hz = 100.0;
    info.stages = styled("");
    info.counters = &counters;
    info.source_counters = &source;
    return info;
  }

  // The style stage of toy_info() with this model, which knows the style "sway".
  static std::vector<StageInfo> styled(const std::string& model) {
    return {{.type = &style::style_type(),
             .model = model,
             .words = {"sway"},
             .texts = {{"weights", "sway=1"}, {"mask", ""}}}};
  }

  void put(const pipeline::Item& item) {
    REQUIRE(ring.push(item));
    wake->notify();
  }
  // Receives messages until `topic` has come `count` times; false after ten seconds.
  bool receive(const std::string& topic, int count) {
    const std::int64_t until_ns = system::monotonic_ns() + 10 * kNanosPerSecond;
    while (seen[topic] < count && system::monotonic_ns() < until_ns) {
      net::Message name;
      net::Message body;
      if (!name.receive(subscriber.get(), 0) || !body.receive(subscriber.get(), 0)) continue;
      ++seen[std::string(name.text())];
      bodies[std::string(name.text())] = std::string(body.text());
      topics.emplace_back(name.text());
    }
    return seen[topic] >= count;
  }
  // The message that came last under a topic.
  template <typename Message>
  Message last(const std::string& topic) {
    Message message;
    REQUIRE(message.ParseFromString(bodies[topic]));
    return message;
  }

  pipeline::StreamCounters counters;
  pipeline::SourceCounters source;
  pipeline::Ring<pipeline::Item> ring{64};
  std::unique_ptr<system::EventFd> wake = system::EventFd::open().value();
  net::Context context = net::open_context().value();
  std::unique_ptr<Publisher> publisher;
  net::Socket subscriber;
  std::thread thread;
  std::map<std::string, int> seen;
  std::map<std::string, std::string> bodies;
  std::vector<std::string> topics;  // in the order in which they came
};

inline pipeline::Item toy_frame_item(std::uint64_t sequence, std::uint32_t stream = 0) {
  pipeline::Item item;
  item.frame = test::toy_walk(3).frame(1);
  item.frame.header.stream = stream;
  item.frame.header.sequence = sequence;
  item.frame.header.arrival_ns = 1000;
  item.frame.header.device_ns = 500;
  return item;
}

}  // namespace posed::publish
