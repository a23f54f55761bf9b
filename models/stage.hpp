// The contract of a pipeline stage: style, generate, constrain and those still to come. A stream's
// engine runs its stages as a list; live, offline commands and replay use the same objects.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "proto/frame/frame.hpp"
#include "proto/text/short_text.hpp"

namespace posed {

// Stages a stream may have, and so the length of Frame::stage_us.
inline constexpr std::size_t kMaxStages = std::tuple_size_v<decltype(Frame::stage_us)>;

// What a style asks of the pelvis beside the performer's own motion.
struct RootChange {
  float height_m = 0.0F;                // up
  std::array<float, 3> velocity_m_s{};  // over the ground, in the world
};

// A frame on its way from stage to stage. It borrows: everything is valid during the call that
// passes it on.
struct StageFrame {
  const Frame& frame;
  // Posterior variance of the pose, one a rotation channel in the order of Frame::angle_rad
  // [rad^2]; infinite where nothing is known. Empty: no stage so far estimates it.
  std::span<const double> variance_rad2{};
  // This frame before its style was changed: as the source gave it, or as merge joined it. Null
  // behind a stage that holds frames back or makes its own: the source's frame is gone by then.
  const Frame* input = nullptr;
  // From a style that has learnt it, for a stage that moves the root; else null.
  const RootChange* root = nullptr;
};

// Where a stage puts its frames: none, one or several a call. RT-safe.
class StageOut {
 public:
  StageOut() = default;
  StageOut(const StageOut&) = delete;
  StageOut& operator=(const StageOut&) = delete;
  virtual ~StageOut() = default;

  virtual void frame(const StageFrame& frame) noexcept = 0;
};

// A model bound to the skeleton and the rate of one stream; each stage with a model derives its own
// from it. Built cold; the hot side borrows a plain pointer, and the cold side frees it.
struct StageModel {
  StageModel(std::string file, std::vector<std::string> known)
      : name(std::move(file)), words(std::move(known)) {}
  StageModel(const StageModel&) = delete;
  StageModel& operator=(const StageModel&) = delete;
  virtual ~StageModel() = default;

  std::string name;                // of its file, for messages
  std::vector<std::string> words;  // that it knows, for people: names of styles, gesture labels
  std::string remark;              // a sentence about this skeleton, for people; may be empty
};

// A live parameter, as a number; true and false are 1 and 0.
struct ParameterState {
  double now = 0.0;
  double target = 0.0;  // differs from `now` while the stage changes it gradually
};

// A sentence that a stage reports by itself, once.
struct StageNotice {
  std::size_t index = 0;  // in StageType::notices
};

// A command to a stage, with whatever belongs to it, small enough for a ring.
struct StageCommand {
  std::uint16_t size = 0;
  std::array<std::byte, 1408> bytes{};

  template <typename T>
  [[nodiscard]] static StageCommand of(const T& value) noexcept {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= sizeof(bytes));
    StageCommand command{.size = sizeof(T)};
    std::memcpy(command.bytes.data(), &value, sizeof(T));
    return command;
  }
  // The value that of() has stored; a default one for another type.
  template <typename T>
  RT_SAFE [[nodiscard]] T as() const noexcept {
    T value{};
    if (size == sizeof(T)) std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }
};

// One stage of one stream, with all its state. It knows frame times and the times of ticks, never a
// clock. All calls are RT-safe and come from one thread.
class Stage {
 public:
  Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;
  virtual ~Stage() = default;

  virtual void process(const StageFrame& in, StageOut& out) noexcept = 0;

  // A frame that has left the last stage of partner number `partner`, a stream that the parameters
  // name (StageType::partners). It comes when the partner publishes it, between the calls for the
  // stage's own stream, once that stream has begun.
  virtual void partner(std::size_t /*partner*/, const StageFrame& /*in*/,
                       StageOut& /*out*/) noexcept {}

  // A frame or a sample of the stream arrived, so it is not silent. Called before process().
  virtual void received(std::int64_t /*arrival_ns*/) noexcept {}
  // When tick() is wanted if nothing arrives until then; kNoTime_ns: it is not.
  [[nodiscard]] virtual std::int64_t next_due_ns() const noexcept { return kNoTime_ns; }
  // Nothing has arrived until `now_ns`, at which the tick was due.
  virtual void tick(std::int64_t /*now_ns*/, StageOut& /*out*/) noexcept {}
  // No more frames arrive: those that the stage holds back go out. The stream may go on after it.
  virtual void flush(StageOut& /*out*/) noexcept {}
  // Whether it emits a motion of its own, with or without input: such a stream is not silent.
  [[nodiscard]] virtual bool performs() const noexcept { return false; }

  // Control. Parameters and commands are numbered as in the StageType; only live parameters are
  // set, to values within their range. All of it applies from the next frame on: of set() and use()
  // from the next that enters, of command() from the next that leaves.
  virtual void set(std::size_t /*parameter*/, double /*value*/) noexcept {}
  [[nodiscard]] virtual ParameterState state(std::size_t /*parameter*/) const noexcept {
    return {};
  }
  // A number that the stage measures, numbered as in StageType::readings; NaN: unknown.
  [[nodiscard]] virtual double reading(std::size_t /*reading*/) const noexcept {
    return std::numeric_limits<double>::quiet_NaN();
  }
  // The oldest notice that has not been reported yet; called after each call above.
  [[nodiscard]] virtual std::optional<StageNotice> take_notice() noexcept { return std::nullopt; }
  // `model` is one that the StageType bound; it outlives its use. Null: none from now on. The one
  // before is no longer read. False: refused for now, and nothing has changed.
  [[nodiscard]] virtual bool use(const StageModel* /*model*/) noexcept { return false; }
  [[nodiscard]] virtual const StageModel* model() const noexcept { return nullptr; }
  // False: refused for now, and nothing has changed.
  [[nodiscard]] virtual bool command(std::size_t /*index*/,
                                     const StageCommand& /*command*/) noexcept {
    return false;
  }
  // Describes the command for the event of its stream: "g 1 c".
  virtual void describe(std::size_t /*index*/, const StageCommand& /*command*/,
                        ShortText& /*text*/) const noexcept {}
};

}  // namespace posed
