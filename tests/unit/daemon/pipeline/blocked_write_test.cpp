// A device to which a write blocks, as with hidraw for up to 5 s; here a full pipe.
#include <array>
#include <string>
#include <thread>

#include <poll.h>
#include <unistd.h>

#include <catch2/catch.hpp>

#include "daemon/pipeline/reader.hpp"
#include "daemon/system/clock.hpp"
#include "drivers/transport/hid_transport.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/clip/clip.hpp"
#include "tests/support/pipe.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::pipeline {
namespace {

using namespace std::chrono_literals;
using system::EventFd;
using system::monotonic_ns;

drivers::Connection link_to(const test::Pipe& pipe) {
  return {::dup(pipe.write_end()), "pipe", ""};
}

// A glove that receives messages at the other end of a pipe.
drivers::Device glove_on(const test::Pipe& pipe) {
  const drivers::Driver& driver = *drivers::find_driver("lucidgloves");
  drivers::Device device;
  device.description = driver.expect({}).value();
  device.decoder = driver.make_decoder(device.description).value();
  device.transport = drivers::make_hid_transport(link_to(pipe));
  return device;
}

}  // namespace

TEST_CASE("a device whose write blocks delays no other stream") {
  const test::TempFolder folder;
  const auto walk = folder.path() / "walk.bvh";
  REQUIRE(clip::write_bvh(test::toy_walk(240, 120.0), walk));
  drivers::TransportFactory ports;
  drivers::Device walker =
      drivers::find_driver("file")->open({{"path", walk.string()}, {"loop", true}}, ports).value();
  test::Pipe pipe;
  const std::size_t held = pipe.fill();
  drivers::Device glove = glove_on(pipe);
  auto& writer = dynamic_cast<drivers::ColdWriter&>(*glove.transport);

  Ring<Item> decoded(1024);
  Ring<DeviceCommand> commands(16);
  StreamCounters of_glove, of_walker;
  SourceCounters of_port, of_clip;
  const auto wake = EventFd::open().value();
  const auto reader = Reader::open({.out = &decoded,
                                    .pipeline = wake.get(),
                                    .record_sink = nullptr,
                                    .clock = monotonic_ns,
                                    .commands = &commands})
                          .value();
  reader->add({.device = &glove,
               .counters = &of_port,
               .body = ReadBody{.stream = 0, .counters = &of_glove}});
  reader->add({.device = &walker,
               .counters = &of_clip,
               .body = ReadBody{.stream = 1, .counters = &of_walker}});
  REQUIRE(walker.transport->start(monotonic_ns()));
  std::thread reads([&] { reader->run(); });
  DeviceCommand felt{.kind = DeviceCommand::Kind::kSend, .source = 0};
  felt.size = 8;
  REQUIRE(commands.push(felt));
  reader->call();
  // As the device's supervisor does: waits for the message, then for the pipe.
  std::thread supervisor([&] {
    pollfd waiting{.fd = writer.waiting_fd(), .events = POLLIN, .revents = 0};
    ::poll(&waiting, 1, -1);
    writer.write_waiting();
  });

  int frames = 0;
  const auto count = [&](const Item& item) {
    frames += item.kind == Item::Kind::kFrame && item.frame.header.stream == 1 ? 1 : 0;
  };
  for (const std::int64_t until_ns = monotonic_ns() + 10 * kNanosPerSecond;
       frames < 60 && monotonic_ns() < until_ns;) {
    if (!decoded.consume(count)) std::this_thread::sleep_for(1ms);
  }
  CHECK(frames == 60);
  CHECK(pipe.take().size() >= held);  // ends the blocked write
  supervisor.join();
  reader->stop();
  reads.join();
}

TEST_CASE("of the messages that wait for a slow device the newest are sent, the rest is counted") {
  const test::Pipe pipe;
  const drivers::Device glove = glove_on(pipe);
  auto& writer = dynamic_cast<drivers::ColdWriter&>(*glove.transport);
  int refused = 0;
  for (int i = 0; i < 20; ++i) {
    const std::array report{static_cast<std::byte>('a' + i)};
    refused += glove.transport->send(report) ? 0 : 1;
  }
  writer.write_waiting();
  CHECK(pipe.take() == "mnop");  // of the 16 that the queue holds
  CHECK(refused == 4);
  CHECK(writer.dropped() == 16);
  CHECK_FALSE(glove.transport->send(std::vector<std::byte>(4096)));
}

}  // namespace posed::pipeline
