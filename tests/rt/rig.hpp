// The real reader and pipeline threads with real clips, as the daemon runs them, with the real-time
// contract checked on both.
#pragma once

#include <memory>
#include <thread>
#include <vector>

#include "daemon/pipeline/reader.hpp"
#include "daemon/pipeline/stream_context.hpp"
#include "daemon/pipeline/worker.hpp"
#include "models/generate/bound_model.hpp"
#include "models/style/live/style_filter.hpp"

namespace posed::rt {

// A stream of the rig; it has the stages for which it has models.
struct RigStream {
  drivers::Device device;
  const style::BoundModel* style = nullptr;
  bool feet = false;  // behind the style
  const generate::BoundModel* gesture = nullptr;
  pipeline::DeviceSlot* slot = nullptr;  // for a device that can be unplugged
};

class Rig {
 public:
  Rig(std::vector<RigStream> streams, pipeline::RecordSink* record_sink);
  ~Rig();  // stops both threads

  void start();
  // Takes items from the pipeline until `frames` styled frames have come; returns how many came
  // within ten seconds.
  int take_frames(int frames);
  // Sends a command, as control would.
  void command(const pipeline::Command& command);
  void command(const pipeline::DeviceCommand& command);
  // Tells the reader that a stream's slot has something.
  void call_reader() { reader_->call(); }
  // Takes the waiting acknowledgements and returns how many there were.
  [[nodiscard]] int take_acks();
  [[nodiscard]] bool system_calls_watched() const noexcept { return watched_.load() == 2; }

 private:
  std::vector<RigStream> streams_;
  std::vector<std::unique_ptr<pipeline::StreamCounters>> counters_;
  std::vector<std::unique_ptr<pipeline::SourceCounters>> source_counters_;
  pipeline::Ring<pipeline::Item> decoded_{1024};
  pipeline::Ring<pipeline::Item> finished_{1024};
  pipeline::Ring<pipeline::Command> commands_{16};
  pipeline::Ring<pipeline::DeviceCommand> device_commands_{16};
  pipeline::Ring<pipeline::Ack> acks_{16};
  std::unique_ptr<system::EventFd> builder_wake_ = system::EventFd::open().value();
  std::unique_ptr<system::EventFd> pipeline_wake_, publisher_wake_;
  pipeline::StreamExchange exchange_;
  std::vector<std::unique_ptr<pipeline::StreamContext>> contexts_;
  std::unique_ptr<pipeline::Worker> worker_;
  std::unique_ptr<pipeline::Reader> reader_;
  std::atomic<int> watched_{0};
  std::thread worker_thread_, reader_thread_;
};

}  // namespace posed::rt
