// RequestHandler gives control messages their effect. No socket, no thread: untrusted bytes in,
// replies out. The control thread and the fuzz target drive the same object. Any thread may call
// any function.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/control/model_folder.hpp"
#include "daemon/control/model_words.hpp"
#include "daemon/control/recording_folder.hpp"
#include "daemon/control/uploads.hpp"
#include "daemon/devices/kept_settings.hpp"
#include "daemon/devices/present_device.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/stream_settings.hpp"
#include "daemon/pipeline/take.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/pulse.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::v1 {
class ControlReply;
class ControlRequest;
class GloveFit;
class Stats;
}  // namespace posed::v1

namespace posed::teach {
class Teacher;
enum class Subject : std::uint8_t;
struct Pupil;
}  // namespace posed::teach

namespace posed::control {

inline constexpr std::size_t kMaxRequest = 64 * 1024;  // bytes
using pipeline::kMaxUnderWay;

// A stream as the control thread sees it.
struct ControlledStream {
  std::uint32_t stream = 0;  // id; kNoStream: it is not there now, or a stage has refused it
  std::string name;
  bool publishes_raw = false;
  std::shared_ptr<const Skeleton> skeleton;  // models are bound to it; null: samples only
  pipeline::StreamSettings settings{};       // with the stages
  // The models in use, one for each stage, null while there is none. The cold side owns every
  // model; the pipeline only borrows it.
  std::vector<std::shared_ptr<const StageModel>> models{};
  // The device that calibrations must fit.
  std::shared_ptr<devices::PresentDevice> device = std::make_shared<devices::PresentDevice>();
  drivers::Options options;  // of its driver
  std::uint32_t source_number = 0;
  // Of a body of a device with several: the source's name in the config.
  std::string source{};

  [[nodiscard]] bool is_there() const noexcept { return stream != pipeline::kNoStream; }
};

// A stream of this config that is not there (yet), for add_known().
[[nodiscard]] ControlledStream known_stream(const config::StreamConfig& config,
                                            const std::string& source);

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
  virtual Result<pipeline::Take> mark_take(const pipeline::TakeMark& mark) = 0;
  virtual void fill(v1::Stats& stats) = 0;
  // Adds to a list of recordings the clips of takes that are not there: they are being made, or
  // could not be.
  virtual void add_clips(v1::ControlReply& /*reply*/) const {}
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
  // `daemon_control` outlives the handler, as does `kept`, which gets what is set for a stream.
  // `teacher`, which keeps models in that folder, outlives it, too; null: nothing can be taught.
  // Destroy the handler after reader and pipeline thread have ended, because it owns the models and
  // calibrations in use.
  RequestHandler(DaemonControl& daemon_control, devices::KeptSettings& kept,
                 ModelFolder models = {}, Clock clock = system::monotonic_ns,
                 teach::Teacher* teacher = nullptr, RecordingFolder recordings = {});
  ~RequestHandler();
  RequestHandler(const RequestHandler&) = delete;
  RequestHandler& operator=(const RequestHandler&) = delete;

  // Handles one request. The reply is returned at once, or later by acknowledge() if the pipeline
  // has to act first, or by list_on(). Bytes that are not a valid request get a reply with an error
  // sentence, never a crash.
  [[nodiscard]] std::optional<Reply> handle(Requester requester, std::span<const std::byte> bytes);

  // Of the control thread, which beats for each request, and for each model of a list.
  [[nodiscard]] system::Pulse& pulse() noexcept { return pulse_; }

  // Forgets uploads that have stalled. Returns when to call it next at the latest.
  [[nodiscard]] std::int64_t forget_old(std::int64_t now_ns);

  // Gives a stream the model that it was taught, if there is one. The control thread, whenever the
  // teacher calls.
  void use_taught();

  // The pipeline has applied a command: returns its reply, and frees the model that it replaced.
  [[nodiscard]] std::optional<Reply> acknowledge(const pipeline::Ack& ack);

  // Whether lists of models are under way: list_on() goes on with one of them for some time, and
  // returns its reply once it is whole.
  [[nodiscard]] bool is_listing();
  [[nodiscard]] std::optional<Reply> list_on();

