// A supervisor, a reader and an emulated glove on threads of their own: a glove that is plugged in,
// unplugged and plugged in again is read each time. Also runs under the thread sanitizer.
#include <memory>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "daemon/devices/device_supervisor.hpp"
#include "daemon/devices/open_source.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/options.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::devices {

using emulate::EmulatedDevice;
using emulate::EmulatedPort;
namespace {

using namespace std::chrono_literals;

const drivers::Driver& lucidgloves() { return *drivers::find_driver("lucidgloves"); }

// Plugged in while this object exists.
class PluggedGlove {
 public:
  explicit PluggedGlove(const std::filesystem::path& port)
      : glove_(lucidgloves().emulate({}).value(), EmulatedPort::open_pty(port).value(), {}, {}),
        thread_([this](const std::stop_token& stop) { glove_.run(stop); }) {}

 private:
  EmulatedDevice glove_;
  std::jthread thread_;
};

// A stream whose glove is unplugged, with its reader running and its supervisor looking for the
// glove.
class SupervisedStream {
 public:
  explicit SupervisedStream(const std::filesystem::path& port) {
    config::StreamConfig config;
    config.name = "right";
    config.driver = "lucidgloves";
    config.options = drivers::complete_options(lucidgloves(), {{"port", port.string()}}).value();
    ModelFiles files;
    source = devices::open_source(config::source_of(config), files).value();
    reader_ = pipeline::Reader::open({.out = &decoded_,
                                      .pipeline = wake_.get(),
                                      .record_sink = nullptr,
                                      .clock = system::monotonic_ns,
                                      .commands = &commands_})
                  .value();
    reader_->add({.device = nullptr,
                  .counters = &source->counters,
                  .slot = source->slot.get(),
                  .calibration = nullptr,
                  .body = pipeline::ReadBody{.stream = 0, .counters = &counters}});
    reader_thread_ = std::thread([this] { reader_->run(); });
    supervisor_.emplace(*source,
                        SupervisorPorts{.reader = reader_.get(),
                                        .clock = system::monotonic_ns,
                                        .report = [this](v1::Event::Kind kind, const std::string&) {
                                          lost += kind == v1::Event::KIND_LOST ? 1 : 0;
                                          found += kind == v1::Event::KIND_FOUND ? 1 : 0;
                                        }});
  }
  ~SupervisedStream() {
    reader_->stop();
    reader_thread_.join();
  }

  // Number of frames that came within ten seconds, up to `count`.
  int take_frames(int count) {
    int came = 0;
    const auto take = [&](const pipeline::Item& item) {
      came += item.kind == pipeline::Item::Kind::kFrame ? 1 : 0;
    };
    for (const std::int64_t until_ns = system::monotonic_ns() + 10 * kNanosPerSecond;
         came < count && system::monotonic_ns() < until_ns;) {
      if (!decoded_.consume(take)) std::this_thread::sleep_for(1ms);
    }
    return came;
  }
  // Waits until the reader has returned the glove, and discards what the glove had sent.
  void wait_for_loss(int times) {
    while (lost.load() < times) std::this_thread::sleep_for(1ms);
    while (decoded_.consume([](const pipeline::Item&) {})) {
    }
  }
  void calibrate(const drivers::glove::OwnedCalibration& calibration) {
    REQUIRE(commands_.push({.kind = pipeline::DeviceCommand::Kind::kCalibrate,
                            .source = 0,
                            .ticket = 7,
                            .calibration = &calibration}));
    reader_->call();
  }

  std::unique_ptr<devices::OpenSource> source;
  pipeline::StreamCounters counters;
  std::atomic<int> lost{0}, found{0};

 private:
  pipeline::Ring<pipeline::Item> decoded_{1024};
  pipeline::Ring<pipeline::DeviceCommand> commands_{16};
  std::unique_ptr<system::EventFd> wake_ = system::EventFd::open().value();
  std::unique_ptr<pipeline::Reader> reader_;
  // destroyed after the reader's thread, before the reader
  std::optional<DeviceSupervisor> supervisor_;
  std::thread reader_thread_;
};

}  // namespace

TEST_CASE("a supervised glove is read each time it is plugged in, and calibrated again") {
  const test::TempFolder folder;
  const auto port = folder.path() / "glove";
  const auto description = lucidgloves().expect({{"port", port.string()}}).value();
  const drivers::glove::OwnedCalibration calibration{
      drivers::glove::default_calibration(lucidgloves().glove->glove_model(description).value())
          .value(),
      "calibration"};
  SupervisedStream kept(port);
  CHECK(kept.take_frames(0) == 0);
  for (int time = 1; time <= 3; ++time) {
    {
      const PluggedGlove glove(port);
      REQUIRE(kept.take_frames(20) == 20);
      CHECK(kept.found.load() == time);
      kept.calibrate(calibration);
      REQUIRE(kept.take_frames(20) == 20);
    }
    kept.wait_for_loss(time);
  }
  CHECK(kept.counters.reader.dropped.load() == 0);
}

TEST_CASE("a link that gives nothing is told once, by what most of its packets were") {
  pipeline::SourceCounters counters;
  UseWatch watch;
  std::int64_t now_ns = 0;
  const auto after_3_s = [&](Outcome outcome, int packets, bool use = false, bool asks = false) {
    counters.outcome[static_cast<std::size_t>(outcome)] += packets;
    if (use) counters.used_ns = now_ns + 1;
    CHECK(watch.look(counters, asks, now_ns).empty());  // the time begins with the first packet
    now_ns += 3 * kNanosPerSecond;
    return watch.look(counters, asks, now_ns);
  };
  const auto has = [](const std::string& text, const char* word) {
    return text.find(word) != std::string::npos;
  };
  CHECK(after_3_s(Outcome::kOk, 0).empty());  // silence is no fault
  CHECK(has(after_3_s(Outcome::kOk, 0, false, true), "nothing has answered"));
  CHECK(after_3_s(Outcome::kOk, 0, false, true).empty());
  CHECK(has(after_3_s(Outcome::kForeign, 9), "another program's"));
  CHECK(after_3_s(Outcome::kForeign, 9).empty());
  CHECK(has(after_3_s(Outcome::kOk, 9), "none has given a stream a pose"));
  // Others give poses, but one person's are refused.
  CHECK(has(after_3_s(Outcome::kOutOfRange, 360, true), "no rotation"));
  watch.restart(counters, now_ns);
  CHECK(after_3_s(Outcome::kOk, 300, true).empty());
  CHECK(after_3_s(Outcome::kDuplicate, 300).empty());  // paused
  counters.outcome[static_cast<std::size_t>(Outcome::kOk)] += 200;
  CHECK(after_3_s(Outcome::kShort, 200, true).empty());
  CHECK(has(after_3_s(Outcome::kShort, 200, true), "another version"));
}

}  // namespace posed::devices
