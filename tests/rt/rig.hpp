// The real reader and pipeline threads on real clips, as the daemon runs them, with the real-time
// contract watched on both.
#pragma once

#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "daemon/pipeline/reader.hpp"
#include "daemon/pipeline/worker.hpp"
#include "models/style/style_filter.hpp"

namespace posed::rt {

// A stream of the rig, with the stages that its models are for.
struct RigStream {
  drivers::Device device;
  const style::BoundModel* style = nullptr;
  const generate::BoundModel* gesture = nullptr;
  pipeline::DeviceSlot* slot = nullptr;  // for a device that goes and comes
};

class Rig {
 public:
  Rig(std::vector<RigStream> streams, pipeline::RecordSink* record_sink);
  ~Rig();  // stops both threads

  void start();
  // Takes items from the pipeline until `frames` styled frames have come; returns how many came
  // before ten seconds were over.
  int take_frames(int frames);
  // Puts a command where control would.
  void command(const pipeline::Command& command);
  void command(const pipeline::DeviceCommand& command);
  // There is something in a stream's slot.
  void call_reader() { reader_->call(); }
  // Acknowledgements that have come.
  [[nodiscard]] int take_acks();
  [[nodiscard]] bool system_calls_watched() const noexcept { return watched_.load() == 2; }

 private:
  std::vector<RigStream> streams_;
  std::vector<std::unique_ptr<pipeline::StreamCounters>> counters_;
  pipeline::Ring<pipeline::Item> decoded_{1024};
  pipeline::Ring<pipeline::Item> finished_{1024};
  pipeline::Ring<pipeline::Command> commands_{16};
  pipeline::Ring<pipeline::DeviceCommand> device_commands_{16};
  pipeline::Ring<pipeline::Ack> acks_{16};
  std::unique_ptr<system::EventFd> pipeline_wake_, publisher_wake_;
  std::unique_ptr<pipeline::Worker> worker_;
  std::unique_ptr<pipeline::Reader> reader_;
  std::atomic<int> watched_{0};
  std::thread worker_thread_, reader_thread_;
};

}  // namespace posed::rt
