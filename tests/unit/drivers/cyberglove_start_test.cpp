// The start-up exchange with a CyberGlove over a pseudo-terminal, and the errors for devices that
// are not CyberGloves.
#include <poll.h>

#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <thread>

#include "drivers/cyberglove/emulator.hpp"
#include "drivers/driver.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/unit/drivers/collect_sink.hpp"
#include "tests/unit/drivers/pseudo_terminal.hpp"

namespace posed::drivers::cyberglove {
namespace {

using test::CollectSink;
using test::PseudoTerminal;

// A device on a pseudo-terminal, with a thread that replies to commands.
class Box {
 public:
  explicit Box(EmulatorSettings settings) : Box(CyberGloveEmulator::make(settings).value()) {}
  // Without an emulator it replies to everything with the same text.
  explicit Box(std::string answer) : answer_(std::move(answer)), thread_([this] { run(); }) {}
  ~Box() {
    stop_ = true;
    thread_.join();
  }
  [[nodiscard]] const std::string& port() const { return terminal_.port(); }

 private:
  explicit Box(std::unique_ptr<Emulator> emulator)
      : emulator_(std::move(emulator)), thread_([this] { run(); }) {}

  void run() {
    Emulator::Bytes out;
    while (!stop_) {
      pollfd wanted{.fd = terminal_.fd(), .events = POLLIN, .revents = 0};
      const bool received = ::poll(&wanted, 1, 2) == 1 && (wanted.revents & POLLIN) != 0;
      const std::int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
      out.clear();
      if (received) {
        const std::string text = terminal_.received();
        if (emulator_) {
          emulator_->receive(std::as_bytes(std::span(text)), now_ns, out);
        } else {
          for (const char c : answer_) out.push_back(static_cast<std::byte>(c));
        }
      }
      if (emulator_ && emulator_->next_due_ns() != kNoTime_ns &&
          emulator_->next_due_ns() <= now_ns) {
        emulator_->emit(now_ns, out);
      }
      if (!out.empty()) {
        (void)!::write(terminal_.fd(), out.data(), out.size());
      }
    }
  }

  PseudoTerminal terminal_;
  std::unique_ptr<Emulator> emulator_;
  std::string answer_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

Result<Device> open_box(const Box& box, Options options) {
  options["port"] = box.port();
  TransportFactory ports;
  return find_driver("cyberglove")->open(options, ports);
}

// Reads samples of an opened glove and polls for them if the mode needs it.
void read_samples(Device& device, std::size_t count, CollectSink& sink) {
  REQUIRE(device.transport->start(0));
  for (int tries = 0; sink.samples.size() < count && tries < 5000; ++tries) {
    if (!device.poll.request.empty()) REQUIRE(device.transport->send(device.poll.request));
    pollfd wanted{.fd = device.transport->poll_fd(), .events = POLLIN, .revents = 0};
    (void)::poll(&wanted, 1, 10);
    device.decoder->feed(device.transport->read(0).bytes, 0, sink);
  }
}

}  // namespace

TEST_CASE("a CyberGlove is found, configured and read, in every form and mode") {
  struct Case {
    EmulatorSettings settings;
    Options options;
    std::string expected;
  };
  const std::vector<Case> cases{
      {{}, {}, "sensors=22 mask=8388479 form=8bit mode=stream time=1"},
      {{.mask = kMask18},
       {{"time", false}},
       "sensors=18 mask=8108863 form=8bit mode=stream time=0"},
      {{.hand = Side::kLeft}, {{"hand", std::string("left")}}, "hand=left"},
      {{}, {{"mode", std::string("poll")}}, "mode=poll"},
      {{}, {{"mode", std::string("sync")}}, "mode=sync"},
      {{.level_one = true, .info = "CyberGlove III"},
       {{"form", std::string("16bit")}},
       "form=16bit mode=stream time=1 status=1 ticks=1280 multiplier=3"},
  };
  for (const Case& one : cases) {
    INFO(one.expected);
    const Box box(one.settings);
    auto device = open_box(box, one.options);
    if (!device) FAIL(device.error().text());
    CHECK(device->description.text.contains(one.expected));
    CHECK(device->reopen_after_s == 1.0);
    const auto promised = find_driver("cyberglove")->expect(one.options);
    REQUIRE(promised);
    CHECK(promised->samples.names == device->description.samples.names);
    CHECK(promised->skeleton->id == device->description.skeleton->id);
    CollectSink sink;
    read_samples(*device, 3, sink);
    CHECK(sink.samples.size() >= 3);
    CHECK(sink.frames.size() == sink.samples.size());
  }
}

TEST_CASE("a CyberGlove that still streams from before is caught") {
  const Box box(EmulatorSettings{});
  for (int round = 0; round < 2; ++round) {
    auto device = open_box(box, {});
    if (!device) FAIL(device.error().text());
    CollectSink sink;
    read_samples(*device, 3, sink);
    CHECK(sink.samples.size() >= 3);
  }
}

TEST_CASE("a device that is not the intended CyberGlove is refused with an error message") {
  const auto message = [](const Box& box, Options options) {
    const auto device = open_box(box, std::move(options));
    REQUIRE_FALSE(device);
    CHECK(device.error().message.find('\n') == std::string::npos);
    return device.error().message;
  };
  CHECK(message(Box(std::string()), {}).contains("nothing answers"));
  CHECK(message(Box(std::string("GPS 2000 ready\r\n")), {}).contains("another device"));
  CHECK(message(Box(std::string("\xF8\x9E\x02\xFE\xE6\x86")), {}).contains("set baud"));
  CHECK(message(Box(EmulatorSettings{.plugged_in = false}), {}).contains("not plugged into"));
  CHECK(message(Box(EmulatorSettings{.hand = Side::kLeft}), {}).contains("hand = \"left\""));
  CHECK(message(Box(EmulatorSettings{.mask = kMask18}), {{"sensors", std::int64_t{22}}})
            .contains("18 sensors, not 22"));
  CHECK(message(Box(EmulatorSettings{}), {{"form", std::string("16bit")}})
            .contains("only a CyberGlove III"));
}

TEST_CASE("a CyberGlove's options are checked before anything is opened") {
  TransportFactory ports;
  for (const Options& wrong :
       std::vector<Options>{{{"form", std::string("9bit")}},
                            {{"mode", std::string("push")}},
                            {{"hand", std::string("third")}},
                            {{"rate_hz", -1.0}},
                            {{"rate_hz", 0.1}},
                            {{"mode", std::string("poll")}, {"rate_hz", 0.0}},
                            {{"mode", std::string("sync")}, {"form", std::string("16bit")}}}) {
    const auto device = find_driver("cyberglove")->open(wrong, ports);
    REQUIRE_FALSE(device);
    CHECK(device.error().exit_code == ExitCode::kWrongUse);
  }
}

}  // namespace posed::drivers::cyberglove
