#include "tests/rt/rig.hpp"
#include "tests/support/stage_commands.hpp"

#include <chrono>
#include <cstdlib>

#include "daemon/pipeline/stream_context.hpp"
#include "daemon/system/clock.hpp"
#include "models/feet/feet_stage.hpp"
#include "models/gate/gate_stage.hpp"
#include "tests/rt/contract.hpp"

namespace posed::rt {
namespace {

constexpr std::size_t kRigSlots = 1024;  // of the ring to the publisher

}  // namespace

Rig::Rig(std::vector<RigStream> streams, pipeline::RecordSink* record_sink)
    : streams_(std::move(streams)),
      pipeline_wake_(system::EventFd::open().value()),
      publisher_wake_(system::EventFd::open().value()),
      exchange_(streams_.size(), *builder_wake_) {
  worker_ = pipeline::Worker::open({.in = &decoded_,
                                    .out = &finished_,
                                    .commands = &commands_,
                                    .acks = &acks_,
                                    .wake = pipeline_wake_.get(),
                                    .publisher = publisher_wake_.get(),
                                    .streams = &exchange_,
                                    .record_sink = record_sink,
                                    .clock = system::monotonic_ns})
                .value();
  reader_ = pipeline::Reader::open({.out = &decoded_,
                                    .pipeline = pipeline_wake_.get(),
                                    .record_sink = record_sink,
                                    .clock = system::monotonic_ns,
                                    .commands = &device_commands_})
                .value();
  for (std::uint32_t i = 0; i < streams_.size(); ++i) {
    RigStream& stream = streams_[i];
    counters_.push_back(std::make_unique<pipeline::StreamCounters>());
    pipeline::EngineOptions options{.stream = i, .stale_after_ns = 50'000'000, .publish_raw = true};
    const drivers::Description& device = stream.device.description;
    if (stream.style != nullptr) options.stages.push_back(test::style_stage(stream.style));
    if (stream.feet) {
      const auto parameters =
          complete_parameters(feet::feet_type().parameters, {{"root", "actor"}});
      const StageContext context{
          .skeleton = device.skeleton, .rate_hz = device.rate_hz, .parameters = parameters.value()};
      options.stages.push_back(
          {&feet::feet_type(), feet::feet_type().make(context, nullptr).value()});
    }
    if (stream.gesture != nullptr) {
      const StageContext context{
          .skeleton = device.skeleton,
          .rate_hz = device.rate_hz,
          .parameters = complete_parameters(gate::gate_type().parameters, {}).value()};
      if (gate::gate_type().is_default(*device.skeleton, true)) {
        options.stages.push_back(
            {&gate::gate_type(), gate::gate_type().make(context, nullptr).value()});
      }
      options.stages.push_back({&generate::generate_type(),
                                std::make_unique<generate::GenerateStage>(
                                    device.skeleton, smooth::LiveOptions{},
                                    generate::stream_rate_hz(device.rate_hz), stream.gesture)});
      if (hand::constrain_type().is_default(*device.skeleton, true)) {
        options.stages.push_back(
            {&hand::constrain_type(), hand::constrain_type().make(context, nullptr).value()});
      }
    }
    contexts_.push_back(worker_->make_context(std::move(options), stream.device.description.rate_hz,
                                              *counters_.back(), kRigSlots));
    if (!exchange_.coming.push(contexts_.back().get())) std::abort();
    source_counters_.push_back(std::make_unique<pipeline::SourceCounters>());
    reader_->add({.device = &stream.device,
                  .counters = source_counters_.back().get(),
                  .slot = stream.slot,
                  .body = pipeline::ReadBody{.stream = i, .counters = counters_.back().get()}});
  }
}

Rig::~Rig() {
  reader_->stop();
  if (reader_thread_.joinable()) reader_thread_.join();
  worker_->stop();
  if (worker_thread_.joinable()) worker_thread_.join();
}

void Rig::start() {
  for (auto& stream : streams_) {
    stream.device.transport->start(system::monotonic_ns()).value();
  }
  worker_thread_ = std::thread([this] {
    if (watch_system_calls()) ++watched_;
    worker_->run();
  });
  reader_thread_ = std::thread([this] {
    if (watch_system_calls()) ++watched_;
    reader_->run();
  });
}

int Rig::take_frames(int frames) {
  int came = 0;
  const std::int64_t until_ns = system::monotonic_ns() + 60 * kNanosPerSecond;
  while (came < frames && system::monotonic_ns() < until_ns) {
    const bool any = finished_.consume([&](const pipeline::Item& item) {
      if (item.kind == pipeline::Item::Kind::kFrame) ++came;
    });
    if (any) continue;
    // Marked as asleep, so that the pipeline thread has to write to the eventfd.
    publisher_wake_->going_to_sleep();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return came;
}

void Rig::command(const pipeline::Command& command) {
  while (!commands_.push(command)) std::this_thread::yield();
  pipeline_wake_->notify();
}

void Rig::command(const pipeline::DeviceCommand& command) {
  while (!device_commands_.push(command)) std::this_thread::yield();
  reader_->call();
}

int Rig::take_acks() {
  int count = 0;
  while (acks_.consume([&](const pipeline::Ack&) { ++count; })) {
  }
  return count;
}

}  // namespace posed::rt
