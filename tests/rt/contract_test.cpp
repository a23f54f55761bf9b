// The real-time contract holds on the real reader and pipeline threads, and each kind of violation
// is detected when it is put into those threads on purpose.
#include <spdlog/spdlog.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include "daemon/system/clock.hpp"
#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/glove/traits.hpp"
#include "drivers/options.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "models/feet/feet_stage.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/gp/synthetic.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/hand_clip.hpp"
#include "tests/rt/check_no_breach.hpp"
#include "tests/rt/contract.hpp"
#include "tests/rt/rig.hpp"
#include "tests/support/parameter_index.hpp"
#include "tests/support/quiet_record_sink.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/support/synthetic_arms.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::rt {
namespace {

using pipeline::Command;

// A record sink that keeps the contract itself; the recorder's own sink has its own tests.
class CountingRecordSink final : public test::QuietRecordSink {
 public:
  void chunk(std::uint32_t, std::uint8_t, pipeline::Direction, std::int64_t,
             const pipeline::Position&, std::span<const std::byte>) noexcept override {
    ++chunks;
  }
  void decision(const pipeline::Decision&) noexcept override { ++decisions; }
  std::atomic<int> chunks{0}, decisions{0};
};

drivers::Device open_device(const char* driver, const drivers::Options& options) {
  drivers::TransportFactory ports;
  return drivers::find_driver(driver)->open(options, ports).value();
}

// Violates the contract once, at the fifth chunk.
class BreakingDecoder final : public drivers::Decoder {
 public:
  BreakingDecoder(std::unique_ptr<drivers::Decoder> inner, std::function<void()> breach)
      : inner_(std::move(inner)), breach_(std::move(breach)) {}
  void feed(std::span<const std::byte> bytes, std::int64_t arrival_ns,
            Sink& sink) noexcept override {
    if (++chunks_ == 5) breach_();
    inner_->feed(bytes, arrival_ns, sink);
  }

 private:
  std::unique_ptr<drivers::Decoder> inner_;
  std::function<void()> breach_;
  int chunks_ = 0;
};

}  // namespace

TEST_CASE("reader and pipeline keep the real-time contract", "[rt]") {
  watch_log();
  const test::TempFolder folder;
  const auto path = folder.path() / "toy.bvh";
  REQUIRE(clip::write_bvh(test::toy_walk(120, 120.0), path));
  CountingRecordSink record_sink;
  const auto device = open_device("file", {{"path", path.string()}});
  const Skeleton& skeleton = *device.description.skeleton;
  const auto first = style::bind_model(test::toy_model(1), skeleton, "first").value();
  const auto second = style::bind_model(test::toy_styles({2, 3, 4}), skeleton, "second").value();
  const auto change = [](std::size_t command, const StageCommand& payload, std::uint64_t ticket) {
    return Command{.change = {.kind = pipeline::StageChange::Kind::kCommand,
                              .index = static_cast<std::uint8_t>(command),
                              .type = &style::style_type()},
                   .ticket = ticket,
                   .command = payload};
  };
  const auto weights = style::shares_of("s3=0.5,s4=0.5", second->styles()).value();
  const auto mask = style::mask_of("legs=0.5").value();
  std::vector<RigStream> streams;
  streams.push_back(
      {.device = open_device("file", {{"path", path.string()}}), .style = first.get()});
  streams.push_back({.device = open_device("labels", {{"rate_hz", 100.0}})});
  // Plays once at 20 times its speed, so it ends, and is silent until the end is noticed.
  streams.push_back(
      {.device = open_device("file", {{"path", path.string()}, {"loop", false}, {"pace", 0.0}}),
       .style = first.get()});
  Rig rig(std::move(streams), &record_sink);
  forget_breaches();
  rig.start();
  REQUIRE(rig.take_frames(200) == 200);
  rig.command(test::alpha_command(0, 0.5, 1));
  rig.command(test::model_command(0, style::style_type(), second.get(), 2));
  rig.command(change(style::StyleFilter::kWeights, StageCommand::of(weights), 3));
  rig.command(change(style::StyleFilter::kMask, StageCommand::of(mask), 4));
  REQUIRE(rig.take_frames(200) == 200);
  CHECK(rig.take_acks() == 4);
  CHECK(record_sink.chunks > 0);
  CHECK(record_sink.decisions >= 2);
  if (!rig.system_calls_watched()) WARN("SKIPPED: this kernel has no syscall user dispatch");
  check_no_breach();
}

