// A device that speaks on two sockets, through the reader and into the record.
#include <array>
#include <cstring>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/pipeline/reader.hpp"
#include "tests/support/quiet_record_sink.hpp"

namespace posed::pipeline {
namespace {

std::int64_t now_ns = 1'000'000'000;
std::int64_t test_clock() noexcept { return now_ns; }

// Data comes on socket 1 whenever it is read; requests are to go to socket 2.
class TwoSockets final : public drivers::Transport {
 public:
  [[nodiscard]] int poll_fd() const noexcept override { return -1; }
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override { return now_ns; }
  [[nodiscard]] Result<> start(std::int64_t) override { return {}; }
  [[nodiscard]] drivers::Chunk read(std::int64_t) noexcept override {
    if (given_) return {};
    given_ = true;
    return {.bytes = bytes_, .socket = 1};
  }
  [[nodiscard]] bool send(std::span<const std::byte>, std::uint8_t socket) noexcept override {
    sent_to = socket;
    return true;
  }

  int sent_to = -1;

 private:
  std::array<std::byte, 3> bytes_{};
  bool given_ = false;
};

struct SocketDecoder final : drivers::Decoder {
  void feed(std::span<const std::byte>, std::int64_t, Sink&) noexcept override { fed_by = -2; }
  void feed_socket(std::uint8_t socket, std::span<const std::byte>, std::int64_t,
                   Sink&) noexcept override {
    fed_by = socket;
  }
  int fed_by = -1;
};

struct SocketRecord final : test::QuietRecordSink {
  void chunk(std::uint32_t, std::uint8_t socket, Direction direction, std::int64_t, const Position&,
             std::span<const std::byte>) noexcept override {
    if (direction == Direction::kFromDevice) from = socket;
    if (direction == Direction::kToDevice) to = socket;
  }
  int from = -1, to = -1;
};

}  // namespace

TEST_CASE("chunks and requests keep their socket, to the decoder and into the log") {
  drivers::Device device;
  auto transport = std::make_unique<TwoSockets>();
  auto decoder = std::make_unique<SocketDecoder>();
  const TwoSockets& sockets = *transport;
  const SocketDecoder& decoded_by = *decoder;
  device.transport = std::move(transport);
  device.decoder = std::move(decoder);
  device.poll = {.request = {std::byte{1}}, .period_ns = kNanosPerSecond, .socket = 2};
  SocketRecord record;
  Ring<Item> decoded(64);
  SourceCounters counters;
  const auto wake = system::EventFd::open().value();
  const auto reader = Reader::open({.out = &decoded,
                                    .pipeline = wake.get(),
                                    .record_sink = &record,
                                    .clock = test_clock,
                                    .commands = nullptr})
                          .value();
  reader->add({.device = &device, .counters = &counters});
  reader->begin();
  static_cast<void>(reader->turn(now_ns));
  CHECK(decoded_by.fed_by == 1);
  CHECK(record.from == 1);
  CHECK(sockets.sent_to == 2);
  CHECK(record.to == 2);
}

}  // namespace posed::pipeline