  // A stream comes. If its slot has an earlier generation, requests no longer reach that one.
  void add_stream(ControlledStream stream);
  // A stream that may come. While it is not there, parameters and models that are set for it are
  // kept until it comes. What was known of one of this name is replaced.
  void add_known(ControlledStream stream);
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
  // The new value of a live parameter.
  struct NewValue {
    const StageType* stage = nullptr;
    std::string parameter{};
    ParameterValue value{};
  };
  struct ModelFile {
    const StageType* stage = nullptr;  // null: none
    std::string name{};
    std::vector<std::byte> bytes{};
  };
  struct UnderWay {
    Requester requester;
    std::uint32_t stream = 0;
    std::string name{};  // of the stream, for when it has left
    std::size_t stage = 0;
    std::shared_ptr<const StageModel> model{};  // the stage's new model, of this file; null: none
    ModelFile file{};
    std::string_view refusal{};  // of a command: what the stage's refusal means
    std::optional<NewValue> value{};
    bool taught = false;  // of a model: the teacher is told, as nobody has asked
    std::unique_ptr<const drivers::glove::OwnedCalibration> calibration{};
    // Of a calibration.
    std::shared_ptr<devices::PresentDevice> device{};
    std::uint32_t source_number = 0;
    std::shared_ptr<const v1::GloveFit> fit{};  // of a FitGlove request; null: of another
  };
  // What has come of a request.
  struct Done {
    bool under_way = false;  // acknowledge() makes the reply
    std::string stream{};    // for whose next start it is kept; empty: it has taken effect
  };
  // What is replied; nothing: acknowledge() makes the reply.
  using Answer = Result<std::optional<v1::ControlReply>>;
  Answer answer_to(const v1::ControlRequest& request, const Requester& requester);
  Result<Done> apply(const v1::ControlRequest& request, std::span<const std::byte> model,
                     const Requester& requester);
  Result<Done> set_parameter(const v1::ControlRequest& request, const Requester& requester);
  Result<Done> stage_command(const v1::ControlRequest& request, const Requester& requester);
  Result<Done> add_model_part(const v1::ControlRequest& request, const Requester& requester);
  Result<Done> set_model(const std::string& stream, std::span<const std::byte> bytes,
                         const std::string& name, UnderWay under_way);
  Result<Done> take_model_away(const v1::ControlRequest& request, const Requester& requester);
  Result<Done> calibrate(const std::string& stream, const std::string& toml,
                         const std::string& name, UnderWay under_way);
  Answer fit_glove(const v1::ControlRequest& request, const Requester& requester);
  Result<std::shared_ptr<const v1::GloveFit>> judge_or_use(const v1::ControlRequest& request,
                                                           const Requester& requester);
  Answer list_models(const Requester& requester);
  struct Listing;
  bool add_models(Listing& listing);
  using Figures = std::vector<std::shared_ptr<const Skeleton>>;
  [[nodiscard]] Figures figures();  // of the bodies that are there
  std::optional<ModelWords> words_of(const FolderModel& model, const Figures& figures);
  Answer change_models(const v1::ControlRequest& request);
  Result<> check_unused(const std::string& model);
  Answer list_recordings() const;
  Result<std::string> piece_of(const v1::ControlRequest& request);
  Answer mark_take(const v1::ControlRequest& request);
  Answer teach(const v1::ControlRequest& request);
  Result<> teach_step(const v1::ControlRequest& request);
  Result<teach::Pupil> find_pupil(const std::string& name, teach::Subject subject);
  Result<Done> send_haptics(const v1::ControlRequest& request);
  // Whether the slot has a later generation.
  [[nodiscard]] bool is_earlier(Streams::iterator stream) const;
  // The stream of this name that is there, or else is known; of a slot's generations, only the
  // newest is there.
  Result<ControlledStream*> find_stream(const std::string& name);
  // As find_stream, but fails for streams that have no single device.
  Result<ControlledStream*> find_device(const std::string& name);
  // The stage's model by the time that a command that is sent now takes effect.
  [[nodiscard]] const StageModel* coming_model(const ControlledStream& stream,
                                               std::size_t stage) const;
  // The pipeline or the reader gets the command; acknowledge() makes the reply.
  template <typename AnyCommand>
  Result<Done> put_under_way(const ControlledStream& stream, AnyCommand command,
                             UnderWay under_way);
  // Puts the command under way, or keeps the change for a stream that is not there.
  Result<Done> send(const ControlledStream& stream, pipeline::Command command, UnderWay under_way);
  // The stream has the new value or model from now on whenever it is built.
  Done keep(const std::string& stream, const UnderWay& change);
  // What acknowledge() does to the stream.
  void apply(ControlledStream& stream, UnderWay& done);

  DaemonControl& daemon_control_;
  devices::KeptSettings& kept_;
  const ModelFolder models_;
  const RecordingFolder recordings_;
  Clock clock_;
  system::Pulse pulse_;
  teach::Teacher* const teacher_;
  // The clip that was had last as another kind of file, for its further pieces.
  std::mutex converted_mutex_;
  RecordingFolder::Part part_;
  std::string converted_;
  // What the models of the folder say, by name, with what tells whether a file has changed since.
  std::mutex words_mutex_;
  std::map<std::string, std::pair<std::string, ModelWords>> words_;
  std::vector<std::uint32_t> drawn_on_;  // ids of the figures that were known for them
  std::mutex listings_mutex_;
  std::deque<std::unique_ptr<Listing>> listings_;
  std::mutex mutex_;  // guards all below
  Streams streams_;
  std::map<std::string, ControlledStream> known_;  // by name, also those that are there
  // Those that were sent last and are in use by the reader, by number of the source.
  std::map<std::uint32_t, std::unique_ptr<const drivers::glove::OwnedCalibration>> calibrations_;
  Uploads uploads_;
  std::map<std::uint64_t, UnderWay> under_way_;  // by ticket
  std::uint64_t last_ticket_ = 0;
};

}  // namespace posed::control