TEST_CASE("a styled body whose feet stand keeps the real-time contract", "[rt]") {
  watch_log();
  const test::TempFolder folder;
  const auto path = folder.path() / "walker.bvh";
  REQUIRE(clip::write_bvh(motion::make_walker({.rate_hz = 120.0}).value(), path));
  CountingRecordSink record_sink;
  auto device = open_device("file", {{"path", path.string()}});
  const Skeleton& skeleton = *device.description.skeleton;
  style::StyleModel model;
  model.space = motion::describe_space(motion::Space::kNative, skeleton).value();
  model.process = gp::synthetic(56, motion::space_dims(model.space)).process;
  const auto bound = style::bind_model(model, skeleton, "walker").value();
  std::vector<RigStream> streams;
  streams.push_back({.device = std::move(device), .style = bound.get(), .feet = true});
  Rig rig(std::move(streams), &record_sink);
  forget_breaches();
  rig.start();
  REQUIRE(rig.take_frames(200) == 200);
  rig.command({.change = {.kind = pipeline::StageChange::Kind::kSet,
                          .index = test::parameter_index(feet::feet_type(), "root"),
                          .type = &feet::feet_type(),
                          .value = static_cast<double>(feet::RootMode::kStride)},
               .ticket = 1});
  REQUIRE(rig.take_frames(200) == 200);
  CHECK(rig.take_acks() == 1);
  if (!rig.system_calls_watched()) WARN("SKIPPED: this kernel has no syscall user dispatch");
  check_no_breach();
}

TEST_CASE("hands keep the real-time contract: smoothed, constrained, performing, with a new model",
          "[rt]") {
  watch_log();
  const test::TempFolder folder;
  const auto path = folder.path() / "hand.csv";
  const auto signer = gesture::make_performance({.person = 3, .gestures = 6}).value();
  REQUIRE(clip::write_hand_csv(signer.clip, path));
  CountingRecordSink record_sink;
  std::vector<RigStream> streams;
  streams.push_back({.device = open_device("file", {{"path", path.string()}, {"pace", 4.0}})});
  streams.push_back({.device = open_device("labels", {{"rate_hz", 120.0}})});
  // Falls silent while frames wait in the smoother, and performs.
  streams.push_back(
      {.device = open_device("file", {{"path", path.string()}, {"loop", false}, {"pace", 0.0}})});
  std::vector<std::unique_ptr<const generate::BoundModel>> models;
  const auto bind = [&](const drivers::Description& hand) {
    models.push_back(
        generate::bind_model(test::toy_gesture_model(), *hand.skeleton, hand.rate_hz, "toy")
            .value());
    return models.back().get();
  };
  for (RigStream& stream : streams) stream.gesture = bind(stream.device.description);
  const auto* const another = bind(streams[0].device.description);
  const auto order = gesture::make_play_order(models[0]->gesture(),
                                              gesture::split_labels("g 1 c 3 4 p"), 2.0, true)
                         .value();
  Rig rig(std::move(streams), &record_sink);
  forget_breaches();
  rig.start();
  REQUIRE(rig.take_frames(150) == 150);
  for (std::uint32_t i = 0; i < 3; ++i) {
    rig.command(test::play_command(i, order, 1 + i));
  }
  REQUIRE(rig.take_frames(150) == 150);
  rig.command(test::model_command(0, generate::generate_type(), another, 4));
  rig.command(test::stop_playing_command(1, 5));
  REQUIRE(rig.take_frames(150) == 150);
  CHECK(rig.take_acks() == 5);
  check_no_breach();
}

TEST_CASE("bodies keep the real-time contract: recognised, performing, with a new model", "[rt]") {
  watch_log();
  const test::TempFolder folder;
  const auto path = folder.path() / "take.bvh";
  REQUIRE(clip::write_bvh(test::raise_take({.left = true}), path));
  const gesture::GestureModel arms = test::synthetic_arms();
  CountingRecordSink record_sink;
  std::vector<RigStream> streams;
  streams.push_back({.device = open_device("file", {{"path", path.string()}, {"pace", 4.0}})});
  streams.push_back(
      {.device = open_device("labels", {{"body", path.string()}, {"rate_hz", 120.0}})});
  std::vector<std::unique_ptr<const generate::BoundModel>> models;
  const auto bind = [&](const drivers::Description& body) {
    models.push_back(generate::bind_model(arms, *body.skeleton, body.rate_hz, "arms").value());
    return models.back().get();
  };
  for (RigStream& stream : streams) stream.gesture = bind(stream.device.description);
  const auto* const another = bind(streams[0].device.description);
  const auto order =
      gesture::make_play_order(arms, gesture::split_labels("raise-both rest raise-left"), 2.0, true)
          .value();
  Rig rig(std::move(streams), &record_sink);
  forget_breaches();
  rig.start();
  REQUIRE(rig.take_frames(150) == 150);
  for (std::uint32_t i = 0; i < 2; ++i) rig.command(test::play_command(i, order, 1 + i));
  REQUIRE(rig.take_frames(150) == 150);
  rig.command(test::model_command(0, generate::generate_type(), another, 3));
  rig.command(test::stop_playing_command(1, 4));
  REQUIRE(rig.take_frames(150) == 150);
  CHECK(rig.take_acks() == 4);
  check_no_breach();
}

