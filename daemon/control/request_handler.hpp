// RequestHandler gives control messages their effect. No socket, no thread: untrusted bytes in,
// replies out. The control thread and the fuzz target drive the same object. Any thread may call
// any function.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/control/model_folder.hpp"
#include "daemon/control/uploads.hpp"
#include "daemon/devices/present_device.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/stream_settings.hpp"
#include "daemon/pipeline/take.hpp"
#include "daemon/system/clock.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::v1 {
class ControlReply;
class ControlRequest;
class Stats;
}  // namespace posed::v1

namespace posed::control {

inline constexpr std::size_t kMaxRequest = 64 * 1024;  // bytes
using pipeline::kMaxUnderWay;

// A stream as the control thread sees it.
struct ControlledStream {
  std::uint32_t stream = 0;  // id
  std::string name;
  bool publishes_raw = false;
  std::shared_ptr<const Skeleton> skeleton;  // models are bound to it; null: samples only
  pipeline::StreamSettings settings{};       // with the stages
  // The models in use, one for each stage, null while there is none. The cold side owns every
  // model; the pipeline only borrows it.
  std::vector<std::unique_ptr<const StageModel>> models{};
  // The device that calibrations must fit.
  std::shared_ptr<devices::PresentDevice> device = std::make_shared<devices::PresentDevice>();
  drivers::Options options;  // of its driver
  // The calibration that was sent last and is in use by the reader; null: the one from the start.
  std::unique_ptr<const drivers::glove::OwnedCalibration> calibration;
  // Of a body of a device with several: the source's name in the config. Of a device with one, the
  // reader's number is the stream's slot.
  std::string source{};
};

// What the handler needs from the rest of the daemon. All calls come from the control thread.
class DaemonControl {
 public:
  DaemonControl() = default;
  DaemonControl(const DaemonControl&) = delete;
  DaemonControl& operator=(const DaemonControl&) = delete;
  virtual ~DaemonControl() = default;

  // Puts the command into the pipeline's ring; returns false if it is full.
  [[nodiscard]] virtual bool send(const pipeline::Command& command) = 0;
  // The same for the reader and its devices.
  [[nodiscard]] virtual bool send(const pipeline::DeviceCommand& command) = 0;
  // Keeps a model's file for the log; call before the command that names its hash.
  virtual void keep_model(std::span<const std::byte> bytes) = 0;
  // A stage of the stream has another model, or another text: `stats` should tell it.
  virtual void stages_changed(std::uint32_t stream, const pipeline::StreamSettings& settings) = 0;
  // Marks a take in the log; fails if the daemon is not recording. Any cold thread.
  [[nodiscard]] virtual Result<pipeline::Take> mark_take(const pipeline::TakeMark& mark) = 0;
  virtual void fill(v1::Stats& stats) = 0;
  virtual void stop() = 0;  // starts the daemon's shutdown; returns at once
};

// The address of the client that sent a request: opaque to the handler, returned with the reply.
using Requester = std::vector<std::string>;
struct Reply {
  Requester to;
  std::string bytes;  // a serialized posed.v1.ControlReply
  bool refused = false;
};

class RequestHandler {
 public:
  // `daemon_control` outlives the handler. Destroy the handler after the pipeline thread has ended,
  // because it owns the models in use. The ids of `streams` are their indices, whatever
  // ControlledStream::stream says.
  RequestHandler(std::vector<ControlledStream> streams, DaemonControl& daemon_control,
                 ModelFolder models = {}, Clock clock = system::monotonic_ns);
  ~RequestHandler();
  RequestHandler(const RequestHandler&) = delete;
  RequestHandler& operator=(const RequestHandler&) = delete;

  // Handles one request. The reply is returned at once, or later by acknowledge() if the pipeline
  // has to act first. Bytes that are not a valid request get a reply with an error sentence, never
  // a crash.
  [[nodiscard]] std::optional<Reply> handle(Requester requester, std::span<const std::byte> bytes);

  // Forgets uploads that have stalled. Returns when to call it next at the latest.
  [[nodiscard]] std::int64_t forget_old(std::int64_t now_ns);

  // The pipeline has applied a command: returns its reply, and frees the model that it replaced.
  [[nodiscard]] std::optional<Reply> acknowledge(const pipeline::Ack& ack);

  // A stream comes. If its slot has an earlier generation, requests no longer reach that one.
  void add_stream(ControlledStream stream);
  // The stream has left, and nothing reads its models any more. Commands under way to it are still
  // acknowledged; until then the handler keeps the models that they brought.
  void remove_stream(std::uint32_t stream);

 private:
  struct BySlot {
    [[nodiscard]] bool operator()(std::uint32_t a, std::uint32_t b) const noexcept {
      return std::pair(pipeline::slot_of(a), a) < std::pair(pipeline::slot_of(b), b);
    }
  };

  // By id, the generations of a slot in their order. An earlier one stays until it is removed,
  // because the pipeline may still read its models.
  using Streams = std::map<std::uint32_t, ControlledStream, BySlot>;
  // The new value of a live text.
  struct LiveText {
    std::string parameter, value;
  };
  struct UnderWay {
    Requester requester;
    std::uint32_t stream = 0;
    std::string name{};  // of the stream, for when it has left
    std::size_t stage = 0;
    std::unique_ptr<const StageModel> model{};  // the stage's new model
    std::string_view refusal{};                 // of a command: what the stage's refusal means
    std::optional<LiveText> text{};             // of a command that sets one
    std::unique_ptr<const drivers::glove::OwnedCalibration> calibration{};
  };
  // Success means that the command is under way; acknowledge() then makes the reply.
  [[nodiscard]] Result<> set_parameter(const v1::ControlRequest& request,
                                       const Requester& requester);
  [[nodiscard]] Result<> stage_command(const v1::ControlRequest& request,
                                       const Requester& requester);
  // Returns true if this was not the last piece, which is acknowledged at once.
  [[nodiscard]] Result<bool> take_model_part(const v1::ControlRequest& request,
                                             const Requester& requester);
  [[nodiscard]] Result<> set_model(const std::string& stream, std::span<const std::byte> bytes,
                                   const std::string& name, const Requester& requester);
  [[nodiscard]] Result<> calibrate(const v1::ControlRequest& request, const Requester& requester);
  [[nodiscard]] Reply list_models(Requester requester) const;
  [[nodiscard]] Reply mark_take(const v1::ControlRequest& request, Requester requester);
  [[nodiscard]] Result<> send_haptics(const v1::ControlRequest& request);
  // Whether the slot has a later generation.
  [[nodiscard]] bool is_earlier(Streams::iterator stream) const;
  // The live stream of this name: of a slot's generations, only the newest lives.
  [[nodiscard]] Result<ControlledStream*> find_stream(const std::string& name);
  // The same, if requests for devices fit it.
  [[nodiscard]] Result<ControlledStream*> find_device(const std::string& name);
  // The stage's model by the time that a command that is sent now takes effect.
  [[nodiscard]] const StageModel* coming_model(const ControlledStream& stream,
                                               std::size_t stage) const;
  [[nodiscard]] Result<> send(const ControlledStream& stream, pipeline::Command command,
                              UnderWay under_way);
  // What acknowledge() does to the stream.
  void apply(ControlledStream& stream, UnderWay& done);

  DaemonControl& daemon_control_;
  const ModelFolder models_;
  Clock clock_;
  std::mutex mutex_;  // guards all below
  Streams streams_;
  Uploads uploads_;
  std::map<std::uint64_t, UnderWay> under_way_;  // by ticket
  std::uint64_t last_ticket_ = 0;
};

}  // namespace posed::control
