// KeptSettings: what control has set for the stages of streams, by the streams' names. It is used
// whenever a stream is built, so it counts for a body that is not there yet or that a stage
// refused, and it stays when a body leaves and returns. Cold; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <string>

#include "daemon/devices/stream_stages.hpp"
#include "daemon/system/event_fd.hpp"
#include "models/stage_type.hpp"

namespace posed::devices {

class KeptSettings {
 public:
  // Notified at each change; outlives the object. Call before the first change.
  void wakes(system::EventFd& builder) { builder_ = &builder; }

  // The value is one that the parameter can have.
  void set(const std::string& stream, const StageType& stage, const std::string& parameter,
           ParameterValue value);
  // `file` holds a model for the stage; `name` is for people. Empty: the stage uses none.
  void set_model(const std::string& stream, const StageType& stage, std::span<const std::byte> file,
                 std::string name);

  // Replaces what the stream has by its config. Stages that it does not have are left out.
  void apply(const std::string& stream, LoadedStages& stages) const;
  // How often something was set for the stream.
  [[nodiscard]] std::uint64_t changes(const std::string& stream) const;

 private:
  struct KeptStage {
    Parameters parameters{};
    ModelBytes model{};  // null: not set
    std::string model_name{};
  };
  struct KeptStream {
    std::map<const StageType*, KeptStage> stages{};
    std::uint64_t changes = 0;
  };
  // Under the mutex. Counts the change.
  [[nodiscard]] KeptStage& changed(const std::string& stream, const StageType& stage);
  // The same bytes where another stream has them already, because a model may have megabytes.
  [[nodiscard]] ModelBytes shared(std::span<const std::byte> file) const;
  void notify() {
    if (builder_ != nullptr) builder_->notify();
  }

  system::EventFd* builder_ = nullptr;
  mutable std::mutex mutex_;
  std::map<std::string, KeptStream> streams_;
};

}  // namespace posed::devices
