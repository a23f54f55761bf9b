// A device that speaks on two sockets, through the reader and into the record, and from a log.
#include <array>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/pipeline/reader.hpp"
#include "daemon/system/pulse.hpp"
#include "daemon/tools/emulate/log_emulator.hpp"
#include "proto/log/writer.hpp"
#include "tests/support/quiet_record_sink.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::pipeline {
namespace {

std::int64_t now_ns = 1'000'000'000;
std::int64_t test_clock() noexcept { return now_ns; }

// Data comes on socket 1 whenever it is read; requests are to go to socket 2.
class TwoSockets final : public drivers::Transport {
 public:
  [[nodiscard]] int poll_fd() const noexcept override { return -1; }
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override { return now_ns; }
  Result<> start(std::int64_t) override { return {}; }
  [[nodiscard]] drivers::Chunk read(std::int64_t) noexcept override {
    if (given_) return {};
    given_ = true;
    return {.bytes = bytes_, .socket = 1, .kernel_dropped = 3};
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

// Asks for one thing after the other, and now and then for nothing.
struct AskingDecoder final : drivers::Decoder {
  void feed(std::span<const std::byte>, std::int64_t, Sink&) noexcept override {}
  drivers::Request next_request(std::int64_t) noexcept override {
    ++asked;
    if (asked % 2 == 0) return {};
    question[0] = std::byte{static_cast<std::uint8_t>(asked)};
    return {.bytes = question, .socket = 1};
  }
  std::array<std::byte, 1> question{};
  int asked = 0;
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
  CHECK(counters.kernel_dropped == 3);
}

// What waits in a link while posed or the computer is stopped would go out as new.
TEST_CASE("after posed stood still links are opened again, and sockets that only listen are not") {
  class Waiting final : public drivers::Transport {
   public:
    explicit Waiting(bool listens) : listens_(listens) {}
    [[nodiscard]] int poll_fd() const noexcept override { return wake_->fd(); }
    [[nodiscard]] bool only_listens() const noexcept override { return listens_; }
    Result<> start(std::int64_t) override { return {}; }
    [[nodiscard]] drivers::Chunk read(std::int64_t) noexcept override { return {}; }

   private:
    std::unique_ptr<system::EventFd> wake_ = system::EventFd::open().value();
    bool listens_;
  };
  for (const bool listens : {false, true}) {
    drivers::Device device;
    device.transport = std::make_unique<Waiting>(listens);
    device.decoder = std::make_unique<SocketDecoder>();
    DeviceSlot slot;
    slot.supervisor = system::EventFd::open().value();
    Ring<Item> decoded(64);
    SourceCounters counters;
    const auto wake = system::EventFd::open().value();
    const auto reader = Reader::open({.out = &decoded,
                                      .pipeline = wake.get(),
                                      .record_sink = nullptr,
                                      .clock = test_clock,
                                      .commands = nullptr})
                            .value();
    reader->add({.device = &device, .counters = &counters, .slot = &slot});
    reader->begin();
    const auto is_back = [&] { return !slot.out.empty(); };
    for (int i = 0; i < 100; ++i, now_ns += system::kMaxSleep_ns) {
      static_cast<void>(reader->turn(now_ns));
      CHECK_FALSE(is_back());
    }
    now_ns += 5 * kNanosPerSecond;
    static_cast<void>(reader->turn(now_ns));
    CHECK(is_back() == !listens);
  }
}

TEST_CASE("a decoder says what to ask next, and the log keeps what was asked") {
  struct Record final : test::QuietRecordSink {
    void chunk(std::uint32_t, std::uint8_t socket, Direction direction, std::int64_t,
               const Position&, std::span<const std::byte> bytes) noexcept override {
      if (direction != Direction::kToDevice) return;
      asked.push_back(std::to_integer<int>(bytes[0]));
      sockets.push_back(socket);
    }
    std::vector<int> asked, sockets;
  } record;
  drivers::Device device;
  device.transport = std::make_unique<TwoSockets>();
  auto decoder = std::make_unique<AskingDecoder>();
  const AskingDecoder& asking = *decoder;
  device.decoder = std::move(decoder);
  device.poll.period_ns = kNanosPerSecond;
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
  const std::int64_t start_ns = now_ns;
  for (int turn = 0; turn < 5; ++turn) {
    static_cast<void>(reader->turn(now_ns));
    static_cast<void>(reader->turn(now_ns));  // not due again yet
    now_ns += kNanosPerSecond;
  }
  now_ns = start_ns;
  CHECK(asking.asked == 5);
  CHECK(record.asked == std::vector<int>{1, 3, 5});
  CHECK(record.sockets == std::vector<int>{1, 1, 1});
}

TEST_CASE("a log's device sends each datagram to the socket that it came to") {
  const test::TempFolder folder;
  const std::string file = (folder.path() / "take.plog").string();
  {
    auto log = log::Writer::create(file, {}).value();
    REQUIRE(log.add(log::SourceRow{0, "room", "template_mocap", "", "", "{}"}));
    REQUIRE(log.add(log::StreamRow{0, 0, "Ann", "room-ann", "{}", 1}));
    const std::array<std::byte, 1> byte{};
    for (const std::uint32_t socket : {1U, 0U, 1U}) {
      REQUIRE(log.add(log::ChunkRow{.socket = socket,
                                    .direction = static_cast<std::uint8_t>(Direction::kFromDevice),
                                    .arrival_ns = 1'000,
                                    .bytes = byte}));
    }
    REQUIRE(log.close());
  }
  auto device = emulate::read_logged_device(file, "", 2);
  REQUIRE(device);
  emulate::LogEmulator emulator(std::move(device->recording), nullptr);
  std::vector<int> sockets;
  while (!emulator.done()) {
    sockets.push_back(emulator.next_socket());
    std::vector<std::byte> datagram;
    emulator.emit(0, datagram);
    CHECK(datagram.size() == 1);
  }
  CHECK(sockets == std::vector<int>{1, 0, 1});
  // The log does not say whether the device had more sockets, so more addresses do no harm.
  CHECK(emulate::read_logged_device(file, "", 3));
  const auto refused = emulate::read_logged_device(file, "", 1);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().text().ends_with(
      "it has datagrams of 2 sockets of the host; name one address for each with --udp, in their"
      " order"));
}

}  // namespace posed::pipeline
