// A device over UDP with two bodies, from its emulator's socket to the ring.
#include <atomic>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "daemon/pipeline/reader.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/quiet_record_sink.hpp"

namespace posed::pipeline {
namespace {

using namespace std::chrono_literals;
using system::EventFd;
using system::monotonic_ns;

const drivers::Driver& mocap() { return *drivers::find_driver("template_mocap"); }

// The bodies that the emulator describes first.
std::unique_ptr<const drivers::SourceLayout> described_bodies() {
  const auto emulator = mocap().emulate({}).value();
  std::vector<std::byte> datagram;
  emulator->emit(0, datagram);
  const std::span content(datagram);
  return mocap().make_layout(content.subspan(8, content.size() - 12)).value();
}

struct Recorder final : test::QuietRecordSink {
  void chunk(std::uint32_t, std::uint8_t, Direction direction, std::int64_t, const Position&,
             std::span<const std::byte>) noexcept override {
    ++(direction == Direction::kToDevice ? requests : chunks);
  }
  std::atomic<int> requests{0}, chunks{0};
};

}  // namespace

TEST_CASE("datagrams of a mocap system come through the reader, with the kernel's time") {
  const std::string endpoint = "127.0.0.1:" + std::to_string(test::free_port());
  drivers::TransportFactory ports;
  auto device = mocap().open({{"listen", endpoint}}, ports).value();
  const auto layout = described_bodies();
  device.decoder->use(*layout);
  emulate::EmulatedDevice system(mocap().emulate({}).value(),
                                 emulate::EmulatedPort::open_udp({endpoint}).value(), {}, {});
  const std::jthread sends([&](const std::stop_token& stop) { system.run(stop); });

  Ring<Item> decoded(1024);
  StreamCounters counters;
  SourceCounters of_system;
  Recorder recorder;
  const auto wake = EventFd::open().value();
  const auto reader = Reader::open({.out = &decoded,
                                    .pipeline = wake.get(),
                                    .record_sink = &recorder,
                                    .clock = monotonic_ns,
                                    .commands = nullptr})
                          .value();
  reader->add({.device = &device,
               .counters = &of_system,
               .body = ReadBody{.stream = 0, .counters = &counters}});
  std::thread reads([&] { reader->run(); });
  int frames = 0;
  bool in_order = true;
  std::int64_t arrived_ns = 0;
  const auto take = [&](const Item& item) {
    if (item.kind != Item::Kind::kFrame) return;
    ++frames;
    const std::int64_t arrival_ns = item.frame.header.arrival_ns;
    in_order = in_order && arrival_ns > arrived_ns && arrival_ns <= item.frame.stamps.decoded_ns;
    arrived_ns = arrival_ns;
    counters.pipeline.taken.fetch_add(1);
  };
  for (const std::int64_t until_ns = monotonic_ns() + 10 * kNanosPerSecond;
       (frames < 150 || recorder.requests < 1) && monotonic_ns() < until_ns;) {
    if (!decoded.consume(take)) std::this_thread::sleep_for(1ms);
  }
  reader->stop();
  reads.join();
  while (decoded.consume(take)) {  // frames that came before it stopped
  }
  CHECK(frames >= 150);
  CHECK(in_order);
  CHECK(recorder.requests >= 1);  // a request follows the first datagram
  CHECK(recorder.chunks >= 150);
  CHECK(counters.reader.frames == static_cast<std::uint64_t>(frames));  // of body 0 only
  CHECK(of_system.outcome[static_cast<std::size_t>(Outcome::kOk)] >= 150);
}

}  // namespace posed::pipeline