TEST_CASE("a glove keeps the real-time contract: read, calibrated, vibrated, unplugged and back",
          "[rt]") {
  watch_log();
  CountingRecordSink record_sink;
  const auto plug_in = [] {
    auto emulator =
        drivers::find_driver("lucidgloves")
            ->emulate(drivers::complete_options(*drivers::find_driver("lucidgloves"), {}).value());
    return std::make_unique<emulate::EmulatedDevice>(std::move(*emulator),
                                                     emulate::EmulatedPort::open_pty().value(),
                                                     nullptr, emulate::EmulatedDevice::Settings{});
  };
  auto glove = plug_in();
  const auto wear = [&] {
    return std::jthread([&glove](const std::stop_token& stop) { glove->run(stop); });
  };
  std::jthread worn = wear();
  pipeline::DeviceSlot slot;
  slot.supervisor = system::EventFd::open().value();
  std::vector<RigStream> streams;
  streams.push_back(
      {.device = open_device("lucidgloves", {{"port", glove->port()}}), .slot = &slot});
  const auto model =
      drivers::find_driver("lucidgloves")->glove->glove_model(streams[0].device.description);
  const drivers::glove::OwnedCalibration calibration{
      drivers::glove::default_calibration(*model).value(), "calibration"};
  drivers::Device again;
  {
    Rig rig(std::move(streams), &record_sink);
    forget_breaches();
    rig.start();
    REQUIRE(rig.take_frames(50) == 50);
    rig.command({.kind = pipeline::DeviceCommand::Kind::kCalibrate,
                 .ticket = 1,
                 .calibration = &calibration});
    rig.command({.kind = pipeline::DeviceCommand::Kind::kSend, .size = 5});
    REQUIRE(rig.take_frames(50) == 50);
    CHECK(rig.take_acks() == 1);
    worn.request_stop();
    worn.join();
    glove.reset();  // unplugged
    drivers::Device* lost = nullptr;
    while (!slot.out.consume([&](drivers::Device* device) { lost = device; })) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    lost->transport.reset();
    glove = plug_in();
    worn = wear();
    again = open_device("lucidgloves", {{"port", glove->port()}});
    again.transport->start(system::monotonic_ns()).value();
    REQUIRE(slot.in.push(&again));
    rig.call_reader();
    REQUIRE(rig.take_frames(50) == 50);
    if (!rig.system_calls_watched()) WARN("SKIPPED: this kernel has no syscall user dispatch");
    check_no_breach();
  }
}

TEST_CASE("each kind of violation of the real-time contract is detected", "[rt]") {
  watch_log();
  struct Way {
    Breach breach;
    std::function<void()> commit;
  };
  static std::mutex mutex;
  const std::vector<Way> ways{
      {Breach::kAllocation, [] { delete new volatile int(1); }},
      {Breach::kLock, [] { const std::scoped_lock lock(mutex); }},
      {Breach::kLog, [] { spdlog::info("hot"); }},
      {Breach::kThrow,
       [] {
         try {
           throw 1;
         } catch (int) {
         }
       }},
      {Breach::kSystemCall, [] { syscall(SYS_getppid); }},
  };
  for (const Way& way : ways) {
    INFO(kBreachNames[static_cast<std::size_t>(way.breach)]);
    std::vector<RigStream> streams;
    streams.push_back({.device = open_device("labels", {{"rate_hz", 500.0}})});
    auto& decoder = streams[0].device.decoder;
    decoder = std::make_unique<BreakingDecoder>(std::move(decoder), way.commit);
    Rig rig(std::move(streams), nullptr);
    forget_breaches();
    rig.start();
    REQUIRE(rig.take_frames(20) == 20);
    if (way.breach == Breach::kSystemCall && !rig.system_calls_watched()) {
      WARN("SKIPPED: this kernel has no syscall user dispatch");
      continue;
    }
    CHECK(breaches(way.breach) >= 1);
  }
}

}  // namespace posed::rt
